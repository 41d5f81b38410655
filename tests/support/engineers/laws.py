"""Machines, filters, observers and laws: transforms, look-ups, networks, habits of Python."""

import numbers
from dataclasses import dataclass
from functools import reduce, singledispatch, wraps

import control as ct
import numpy as np
from scipy.linalg import cho_factor, cho_solve

from engineers.entry import engineered

CLARKE = 2 / 3 * np.array([[1, -0.5, -0.5], [0, np.sqrt(3) / 2, -np.sqrt(3) / 2], [0.5, 0.5, 0.5]])


def park(theta):
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


@engineered(5, 4)
def pmsm_abc_to_dq(t, x, u, params):
    Rs, Ld, Lq, psi, p, J = 0.5, 5e-3, 8e-3, 0.1, 4, 1e-3
    i_d, i_q, i_0, w, th = x
    v_dq = (park(th) @ CLARKE @ np.asarray(u[:3]))[:2]
    Te = 1.5 * p * (psi * i_q + (Ld - Lq) * i_d * i_q)
    return np.array(
        [
            (v_dq[0] - Rs * i_d + p * w * Lq * i_q) / Ld,
            (v_dq[1] - Rs * i_q - p * w * (Ld * i_d + psi)) / Lq,
            -Rs / 1e-3 * i_0,
            (Te - u[3] - 1e-3 * w) / J,
            p * w,
        ]
    )


@engineered(5, 3)
def induction_machine_complex(t, x, u, params):
    """Space vectors as complex numbers."""
    i_s = complex(x[0], x[1])
    psi_r = x[2] + 1j * x[3]
    w = x[4]
    us = u[0] + 1j * u[1]
    Rs, Rr, Ls, Lr, Lm = 1.0, 0.8, 0.1, 0.1, 0.095
    sigma = 1 - Lm**2 / (Ls * Lr)
    tr = Lr / Rr
    dpsi = Lm / tr * i_s - (1 / tr - 1j * w) * psi_r
    dis = (us - Rs * i_s - Lm / Lr * dpsi) / (sigma * Ls)
    Te = 1.5 * Lm / Lr * (psi_r.conjugate() * i_s).imag
    return [dis.real, dis.imag, dpsi.real, dpsi.imag, (Te - u[2]) / 0.05]


YBUS = np.array(
    [[3 - 9j, -1 + 5j, -2 + 4j], [-1 + 5j, 3 - 10j, -2 + 5j], [-2 + 4j, -2 + 5j, 4 - 9j]]
)


@engineered(6, 3)
def multimachine_swing(t, x, u, params):
    delta, omega = np.array_split(x, 2)
    E = np.array([1.05, 1.0, 1.02]) * np.exp(1j * delta)
    I = YBUS @ E
    Pe = np.real(E * I.conj())
    H = np.array([5.0, 4.0, 3.0])
    return np.concatenate((2 * np.pi * 50 * omega / 100, (u - Pe - 2.0 * omega) / (2 * H)))


@engineered(3, 1)
def svpwm_sector(t, x, u, params):
    ang = np.arctan2(x[1], x[0]) % (2 * np.pi)
    sector = int(ang // (np.pi / 3))
    table = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]])
    gates = table[sector]
    return gates - 0.5 * x + u[0]


@engineered(3, 2)
def transformer_saturation_table(t, x, u, params):
    flux = np.array([-2, -1.2, -1.0, 0, 1.0, 1.2, 2.0])
    im = np.array([-10, -1, -0.1, 0, 0.1, 1, 10.0])
    lam = x[0]
    k = np.searchsorted(flux, lam)
    k = min(max(k, 1), len(flux) - 1)
    i = im[k - 1] + (im[k] - im[k - 1]) / (flux[k] - flux[k - 1]) * (lam - flux[k - 1])
    return [u[0] - 0.5 * i, u[1] - x[1], i - x[2]]


iu = np.triu_indices(3)


@engineered(9, 1)
def ekf_upper_triangle(t, x, u, params):
    xh = x[:3]
    Pm = np.zeros((3, 3))
    Pm[iu] = x[3:]
    Pm = Pm + Pm.T - np.diag(Pm.diagonal())
    F = np.array([[0, 1, 0], [-np.cos(xh[0]), -0.1, 1], [0, 0, -0.5]])
    H = np.array([[np.cos(xh[0]), 0, 0]])
    S = H @ Pm @ H.T + 0.1
    K = Pm @ H.T / S
    dxh = np.array([xh[1], -np.sin(xh[0]) - 0.1 * xh[1] + xh[2], -0.5 * xh[2]]) + K[:, 0] * (
        u[0] - np.sin(xh[0])
    )
    dP = F @ Pm + Pm @ F.T + 0.01 * np.eye(3) - K @ H @ Pm
    return np.r_[dxh, dP[iu]]


