"""Splines, rotations, matrices, masks and functions of SciPy."""

import math

import numpy as np
import scipy.linalg
import scipy.special
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import Rotation

from engineers.entry import engineered

XS = np.linspace(-2, 2, 9)
YS = np.tanh(XS)
GRID = np.outer(XS, YS)
RGI = RegularGridInterpolator((XS, XS), GRID, bounds_error=False, fill_value=None)


@engineered(2)
def grid_interpolated(t, x, u, params):
    return [x[1], -RGI((x[0], x[1])).item() + u[0]]


@engineered(4)
def rotated(t, x, u, params):
    q = x / np.linalg.norm(x)
    w = Rotation.from_quat(q).apply([0, 0, 1.0])
    return np.append(-x[:3] * w, u[0] - x[3])


@engineered(3)
def euler_angles(t, x, u, params):
    R = Rotation.from_euler("xyz", x).as_matrix()
    return R @ np.array([0, 0, -1.0]) - x + u[0]


@engineered(3)
def rotvec(t, x, u, params):
    return Rotation.from_rotvec(x).inv().apply(np.array([1.0, 0.0, 0.0])) - x + u[0]


@engineered(8)
def solve_eight(t, x, u, params):
    M = np.diag(2 + np.cos(x)) + 0.1 * np.ones((8, 8))
    return np.linalg.solve(M, -x + u[0])


@engineered(7)
def inverse_seven(t, x, u, params):
    M = np.eye(7) * 3 + 0.2 * np.outer(np.sin(x), np.sin(x))
    return -np.linalg.inv(M) @ x + u[0]


@engineered(4)
def rows_and_blocks(t, x, u, params):
    J = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2) * 2, -0.1 * np.eye(2)]])
    return J @ x + np.r_[0, 0, u[0], np.sin(x[0])]


@engineered(4)
def mask_read_written(t, x, u, params):
    d = -x.copy()
    hot = x > 1
    d[hot] = -2 * x[hot] + 1
    d[~hot] *= 0.5
    return d + u[0]


@engineered(4)
def where_nonzero_any(t, x, u, params):
    return np.where((x > 1).any(), -2 * x, -x) + u[0]


@engineered(3)
def array_methods(t, x, u, params):
    return (x - x.mean()).clip(-1, 1) * -x.std() - x.dot(x) * x / (1 + x.max() - x.min()) + u[0]


@engineered(3)
def sorted_median(t, x, u, params):
    return np.median(x) - x + np.percentile(x, 25) * 0.1 + u[0]


@engineered(4)
def global_array_index(t, x, u, params):
    i = int(np.clip(np.floor(x[0] + 4), 0, 8))
    return -x * abs(YS[i]) + u[0]


@engineered(3)
def nested_closures(t, x, u, params):
    def gain(k):
        def law(e):
            return k * np.tanh(e)

        return law

    laws = [gain(k) for k in (1.0, 2.0, 3.0)]
    return [-l(v) + u[0] for l, v in zip(laws, x)]


@engineered(2)
def while_newton(t, x, u, params):
    y = 1.0
    n = 0
    while n < 4:
        y = y - (y**3 + y - 1 - x[0] ** 2) / (3 * y**2 + 1)
        n += 1
    return [x[1], -y - x[1] + u[0]]


@engineered(2)
def recursion(t, x, u, params):
    def fac(n):
        return 1 if n < 2 else n * fac(n - 1)

    return [x[1], -sum((-1) ** k * x[0] ** (2 * k + 1) / fac(2 * k + 1) for k in range(4)) + u[0]]


@engineered(2)
def star_unpack(t, x, u, params):
    first, *rest = x
    (r,) = u
    return [rest[0], -first - sum(rest) + r]


@engineered(3)
def lookup_of_functions(t, x, u, params):
    fs = {"a": np.sin, "b": np.tanh, "c": lambda v: v / (1 + abs(v))}
    return [-fs[n](v) + u[0] for n, v in zip(fs, x)]


@engineered(3)
def tensordot_trace(t, x, u, params):
    M = np.outer(x, x)
    return -x * np.trace(M) / (1 + np.tensordot(M, M)) + np.cross(x, [0, 0, 1.0]) + u[0]


