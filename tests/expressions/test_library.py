"""Each function that is written in terms of others is NumPy's: on constants both are numbers."""

import math

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
from scipy import interpolate, special
from scipy.spatial.transform import Rotation

from nlctl.expressions.arrays import Tracer, traced
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.graph import Graph
from nlctl.expressions.library.rotations import enter_rotations
from nlctl.expressions.library.special import enter_scipy
from nlctl.expressions.library.splines import called_object, enter_splines
from nlctl.expressions.library.table import WRITTEN, written_out
from nlctl.expressions.stage import Stage
from nlctl.expressions.staged import settled

enter_scipy(), enter_splines(), enter_rotations()
NUMBERS = np.array([0.3, -1.5, 2.0, 2.0, 0.0, -0.25, 7.5])
WITH_NAN = np.array([1.0, np.nan, -2.0, 1.0, 3.0])
LONG = np.sin(np.arange(20.0))
TABLE = np.arange(12.0).reshape(3, 4) % 5 - 1.5
SQUARE = np.array([[2.0, 1.0, 0.5], [4.0, -1.0, 0.0], [1.0, 1.0, 3.0]])
LINES = (NUMBERS, WITH_NAN, LONG)

OF_LINES = {
    np.max: {}, np.min: {}, np.ptp: {}, np.sum: {}, np.mean: {}, np.var: {}, np.std: {},
    np.prod: {}, np.any: {}, np.all: {}, np.argmax: {}, np.argmin: {}, np.sort: {}, np.median: {},
    np.nanmax: {}, np.nanmin: {}, np.nansum: {}, np.nanmean: {}, np.count_nonzero: {},
    np.cumsum: {}, np.cumprod: {}, np.diff: {}, np.gradient: {}, np.flip: {}, np.isnan: {},
    np.isfinite: {}, np.isinf: {}, np.signbit: {}, np.sinc: {}, np.square: {}, np.reciprocal: {},
    np.deg2rad: {}, np.rad2deg: {}, np.round: {}, np.fix: {}, np.nan_to_num: {}, np.unwrap: {},
    np.linalg.norm: {}, np.trapezoid: {}, np.cov: {}, np.ediff1d: {}, np.ravel: {},
    scipy.integrate.cumulative_trapezoid: {}, special.expit: {}, special.erf: {}, special.erfc: {},
    special.softmax: {}, special.logsumexp: {}, special.log_expit: {},
}  # fmt: skip
WITH_OPTIONS = [
    (np.std, {"ddof": 1}), (np.var, {"ddof": 1}), (np.diff, {"n": 2}), (np.round, {"decimals": 1}),
    (np.round, {"decimals": -1}), (np.linalg.norm, {"ord": 1}), (np.linalg.norm, {"ord": np.inf}),
    (np.linalg.norm, {"ord": -np.inf}), (np.nan_to_num, {"nan": 3.0}), (np.diff, {"prepend": 0.0}),
    (np.diff, {"append": 1.0}), (np.mean, {"keepdims": True}), (np.max, {"initial": 1.0}),
]  # fmt: skip
CALLS = [
    (np.roll, (NUMBERS, 2)), (np.roll, (LONG, -3)), (np.roll, (TABLE, 1, 0)), (np.roll, (TABLE, 1)),
    (np.pad, (NUMBERS, 2)), (np.pad, (LONG, (1, 2), "edge")), (np.pad, (TABLE, 1, "wrap")),
    (np.pad, (LONG, 2, "reflect")), (np.tile, (NUMBERS, 2)), (np.repeat, (NUMBERS, 3)),
    (np.outer, (NUMBERS, LONG)), (np.kron, (SQUARE, TABLE)), (np.cross, (SQUARE[0], SQUARE[1])),
    (np.einsum, ("ij,jk->ki", SQUARE, TABLE)), (np.einsum, ("ii", SQUARE)), (np.trace, (SQUARE,)),
    (np.inner, (NUMBERS, NUMBERS)), (np.vdot, (LONG, LONG)), (np.tensordot, (SQUARE, TABLE, 1)),
    (np.dot, (SQUARE, TABLE)), (np.matmul, (SQUARE, SQUARE[0])), (np.convolve, (LONG, NUMBERS)),
    (np.linalg.matrix_power, (SQUARE, 3)), (np.linalg.multi_dot, ([SQUARE, SQUARE, TABLE],)),
    (np.linalg.solve, (SQUARE, TABLE)), (np.linalg.solve, (SQUARE, SQUARE[0])),
    (np.linalg.inv, (SQUARE,)), (np.linalg.det, (SQUARE,)), (np.linalg.det, (SQUARE[::-1],)),
    (np.linalg.cholesky, (SQUARE @ SQUARE.T,)), (scipy.linalg.cholesky, (SQUARE @ SQUARE.T,)),
    (np.linalg.eigvalsh, (SQUARE[:2, :2],)), (np.linalg.lstsq, (TABLE.T, np.arange(4.0))),
    (np.diag, (NUMBERS,)), (np.diag, (TABLE,)), (np.tril, (SQUARE,)), (np.triu, (SQUARE, 1)),
    (np.stack, ([NUMBERS, NUMBERS],)), (np.vstack, ([LONG, LONG],)),
    (np.hstack, ([LONG, NUMBERS],)),
    (np.column_stack, ((NUMBERS, NUMBERS),)), (np.concatenate, ([TABLE, TABLE], 1)),
    (np.block, ([[SQUARE, SQUARE], [SQUARE, SQUARE]],)), (np.split, (LONG, 4)),
    (np.array_split, (NUMBERS, 3)), (np.insert, (NUMBERS, 1, 5.0)), (np.delete, (NUMBERS, 2)),
    (np.take, (NUMBERS, [2, 0])), (np.append, (NUMBERS, LONG)), (np.meshgrid, (NUMBERS, LONG)),
    (np.transpose, (TABLE,)), (np.swapaxes, (TABLE, 0, 1)), (np.rot90, (TABLE,)),
    (np.moveaxis, (TABLE, 0, 1)), (np.squeeze, (TABLE[:, :1],)), (np.atleast_2d, (NUMBERS,)),
    (np.broadcast_to, (NUMBERS, (2, 7))), (np.max, (TABLE, 0)), (np.min, (TABLE, 1)),
    (np.mean, (TABLE, 1)), (np.std, (TABLE, 0)), (np.sum, (TABLE, (0, 1))),
    (np.any, (TABLE > 2, 0)),
    (np.argmax, (TABLE, 1)), (np.argmin, (TABLE, 0)), (np.sort, (TABLE, 0)),
    (np.median, (TABLE, 1)),
    (np.cumsum, (TABLE, 1)), (np.prod, (TABLE, 0)), (np.average, (NUMBERS, None, np.arange(7.0))),
    (np.average, (TABLE, 0, np.arange(3.0))), (np.quantile, (NUMBERS, 0.3)),
    (np.percentile, (NUMBERS, [10, 50, 75])), (np.corrcoef, (NUMBERS, NUMBERS**2)),
    (np.cov, (TABLE,)), (np.linalg.norm, (TABLE,)), (np.linalg.norm, (TABLE, 1)),
    (np.linalg.norm, (TABLE, np.inf)), (np.linalg.norm, (TABLE, None, 1)),
    (np.argsort, (LONG[:8],)),
    (np.where, (NUMBERS > 0, NUMBERS, 1.0)), (np.clip, (WITH_NAN, -1, 1)),
    (np.clip, (LONG, 0, None)),
    (np.select, ([NUMBERS < 0, NUMBERS < 1], [NUMBERS, 5.0], 9.0)),
    (np.piecewise, (NUMBERS, [NUMBERS < 0, NUMBERS > 1], [-1.0, lambda z: z**2, 3.0])),
    (np.isclose, (NUMBERS, NUMBERS + 1e-9)), (np.fmax, (WITH_NAN, 0.0)), (np.fmin, (0.0, WITH_NAN)),
    (np.floor_divide, (NUMBERS, 0.7)), (np.floor_divide, (NUMBERS, -0.25)),
    (np.divmod, (NUMBERS, 0.5)),
    (np.floor_divide, (NUMBERS, 0.0)), (np.float_power, (NUMBERS**2, 1.5)), (np.modf, (NUMBERS,)),
    (np.logaddexp2, (NUMBERS, LONG[:7])), (np.ldexp, (NUMBERS, 3)), (np.vander, (NUMBERS, 3)),
    (np.interp, (np.linspace(-1, 4, 31), [0.0, 1.0, 3.0], [1.0, -1.0, 0.5])),
    (np.interp, (WITH_NAN, [0.0, 1.0, 3.0], [1.0, -1.0, 0.5], -9.0, 9.0)),
    (np.searchsorted, ([0.0, 1.0, 1.0, 2.0], NUMBERS)), (np.searchsorted, ([0.0, 1.0], WITH_NAN)),
    (np.searchsorted, ([0.0, 2.0], NUMBERS, "right")), (np.digitize, (NUMBERS, [0.0, 2.0])),
    (np.digitize, (NUMBERS, [0.0, 2.0], True)), (np.polyval, ([1.0, 0.0, -2.0], NUMBERS)),
    (np.polynomial.polynomial.polyval, (NUMBERS, [1.0, 0.0, -2.0])), (np.linspace, (0.0, 2.0, 7)),
    (special.xlogy, (NUMBERS**2, NUMBERS**2)), (special.xlog1py, (NUMBERS, NUMBERS**2)),
    (special.logit, (special.expit(NUMBERS),)), (math.dist, ([0.0, 1.0], [2.0, 3.0])),
    (scipy.linalg.block_diag, (SQUARE, TABLE)), (math.prod, ([2.0, 3.5],)), (math.floor, (-1.5,)),
    *((math.remainder, (x, 2.0)) for x in (-7.0, -5.0, -3.0, 0.5, 1.0, 3.0, 5.0, 6.999)),
    (np.copysign, (NUMBERS, -1.0)), (np.allclose, (NUMBERS, NUMBERS)), (np.extract, (None,)),
][:-1]  # fmt: skip


