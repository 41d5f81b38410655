"""Equations: plain Python functions that machine code may call too."""

from numba.extending import register_jitable

equation = register_jitable
"""Mark a function as an equation of a block.

An equation is written once, in plain Python and NumPy, and read by everybody: python-control
calls it as it stands, the native engine compiles it, interval proofs evaluate it on balls and
the reader finds it in the paper.  The decorator returns the function unchanged and only tells
numba (whose ``register_jitable`` it is) that compiled code may call it.

What an equation may contain is what both readers understand: arithmetic, comparisons, NumPy
functions, tuples.  It is pure: the result depends on the arguments alone, which stay unchanged.
"""
