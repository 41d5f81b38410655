"""Backstepping without derivatives of virtual controls: dynamic surface control."""
