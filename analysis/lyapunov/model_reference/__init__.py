"""Bounds that hold for all time: model reference adaptive control."""
