"""The polynomial that follows an event function, against NumPy's."""

import numba
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from nlctl.native.integrate.methods import quartic as q
from nlctl.native.integrate.methods.tsit5 import TSIT5

pytestmark = pytest.mark.slow  # one run, or one compiled function, for all of them

ROWS = TSIT5.pair().inside


@numba.njit(error_model="numpy")
def looked_at(f, at, x, slope):
    """Call what only machine code can call: value, slope, doubt, and the least value's place."""
    n = np.empty(5)
    q.quartic(f, at, n)
    least, where = q.least_value(n, at, slope)
    return q.polynomial_at(n, at, x), q.slope_at(n, at, x), q.doubt(n, at), least, where


@numba.njit(error_model="numpy")
def bent(middle, below, least, above):
    return q.parabola(0.0, middle, 1.0, below, least, above)


TINY = 1e-6  # below it `numpy.roots` loses the other roots
coefficients = st.lists(
    st.floats(-10, 10).map(lambda c: c if abs(c) > TINY else 0.0), min_size=5, max_size=5
)


def through(power, at, x=0.5, slope=False):
    """Look at a polynomial, highest power first, by its five values."""
    return looked_at(np.polyval(power, [0.0, *at[:3], 1.0]), at, x, slope)


@pytest.mark.parametrize("row", range(3))
@given(power=coefficients, x=st.floats(0, 1))
def test_value_and_slope_of_any_quartic(row, power, x):
    """It goes through five values: a polynomial of degree 4 is found again, whatever the nodes."""
    value, slope = through(power, ROWS[row], x)[:2]
    assert value == pytest.approx(np.polyval(power, x), abs=1e-9)
    assert slope == pytest.approx(np.polyval(np.polyder(power), x), abs=1e-7)


@pytest.mark.parametrize("slope", [False, True])
@given(power=coefficients)
def test_the_least_value_is_found_on_the_grid_and_between(slope, power):
    """Against the roots of the derivative."""
    at, wanted = ROWS[0], np.poly1d(np.polyder(power) if slope else power)
    roots = np.atleast_1d(wanted.deriv().roots)
    inner = [float(r.real) for r in roots if abs(r.imag) < 1e-12 and 0 < r.real < 1]
    exact = min(float(wanted(x)) for x in [0.0, 1.0, *inner])
    least, x = through(power, at, slope=slope)[3:]
    extent = max(1.0, float(np.abs(power).max()))
    assert least == pytest.approx(exact, abs=2e-2 * extent)
    assert float(wanted(x)) == pytest.approx(exact, abs=2e-2 * extent)


@given(power=coefficients, middle=st.floats(0.1, 0.9))
def test_a_parabola_is_its_own(power, middle):
    """Slope and bend from three of its values."""
    a, b, c = power[:3]
    assume(abs(a) > 1e-3)
    values = np.polyval([a, b, c], [0.0, middle, 1.0])
    slope, bend = bent(middle, *values)
    assert (slope, bend) == pytest.approx((2 * a * middle + b, a), abs=1e-10)


@given(power=coefficients)
def test_a_parabola_leaves_no_doubt_but_a_cubic_does(power):
    """What may be wrong is the last two terms."""
    at = ROWS[0]
    assert through([0.0, 0.0, *power[2:]], at)[2] == pytest.approx(0.0, abs=1e-9)
    wanted = 0.1 * at[3] * abs(power[1])
    assert through([0.0, *power[1:]], at)[2] == pytest.approx(wanted, abs=1e-9)
