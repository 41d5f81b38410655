"""Expressions: what plain Python functions compute, once read, for everyone who reads it."""

from . import indexing as indexing  # it gives arrays of expressions their item operators
