"""Functions of NumPy, SciPy and Python, each written once in terms of elementary expressions.

What NumPy computes by moving elements, adding and multiplying, it computes itself (`cells`,
`shapes`); the rest are formulas.  What reads expressions needs to know none of them.
"""

from . import complex_numbers as complex_numbers
from . import creation as creation
from . import elementary as elementary
from . import linear_algebra as linear_algebra
from . import python as python
from . import reductions as reductions
from . import rotations as rotations
from . import shapes as shapes
from . import special as special
from . import spectra as spectra
from . import tables as tables
