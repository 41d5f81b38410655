"""Functions of others: read without being called, and made understandable for numba."""
