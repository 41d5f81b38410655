"""Rows of a design simulated and measured, wherever there are processors, and kept."""
