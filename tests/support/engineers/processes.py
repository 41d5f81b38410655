"""Reactors, tanks, batteries, cells and buildings: correlations, tables, guards."""

import itertools
import math
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import (
    CubicSpline,
    PchipInterpolator,
)

from engineers.entry import engineered

ANTOINE = {"water": (8.07131, 1730.63, 233.426), "ethanol": (8.20417, 1642.89, 230.3)}


def psat(name, T_celsius):
    A, B, C = ANTOINE[name]
    return 10 ** (A - B / (C + T_celsius)) * 133.322


@engineered(2, 2)
def flash_drum(t, x, u, params):
    z, T = x
    K = {name: psat(name, T) / 101325 for name in ANTOINE}
    xs = np.clip(z, 0.0, 1.0)
    y = K["ethanol"] * xs / (K["ethanol"] * xs + K["water"] * (1 - xs))
    q = u[0] * 4.18 * (80 - T)
    return [u[1] * (0.5 - z) - 0.1 * (y - xs), q / 100.0]


def shomate(T, coeffs=(30.092, 6.832514, 6.793435, -2.53448, 0.082139)):
    tau = T / 1000
    A, B, C, D, E = coeffs
    return A + B * tau + C * tau**2 + D * tau**3 + E / tau**2


@engineered(2, 1)
def heat_exchanger_lmtd(t, x, u, params):
    Th, Tc = x
    d1, d2 = 700.0 - Tc, Th - 290.0
    if abs(d1 - d2) < 1e-6:
        lmtd = 0.5 * (d1 + d2)
    else:
        try:
            lmtd = (d1 - d2) / math.log(d1 / d2)
        except ValueError:
            lmtd = 0.0
    q = 50.0 * lmtd
    return [
        (700 - Th) * (1 + u[0]) - q / shomate(max(Th, 300.0)),
        (290 - Tc) + q / shomate(max(Tc, 300.0)),
    ]


@engineered(2, 1)
def zero_division_guard(t, x, u, params):
    try:
        ratio = math.sqrt(x[0]) / x[1]
    except ZeroDivisionError:
        ratio = 0.0
    except ValueError:
        ratio = -1.0
    return [ratio - x[0] * 0.01, u[0] - 0.1 * x[1]]


@engineered(3, 1)
def coupled_tanks_torricelli(t, x, u, params):
    """Flow with sign, as in the book; generator expressions and pairwise."""
    q_in = max(0.0, u[0])
    flows = [q_in]
    for a, b in itertools.pairwise([*x, 0.0]):
        dh = a - b
        flows.append(0.3 * math.copysign(math.sqrt(2 * 9.81 * abs(dh)), dh))
    return [fin - fout for fin, fout in itertools.pairwise(flows)]


SOC_GRID = np.linspace(0, 1, 11)


OCV = np.array([3.0, 3.35, 3.48, 3.55, 3.6, 3.65, 3.72, 3.8, 3.9, 4.02, 4.18])


ocv_spline = CubicSpline(SOC_GRID, OCV, bc_type="natural")


docv = ocv_spline.derivative()


r0_pchip = PchipInterpolator([0, 0.1, 0.5, 0.9, 1.0], [0.06, 0.035, 0.02, 0.022, 0.03])


@dataclass(frozen=True)
class Cell:
    capacity: float = 2.5
    R1: float = 0.015
    C1: float = 2500.0
    ocv: Callable = ocv_spline
    r0: Callable = r0_pchip

    def voltage(self, soc, v1, i):
        return self.ocv(soc) - v1 - self.r0(soc) * i


CELL = Cell()


@engineered(3, 1)
def battery_ecm_thermal(t, x, u, params):
    soc, v1, T = x
    cell = params.get("cell", CELL)
    i = u[0]
    s = np.clip(soc, 0, 1)
    heat = i**2 * cell.r0(s) + v1**2 / cell.R1 - i * T * 1e-4 * docv(s)
    return np.array(
        [
            -i / (3600 * cell.capacity),
            -v1 / (cell.R1 * cell.C1) + i / cell.C1,
            (heat - 0.5 * (T - 298.15)) / 45.0,
        ]
    )


def newton(f, df, x0, tol=1e-10, maxiter=50):
    x = x0
    for _ in range(maxiter):
        step = f(x) / df(x)
        x = x - step
        if abs(step) < tol:
            return x
    raise RuntimeError("no convergence")


@engineered(2, 1)
def kepler_by_newton_until_tolerance(t, x, u, params):
    M, e = x[0], 0.3
    E = newton(lambda E: E - e * math.sin(E) - M, lambda E: 1 - e * math.cos(E), M)
    return [1.0 + 0 * E, math.cos(E) - x[1] + u[0]]


@engineered(4, 1)
def hodgkin_huxley(t, x, u, params):
    V, m, h, n = x

    def vtrap(z, y):
        if abs(z / y) < 1e-6:
            return y * (1 - z / y / 2)
        return z / (math.exp(z / y) - 1)

    am, bm = 0.1 * vtrap(-(V + 40), 10), 4 * math.exp(-(V + 65) / 18)
    ah, bh = 0.07 * math.exp(-(V + 65) / 20), 1 / (math.exp(-(V + 35) / 10) + 1)
    an, bn = 0.01 * vtrap(-(V + 55), 10), 0.125 * math.exp(-(V + 65) / 80)
    I = 120 * m**3 * h * (V - 50) + 36 * n**4 * (V + 77) + 0.3 * (V + 54.4)
    return [u[0] - I, am * (1 - m) - bm * m, ah * (1 - h) - bh * h, an * (1 - n) - bn * n]


def monod(s, mu_max=0.5, ks=0.1):
    return mu_max * s / (ks + s)


def haldane(s, mu_max=0.5, ks=0.1, ki=2.0):
    return mu_max * s / (ks + s + s**2 / ki)


KINETICS = {"monod": monod, "haldane": haldane}


@engineered(3, 1, kinetics="haldane", Y=0.5)
def bioreactor_named_kinetics(t, x, u, params):
    s, b, v = x
    kin = KINETICS.get(params["kinetics"])
    if kin is None:
        raise KeyError(f"kinetics {params['kinetics']} not in {sorted(KINETICS)}")
    mu = kin(s)
    F = max(u[0], 0)
    return [-mu * b / params["Y"] + F / v * (5 - s), mu * b - F / v * b, F]


class Zone(NamedTuple):
    C: float
    UA: float
    area: float


ZONES = (Zone(2e3, 0.2, 20), Zone(1.5e3, 0.15, 15), Zone(3e3, 0.3, 30))


ADJ = {(0, 1): 0.1, (1, 2): 0.05}


@engineered(3, 4)
def building_zones(t, x, u, params):
    T_out, *q = u
    T_out = 5 + T_out
    flow = defaultdict(float)
    for (i, j), ua in ADJ.items():
        flow[i] += ua * (x[j] - x[i])
        flow[j] += ua * (x[i] - x[j])
    return [
        (z.UA * (T_out - x[k]) + flow[k] + q[k] + 0.02 * z.area) / z.C for k, z in enumerate(ZONES)
    ]
