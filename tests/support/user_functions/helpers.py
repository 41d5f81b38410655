"""What users keep in a module of their own."""

import functools

import numpy as np

LIMIT = 0.8
TABLE = {"steel": 7.8, "copper": 8.9}


def saturate(value, limit=LIMIT):
    return max(-limit, min(limit, value))


def drift(t, x, u, params):
    """A whole update function of another module."""
    return -TABLE[params["metal"]] * x + saturate(u[0])


def squared(function):
    @functools.wraps(function)
    def wrapper(*args, **kwargs):
        return np.asarray(function(*args, **kwargs)) ** 2

    return wrapper


class Base:
    gain = 2.0

    def __init__(self, n):
        self.n = n

    def rate(self, x):
        return -self.gain * x

    def update(self, t, x, u, params):
        return self.rate(x) + u[0]
