"""Regions of attraction and barriers: proposed by convex programs, proved by enclosures."""