def staged(value):
    """Return arrays as arrays of expressions, also within lists."""
    if isinstance(value, np.ndarray) and value.dtype == float:
        return traced(GRAPH, value)
    if isinstance(value, np.ndarray) and value.dtype == bool:
        return traced(GRAPH, value)
    if type(value) in (list, tuple) and any(isinstance(v, np.ndarray | list) for v in value):
        return type(value)(map(staged, value))
    return value


GRAPH = Graph()


def evaluated(found):
    """Return the values of what may have kept vectors of constants as they are."""
    if not isinstance(found, Tracer):
        return settled(found)
    exprs = [e for e, _ in found.reshape(-1).pieces()]
    parts = [
        np.broadcast_to(np.ravel(v), size)
        for v, (_, size) in zip(
            evaluate_expressions(exprs, {}), found.reshape(-1).pieces(), strict=True
        )
    ]
    return np.concatenate(parts).reshape(found.shape)


def equal(found, wanted):
    if isinstance(wanted, tuple | list):
        assert len(found) == len(wanted)
        for one, other in zip(found, wanted, strict=True):
            if np.size(other):
                equal(one, other)
        return
    found = evaluated(found)
    assert np.shape(found) == np.shape(wanted)
    np.testing.assert_allclose(
        np.asarray(found, float), np.asarray(wanted, float), rtol=1e-13, atol=1e-14
    )


