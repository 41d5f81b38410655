"""What to do about a function that is called unchanged: how it would become expressions."""

import re

# of what a reason says, the first line that fits
_REMEDIES = (
    (r"fsolve|optimize\S*\.root\b|least_squares|minimize|fixed_point|newton_krylov|broyden",
     "connect its equation as an algebraic loop, or search for one number "
     "by scipy.optimize.brentq or newton, which are traced"),
    (r"toms748|ridder|brenth|root_scalar",
     "scipy.optimize.brentq, bisect and newton are traced"),
    (r"solve_ivp|odeint|solve_bvp", "make what it integrates states of the block"),
    (r"integral|quad|integrate",
     "map an infinite range to a finite one, sum by np.polynomial.legendre.leggauss, or make the "
     "integral a state of the block"),
    (r"passes than are written out",
     "a better first guess, or a method that needs fewer passes"),
    (r"\b(jv|jn|yv|yn|iv|kv|j0|j1|y0|y1|i0|i1|k0|k1|ber|bei|struve|"
     r"ellip\w*|beta\w*|hyp\w*|airy|zeta|lambertw|Lambert)\b",
     "a table of it before the run, scipy.interpolate.CubicSpline, is traced"),
    (r"griddata|RBFInterpolator|LinearND|CloughTocher|NearestND|KDTree",
     "a table on a grid, scipy.interpolate.RegularGridInterpolator, is traced"),
    (r"float32", "leave out dtype=np.float32: what runs computes in doubles"),
    (r"np\.roots", "search for one root by scipy.optimize.brentq or newton"),
    (r"eigen|singular|svd|\beig\w*|schur|logm|sqrtm|pinv|condition number|qr\b",
     "compute it before the run where the matrix is constant; of two rows write the formula"),
    (r"writes messages|message is written", "leave messages out, or read them off the response"),
    (r"round to decimals", "np.round of np.asarray(value) is traced"),
    (r"\btry\b|finally|suppress", "write an if for the case that fails"),
    (r"paths through it|whose end depends|too long|too many|numbers are computed",
     "fewer cases in one function: np.where or a table instead of if, or several blocks"),
    (r"mask|indexing|assign|places in|reshap", "np.where(condition, one, other) of whole arrays"),
)  # fmt: skip
_OTHERWISE = "write it by functions of NumPy that are traced, or put it into a block of its own"


def remedy_of(reason: str) -> str:
    """Return what to do about a function that is not traced for this reason."""
    return next((text for what, text in _REMEDIES if re.search(what, reason)), _OTHERWISE)
