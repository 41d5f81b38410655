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
