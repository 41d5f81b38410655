"""Signals over time as figures: of one run, in groups, and of many."""
