"""The kinds of analysis that a study may ask for."""