@engineered(4)
def digitized(t, x, u, params):
    k = np.array([0.5, 1.0, 2.0, 4.0])[np.digitize(x, [-1.0, 0.0, 1.0])]
    return -k * x + u[0]


@engineered(2)
def math_functions(t, x, u, params):
    return [
        x[1],
        -math.copysign(math.sqrt(abs(x[0])), x[0])
        - math.atan2(x[1], 1 + x[0] ** 2)
        - math.fsum([x[0], x[1]]) * 0.1
        + math.hypot(x[0], x[1]) * 0.01
        + u[0],
    ]


@engineered(3)
def lambda_sort_key(t, x, u, params):
    a, b, c = sorted(x, key=abs)
    return [-a + u[0], -b, -c]


@engineered(3)
def numpy_where_tuple(t, x, u, params):
    out = np.zeros(3)
    for i in range(3):
        out[i] = -x[i] if i != 1 else -(x[i] ** 3)
    np.add(out, u[0], out=out)
    return out


@engineered(4)
def svd_like_norms(t, x, u, params):
    return (
        -x / np.linalg.norm(x.reshape(2, 2))
        - x * np.linalg.norm(x, np.inf)
        + np.linalg.norm(x, 1) * 0.1
        + u[0]
    )


@engineered(4)
def roll_diff(t, x, u, params):
    return np.roll(x, 1) - 2 * x + np.roll(x, -1) + np.diff(x, append=0) * 0.1 + u[0]


@engineered(2)
def polynomial_objects(t, x, u, params):
    p = np.poly1d([1.0, 0.0, -1.0])
    return [x[1], -p(x[0]) * x[0] - np.polynomial.polynomial.polyval(x[1], [0, 1, 0.1]) + u[0]]


@engineered(3)
def einsum_stack(t, x, u, params):
    M = np.stack([x, np.sin(x), np.cos(x)])
    return -np.einsum("ij,j->i", M, x) + u[0]


@engineered(2)
def chained_comparison(t, x, u, params):
    k = 3.0 if -1 < x[0] <= 1 else 1.0
    return [x[1], -k * x[0] - x[1] + u[0]]


@engineered(2)
def np_sign_any_all(t, x, u, params):
    if all(v > 0 for v in x) or any(abs(v) > 3 for v in x):
        return [-x[0] + u[0], -x[1]]
    return [x[1], -x[0]]


@engineered(4)
def meshgrid_sum(t, x, u, params):
    a, b = np.meshgrid(x[:2], x[2:])
    return -(a * b).flatten() - x + u[0]


@engineered(2)
def unwrap_angle(t, x, u, params):
    return [x[1], -((x[0] + np.pi) % (2 * np.pi) - np.pi) - x[1] + u[0]]


@engineered(3)
def cumulative_logsumexp(t, x, u, params):
    return -scipy.special.softmax(x) - scipy.special.logsumexp(x) * 0.1 - x + u[0]


@engineered(2)
def divmod_floor(t, x, u, params):
    q, r = divmod(x[0], 1.5)
    return [x[1], -r - 0.1 * q - x[1] + u[0]]


@engineered(3)
def block_diag_kron(t, x, u, params):
    M = scipy.linalg.block_diag([[1.0]], [[0, 1.0], [-1.0, -0.5]])
    return -M @ x + np.kron([1.0, 0], [1, 0])[:3] * u[0]


@engineered(2)
def slices_of_params(t, x, u, params):
    g = np.asarray([1.0, 2.0, 3.0])
    a, b = g[::2]
    return [x[1], -a * x[0] - b * x[1] + u[0]]


@engineered(3)
def ufunc_reduce(t, x, u, params):
    return (
        -x * np.multiply.reduce(1 + 0.1 * x)
        - np.maximum.accumulate(x)
        + np.add.outer(x, x).diagonal() * 0.1
        + u[0]
    )


@engineered(12)
def solve_twelve(t, x, u, params):
    M = np.diag(3 + np.cos(x)) + 0.1 * np.outer(np.sin(x), x)
    return np.linalg.solve(M, -x + u[0])
