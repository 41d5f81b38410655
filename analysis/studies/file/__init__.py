"""The study file: its shapes, what it names, every mistake at once."""
