"""Nussbaum functions: property (12), the slow drift of zeta, long runs."""
