"""Functions that draw numbers, or read clocks, files and the environment."""

import os
import random
import secrets
import time
import uuid
from datetime import datetime

import numpy as np

from ._entry import entry, pieces


@entry(pure=False)
def generator_of_numpy(n):
    rng = np.random.default_rng(3)

    def update(t, x, u, params):
        return -x + rng.normal()

    return pieces(update, states=n)


@entry(pure=False)
def numbers_of_numpy(n):
    np.random.seed(3)

    def update(t, x, u, params):
        return -x + 0.1 * np.random.randn(n)

    return pieces(update, states=n)


@entry(pure=False)
def numbers_of_python(n):
    random.seed(3)

    def update(t, x, u, params):
        return -x + random.gauss(0, 1)

    return pieces(update, states=n)


@entry(pure=False)
def generator_in_an_attribute(n):
    class Sensor:
        def __init__(self):
            self.rng = random.Random(7)

        def output(self, t, x, u, params):
            return u[0] + self.rng.uniform(-1, 1)

    return pieces(None, Sensor().output)


@entry(pure=False)
def bound_method_of_a_generator(n):
    draw = np.random.default_rng(5).random

    def output(t, x, u, params):
        return u[0] * draw()

    return pieces(None, output)


@entry(pure=False)
def shuffled(n):
    rng = np.random.default_rng(2)

    def update(t, x, u, params):
        return -rng.permutation(x)

    return pieces(update, states=n)


@entry(pure=False)
def noise_on_a_branch(n):
    rng = np.random.default_rng(8)

    def update(t, x, u, params):
        return -x + (rng.normal() if u[0] > 0.5 else 0.0)

    return pieces(update, states=n)


@entry(pure=False)
def choice_of_a_list(n):
    random.seed(11)

    def update(t, x, u, params):
        return -x * random.choice([1.0, 2.0, 3.0])

    return pieces(update, states=n)


@entry(pure=False, repeatable=False)
def clock(n):
    def update(t, x, u, params):
        return -x + time.time()

    return pieces(update, states=n)


@entry(pure=False, repeatable=False)
def fine_clock(n):
    start = time.perf_counter()

    def update(t, x, u, params):
        return -x * (time.perf_counter() - start)

    return pieces(update, states=n)


@entry(pure=False, repeatable=False)
def date(n):
    def output(t, x, u, params):
        return u[0] + datetime.now().microsecond

    return pieces(None, output)


@entry(pure=False, repeatable=False)
def operating_system_numbers(n):
    def output(t, x, u, params):
        return u[0] + secrets.randbelow(1000) + os.urandom(1)[0] + uuid.uuid4().int % 7

    return pieces(None, output)


@entry(pure=False, repeatable=False)
def identity_number(n):
    """id() of a new object differs from call to call."""

    def output(t, x, u, params):
        return u[0] + id(object()) % 1009 + hash(object()) % 13

    return pieces(None, output)


@entry(pure=False)
def environment(n):
    def update(t, x, u, params):
        return -x * float(os.environ.get("CORPUS_GAIN", "2.0"))

    return pieces(update, states=n)


@entry(pure=False)
def file_is_read(n):
    def update(t, x, u, params):
        with open(os.devnull) as file:
            return -x + len(file.read())

    return pieces(update, states=n)


@entry(pure=False)
def text_is_evaluated(n):
    names = {"k": 0.0}

    def update(t, x, u, params):
        exec("k = k + 1", names)
        return -x * names["k"]

    return pieces(update, states=n)