@pytest.mark.filterwarnings("ignore:numpy.fix is deprecated:DeprecationWarning")  # NumPy 2.5
@pytest.mark.parametrize("line", range(len(LINES)))
@pytest.mark.parametrize("function", OF_LINES, ids=lambda f: f.__name__)
def test_a_function_of_one_array(function, line):
    """With ties, zeros and NaN, short and long."""
    with np.errstate(all="ignore"):
        equal(written_out(GRAPH, function, traced(GRAPH, LINES[line])), function(LINES[line]))


@pytest.mark.parametrize(("function", "options"), WITH_OPTIONS)
def test_options(function, options):
    for line in LINES:
        with np.errstate(all="ignore"):
            wanted = function(line, **options)
        equal(written_out(GRAPH, function, traced(GRAPH, line), **options), wanted)


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call[0].__name__)
def test_a_function_of_several_things(call):
    function, arguments = call
    with np.errstate(all="ignore"):
        equal(written_out(GRAPH, function, *map(staged, arguments)), function(*arguments))


X = np.linspace(-0.5, 5.5, 25)
KNOTS = np.arange(6.0)
CURVES = [
    interpolate.CubicSpline(KNOTS, np.sin(KNOTS)),
    interpolate.PchipInterpolator(KNOTS, np.sin(KNOTS)),
    interpolate.Akima1DInterpolator(KNOTS, np.sin(KNOTS)),
    interpolate.CubicSpline(KNOTS, np.sin(KNOTS), extrapolate=False),
    interpolate.make_interp_spline(KNOTS, np.sin(KNOTS), k=2),
    interpolate.interp1d(KNOTS, np.sin(KNOTS), fill_value="extrapolate"),
    interpolate.interp1d(KNOTS, np.sin(KNOTS), bounds_error=False),
    interpolate.interp1d(KNOTS, np.sin(KNOTS), bounds_error=False, fill_value=(-1.0, 2.0)),
    interpolate.interp1d(KNOTS, np.sin(KNOTS), "cubic", fill_value="extrapolate"),
    interpolate.UnivariateSpline(KNOTS, np.sin(KNOTS), s=0, ext=1),
    interpolate.InterpolatedUnivariateSpline(KNOTS, np.sin(KNOTS), ext=3),
    np.poly1d([1.0, 0.0, -2.0, 0.5]),
    np.polynomial.Polynomial([1.0, 0.0, -2.0], domain=[0, 4]),
]