@engineered(5, 1)
def unscented_mean(t, x, u, params):
    m, L = x[:2], np.array([[x[2], 0], [x[3], x[4]]])
    Pm = L @ L.T + 0.1 * np.eye(2)
    sq = np.linalg.cholesky(Pm)
    pts = [m] + [m + s * np.sqrt(3) * sq[:, i] for i in range(2) for s in (1, -1)]
    w = np.array([1 / 3] + [1 / 6] * 4)
    f = lambda z: np.array([z[1], -np.sin(z[0])])  # noqa: E731
    prop = np.array([f(p) for p in pts])
    mean = w @ prop
    cov = (prop - mean).T @ np.diag(w) @ (prop - mean)
    return np.r_[mean, cov[0, 0] - x[2], cov[1, 0] - x[3], cov[1, 1] - x[4] + 0 * u[0]]


plant_ss = ct.ss([[0, 1], [-1, -0.4]], [[0], [1]], [[1, 0]], 0)


lead = ct.tf([1, 2], [0.1, 1])


lead_ss = ct.ss(lead)


@engineered(3, 1)
def control_objects_in_update(t, x, u, params):
    e = u[0] - (plant_ss.C @ x[:2])[0]
    v = (lead_ss.C @ x[2:] + lead_ss.D @ [e])[0]
    return np.concatenate(
        [plant_ss.A @ x[:2] + plant_ss.B[:, 0] * v, lead_ss.A @ x[2:] + lead_ss.B[:, 0] * e]
    )


REGIONS = [
    (np.array([[1.0, 0.5], [-1.0, -0.5]]), np.array([1.0, 1.0]), np.array([-0.8, -1.2]), 0.0),
    (np.array([[-1.0, -0.5]]), np.array([-1.0]), np.array([0.0, -0.2]), -1.0),
    (np.array([[1.0, 0.5]]), np.array([-1.0]), np.array([0.0, -0.2]), 1.0),
]


@engineered(2, 1)
def explicit_mpc(t, x, u, params):
    for H, h, F, g in REGIONS:
        if np.all(H @ x <= h + 1e-9):
            v = F @ x + g
            break
    else:
        raise RuntimeError(f"no region contains {x}")
    return np.array([x[1], v + u[0]])


@engineered(2, 1)
def explicit_mpc_next(t, x, u, params):
    F, g = next((F, g) for H, h, F, g in REGIONS if (H @ x <= h + 1e-9).all())
    return np.array([x[1], F.dot(x) + g + u[0]])


@engineered(5, 1)
def mrac(t, x, u, params):
    xp, xm, th = x[0], x[1], x[2:]
    phi = np.array([xp, u[0], np.tanh(xp)])
    v = th @ phi
    e = xp - xm
    dth = -params.get("gamma", 2.0) * phi * e
    thn = np.linalg.norm(th)
    if thn > 5.0 and th @ dth > 0:
        dth = dth - th * (th @ dth) / thn**2
    return [xp + v, -2 * xm + 2 * u[0], *dth]


@engineered(4, 2)
def fuzzy_controller(t, x, u, params):
    def tri(z, a, b, c):
        return max(min((z - a) / (b - a), (c - z) / (c - b)), 0.0)

    e, de = np.clip(x[0] - u[0], -1, 1), np.clip(x[1], -1, 1)
    sets = {"N": (-2, -1, 0), "Z": (-1, 0, 1), "P": (0, 1, 2)}
    rules = {
        ("N", "N"): 1,
        ("N", "Z"): 0.5,
        ("Z", "Z"): 0,
        ("P", "Z"): -0.5,
        ("P", "P"): -1,
        ("N", "P"): 0,
        ("P", "N"): 0,
        ("Z", "N"): 0.5,
        ("Z", "P"): -0.5,
    }
    num = den = 0.0
    for (a, b), out in rules.items():
        w = min(tri(e, *sets[a]), tri(de, *sets[b]))
        num, den = num + w * out, den + w
    v = num / den if den > 1e-9 else 0.0
    return [x[1], v * 5 - x[1], -x[2] + u[1], x[2] - x[3]]


def relu(z):
    return np.maximum(z, 0.0)


class Dense:
    ACTS = {
        "tanh": np.tanh,
        "relu": relu,
        "sigmoid": lambda z: 1 / (1 + np.exp(-z)),
        "gelu": lambda z: 0.5 * z * (1 + np.tanh(np.sqrt(2 / np.pi) * (z + 0.044715 * z**3))),
    }

    def __init__(self, n_in, n_out, act="tanh", seed=0):
        r = np.random.default_rng(seed)
        self.W, self.b, self.act = (
            r.normal(size=(n_in, n_out)) / np.sqrt(n_in),
            np.zeros(n_out),
            self.ACTS[act],
        )

    def forward(self, z):
        return self.act(z @ self.W + self.b)


