"""Statements from samples: probabilities, comparisons, sensitivities."""
