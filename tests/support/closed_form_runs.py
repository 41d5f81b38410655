"""Small systems whose runs have derivatives in closed form."""

import control as ct
import numpy as np

import nlctl


def block(update, params, states=("x",), name="plant", output=None):
    """A block with these states as its outputs, and parameters."""
    return ct.nlsys(
        update, output or (lambda t, x, u, p: x), inputs=0, outputs=list(states),
        states=list(states), params=params, name=name,
    )  # fmt: skip


def end(response, signal, quantity):
    """The derivative at the last time."""
    return float(response[signal, quantity][-1])


def jumping_rate():
    """x' = 1 + (x > p): behind t = p it is x = 2 t - p."""
    return block(lambda t, x, u, p: [1 + np.where(x[0] > p["p"], 1.0, 0.0)], {"p": 0.5})


@nlctl.record
class Ball:
    """A ball that bounces, with height h and velocity v."""

    g: float = nlctl.param(9.81, unit="m/s^2", meaning="gravity", above=0)
    e: float = nlctl.param(0.8, unit="1", meaning="restitution", above=0)

    inputs, outputs, states, feedthrough = (), ("h", "v"), ("h", "v"), False
    initial = {"h": 1.0, "v": 0.0}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return x[1], -p.g

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return x[0], x[1]

    @staticmethod
    @nlctl.equation
    def guard(t, x, u, p):
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def reset(t, x, u, p):
        return 0.0, -p.e * x[1]


def ball_after(t, h0, e, g, bounces):
    """Height after so many bounces in closed form."""
    first = np.sqrt(2 * h0 / g)
    speed, since = np.sqrt(2 * g * h0), first
    for k in range(bounces):
        speed = speed * e
        if k < bounces - 1:
            since = since + 2 * speed / g
    return speed * (t - since) - g * (t - since) ** 2 / 2


A, P, R = 1.0, 0.7, 1.3  # height and place of a corner, and a rate


def source(output, params, rate=None):
    """Signals of t and of x = rate t."""
    return ct.nlsys(
        lambda t, x, u, p: [p[rate] if rate else 1.0], output, inputs=0, outputs=["u"],
        states=["x"], params=params, name="source",
    )  # fmt: skip


def integral(inp="v"):
    return ct.nlsys(
        lambda t, x, u, p: [u[0]], lambda t, x, u, p: [x[0]], inputs=[inp], outputs=["y"],
        states=["y"], name="integral",
    )  # fmt: skip


CORNERS = {
    "abs of t": lambda t, x, u, p: [p["A"] - np.abs(t - p["P"])],
    "abs": lambda t, x, u, p: [p["A"] - np.abs(x[0] - p["P"])],
    "min": lambda t, x, u, p: [np.minimum(x[0] - p["P"], p["P"] - x[0]) + p["A"]],
    "max": lambda t, x, u, p: [p["A"] - np.maximum(x[0] - p["P"], p["P"] - x[0])],
    "where": lambda t, x, u, p: [
        np.where(x[0] > p["P"], p["P"] - x[0], x[0] - p["P"]) + p["A"]
    ],
    "sign": lambda t, x, u, p: [p["A"] - np.sign(x[0] - p["P"]) * (x[0] - p["P"])],
    "root": lambda t, x, u, p: [p["A"] - np.sqrt((x[0] - p["P"]) ** 2)],
    "remainder": lambda t, x, u, p: [p["A"] - np.abs(np.mod(x[0] - p["P"] + 2, 4) - 2)],
}  # fmt: skip


@nlctl.record
class Tank:
    """Fills at a rate, and is emptied to a where it reaches a level."""

    a: float = nlctl.param(0.05, unit="1", meaning="level behind")
    q: float = nlctl.param(1.0, unit="1/s", meaning="rate")

    inputs, outputs, states, feedthrough = ("level",), ("h",), ("h",), False

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (p.q,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def guard(t, x, u, p):
        return (u[0] - x[0],)

    @staticmethod
    @nlctl.equation
    def reset(t, x, u, p):
        return (p.a,)
