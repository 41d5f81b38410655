"""The page of a study, or its part of another page."""