@pytest.mark.parted
@pytest.mark.parametrize("curve", CURVES, ids=lambda c: type(c).__name__)
def test_curves_of_scipy(curve):
    """Between their knots, at them, and beyond both ends."""
    equal(called_object(GRAPH, curve, traced(GRAPH, X)), curve(X))


@pytest.mark.parametrize("fill", [None, -7.0])
def test_a_grid_of_scipy(fill):
    table = interpolate.RegularGridInterpolator(
        (np.arange(3.0), np.arange(4.0)), TABLE, bounds_error=False, fill_value=fill
    )
    points = np.stack([X[:24] / 2, np.roll(X[:24], 5) / 1.5], axis=1)
    equal(called_object(GRAPH, table, traced(GRAPH, points)), table(points))


SEQUENCES = ("xyz", "zyx", "XYZ", "ZYX", "zxz", "ZXZ", "YXY", "xzx")


@pytest.mark.parted
@pytest.mark.parametrize("seq", SEQUENCES)
def test_rotations(seq):
    """Made of quaternions, vectors and angles, and read as each of these, also at gimbal lock."""
    rng = np.random.default_rng(3)
    for angles in (*rng.normal(size=(8, 3)), np.array([0.3, 0.0, 0.4])):
        ours = WRITTEN[Rotation, "from_euler"](GRAPH, seq, traced(GRAPH, angles))
        theirs = Rotation.from_euler(seq, angles)
        equal(ours.as_matrix(), theirs.as_matrix())
        equal(ours.as_rotvec(), theirs.as_rotvec())
        equal(ours.magnitude(), theirs.magnitude())
        equal((ours * ours.inv()).as_matrix(), np.eye(3))
        equal(ours.apply(angles), theirs.apply(angles))
        if angles[1]:
            equal(ours.as_euler(seq), theirs.as_euler(seq))
        again = WRITTEN[Rotation, "from_rotvec"](GRAPH, ours.as_rotvec())
        equal(again.as_matrix(), theirs.as_matrix())
        equal(WRITTEN[Rotation, "from_quat"](GRAPH, ours.as_quat()).as_matrix(), theirs.as_matrix())


def test_a_stage_knows_names_as_they_are_imported():
    """``from numpy.linalg import norm`` is the same function as ``np.linalg.norm``."""
    stage = Stage(GRAPH)
    for name in (np.linalg.norm, np.mean, special.erf, math.floor):
        assert callable(stage.instead(name))
    equal(stage.instead(np.linalg.norm)(traced(GRAPH, NUMBERS)), np.linalg.norm(NUMBERS))
