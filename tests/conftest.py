"""Hypothesis without deadlines and with the same examples in every run."""

from hypothesis import settings

settings.register_profile("nlctl", deadline=None, derandomize=True, database=None, max_examples=50)
settings.load_profile("nlctl")
