"""Expressions: what plain Python functions compute, once read, for everyone who reads it."""
