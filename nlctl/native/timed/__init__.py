"""Functions of time alone, before a run: when they jump, and how far steps may lead."""
