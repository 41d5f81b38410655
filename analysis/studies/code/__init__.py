"""Code that a study names: which of it may run, who trusts it, and how it is loaded."""
