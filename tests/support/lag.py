"""The cheap loop of the tests, with a solution in closed form: x' = -rate x + gain x^3, from x(0).

Studies of tests have this file as the file of their loop: it needs nothing but nlctl.
"""

import nlctl


@nlctl.record
class Lag:
    """x' = -rate x + gain x^3; y = scale x, z = 2 x."""

    rate: float = nlctl.param(1.0, unit="1/s", meaning="decay", above=0)
    gain: float = nlctl.param(0.0, unit="1/s", meaning="growth", above=-0.5)
    scale: float = nlctl.param(1.0, unit="1", meaning="output")
    inputs, outputs, states, initial = (), ("y", "z"), ("x",), {"x": 1.0}
    feedthrough = False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (-p.rate * x[0] + p.gain * x[0] ** 3,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return p.scale * x[0], 2 * x[0]


def loop(lag=None, name="loop"):
    return nlctl.interconnect({"lag": lag or Lag()}, outputs=["y", "z"], name=name)


def scaled(scale=1.0):
    return loop(Lag(rate=2.0, gain=0.1, scale=scale))


def lags():
    return {"calm": Lag(gain=0.0), "lively": Lag(gain=0.2), "wild": Lag(gain=0.4)}


def broken(fails=True):
    if not fails:
        return loop()
    raise RuntimeError("no such luck")
