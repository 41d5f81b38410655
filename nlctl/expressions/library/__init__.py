"""Functions of NumPy, SciPy and Python, each written once in terms of elementary expressions.

What NumPy computes by moving elements, adding and multiplying, it computes itself (`cells`,
`shapes`); the rest are formulas.  What reads expressions needs to know none of them.
"""

from . import (
    complex_numbers,
    counted,
    creation,
    elementary,
    laws,
    linear_algebra,
    matrices,
    python,
    reductions,
    rotations,
    samples,
    series,
    shapes,
    special,
    spectra,
    tables,
)

__all__ = [
    "complex_numbers",
    "counted",
    "creation",
    "elementary",
    "laws",
    "linear_algebra",
    "matrices",
    "python",
    "reductions",
    "rotations",
    "samples",
    "series",
    "shapes",
    "special",
    "spectra",
    "tables",
]