class Sequential:
    def __init__(self, *layers):
        self.layers = list(layers)

    def __call__(self, z):
        return reduce(lambda acc, layer: layer.forward(acc), self.layers, z)


policy = Sequential(Dense(3, 16, "gelu", 1), Dense(16, 16, "sigmoid", 2), Dense(16, 1, "tanh", 3))


@engineered(3, 1)
def neural_policy(t, x, u, params):
    a = policy(x[None, :]).squeeze()
    return np.array([x[1], x[2], -x[0] - x[1] - x[2] + 2 * a + u[0]])


@engineered(6, 1)
def gru_cell(t, x, u, params):
    h = x
    r = np.random.RandomState(1)
    Wz, Wr, Wh = (0.3 * r.randn(6, 7) for _ in range(3))
    zx = np.concatenate((h, u))
    sigm = lambda a: 1.0 / (1.0 + np.exp(-a))  # noqa: E731
    z, rr = sigm(Wz @ zx), sigm(Wr @ zx)
    return (1 - z) * (np.tanh(Wh @ np.concatenate((rr * h, u))) - h)


@singledispatch
def to_force(v):
    raise TypeError(type(v))


@to_force.register(numbers.Real)
def _(v):
    return 2.0 * v


@to_force.register(np.ndarray)
def _(v):
    return 2.0 * v


@engineered(3, 1)
def compiled_by_decorator(t, x, u, params):
    def limited(lo, hi):
        def deco(f):
            @wraps(f)
            def g(*a, **k):
                return min(max(f(*a, **k), lo), hi)

            return g

        return deco

    @limited(-1, 1)
    def law(e, *, k=2.0):
        return k * e

    return [x[1], x[2], law(u[0] - x[0], k=3.0) - x[1] - x[2]]


@engineered(2, 1)
def local_dataclass(t, x, u, params):
    @dataclass
    class State:
        pos: float
        vel: float

        @property
        def energy(self):
            return 0.5 * self.vel**2 + 0.5 * self.pos**2

    s = State(*x)
    return [s.vel, -s.pos - 0.1 * s.energy * s.vel + u[0]]


@engineered(2, 1)
def frompyfunc_friction(t, x, u, params):
    f = np.frompyfunc(lambda v: 0.5 if v > 0 else (-0.5 if v < 0 else 0.0), 1, 1)
    return [x[1], u[0] - float(f(x[1])) - x[0]]


def stribeck(v):
    if v == 0:
        return 0.0
    return np.sign(v) * (0.5 + 0.3 * np.exp(-abs(v) / 0.1))


stribeck_v = np.vectorize(stribeck, otypes=[float])


@engineered(4, 2)
def vectorized_friction(t, x, u, params):
    v = x[2:]
    return np.concatenate([v, -stribeck_v(v) - x[:2] + u])


@engineered(8, 1)
def spectral_derivative(t, x, u, params):
    k = np.fft.fftfreq(8, d=2 * np.pi / 8 / (2 * np.pi))
    ux = np.real(np.fft.ifft(1j * k * np.fft.fft(x)))
    uxx = np.fft.irfft(-(np.arange(5) ** 2) * np.fft.rfft(x), n=8)
    return -x * ux + 0.1 * uxx + u[0]


@engineered(2, 1)
def cholesky_allocation(t, x, u, params):
    M = np.array([[2 + np.cos(x[0]), 0.3], [0.3, 1.0]])
    c = cho_factor(M)
    return cho_solve(c, np.array([u[0], -x[1]])) - x


@engineered(4, 1)
def batched_solve(t, x, u, params):
    q = x.reshape(2, 2)
    M = np.stack([np.array([[2 + np.cos(qi[0]), 0.1], [0.1, 1.0]]) for qi in q])
    b = np.stack([np.array([qi[1], u[0]]) for qi in q])
    return np.linalg.solve(M, b[..., None])[..., 0].ravel()


@engineered(2, 1)
def random_frozen_noise(t, x, u, params):
    phases = np.random.default_rng(7).uniform(0, 2 * np.pi, 5)
    w = np.geomspace(0.1, 10, 5)
    wave = np.sum(np.cos(w * t + phases))
    return [x[1], -x[0] - 0.2 * x[1] + 0.1 * wave + u[0]]


@engineered(12, 1)
def appended_by_branches(t, x, u, params):
    out = []
    for v in x:
        if v > 1:
            out.append(1.0)
        elif v < -1:
            out.append(-1.0 - 0.1 * v)
        else:
            out.append(v)
    return u[0] - np.array(out)


@engineered(6, 1)
def modes_of_a_constant_matrix(t, x, u, params):
    stiffness = 2.0 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)
    mass = np.diag(np.linspace(1.0, 2.0, 6))
    slowest = np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real.min()
    return -np.linalg.solve(mass, stiffness @ x) * slowest + np.linalg.det(mass) * u[0]
