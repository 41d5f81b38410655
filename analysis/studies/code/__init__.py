"""Code that a study names: which of it may run, whose word that is, and how it is loaded."""
