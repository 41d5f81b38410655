"""A study file, read: kinds of its own, every mistake at once, and how it is written again."""
