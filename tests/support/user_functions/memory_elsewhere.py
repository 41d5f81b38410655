"""Memory that is no state, elsewhere: defaults, generators, queues, caches, parameters."""

import collections
import functools
import itertools
import json

import numpy as np

from ._entry import entry, pieces


@entry(pure=False)
def mutable_default_argument(n):
    def update(t, x, u, params, seen=[]):
        seen.append(1)
        return -x * len(seen)

    return pieces(update, states=n)


@entry(pure=False)
def default_array_argument(n):
    def update(t, x, u, params, last=np.zeros(n)):
        d = x - last
        last[...] = x
        return d

    return pieces(update, states=n)


@entry(pure=False)
def generator_of_a_closure(n):
    numbers = itertools.count(1)

    def update(t, x, u, params):
        return -x * next(numbers)

    return pieces(update, states=n)


@entry(pure=False)
def generator_with_send(n):
    def filtered():
        y = 0.0
        while True:
            v = yield y
            y = 0.8 * y + 0.2 * v

    running = filtered()
    next(running)

    def update(t, x, u, params):
        return -x + running.send(u[0])

    return pieces(update, states=n)


@entry(pure=False)
def iterator_used_up(n):
    values = iter([1.0, 2.0, 3.0] * 1000)

    def update(t, x, u, params):
        for v in values:
            break
        return -x * v

    return pieces(update, states=n)


@entry(pure=False)
def delay_line_in_a_deque(n):
    line = collections.deque([0.0] * 3, maxlen=3)

    def output(t, x, u, params):
        oldest = line[0]
        line.append(u[0])
        return oldest

    return pieces(None, output)


@entry(pure=False)
def first_call_initialises(n):
    state = {}

    def update(t, x, u, params):
        if "x0" not in state:
            state["x0"] = np.array(x)
        return state["x0"] - x

    return pieces(update, states=n)


@entry(pure=False)
def setdefault_remembers(n):
    cache = {}

    def update(t, x, u, params):
        return -x + cache.setdefault("first", float(u[0]))

    return pieces(update, states=n)


@entry(pure=False)
def lru_cache_without_its_argument(n):
    """The first state ever seen is kept for all later ones."""
    current = {}

    @functools.lru_cache
    def first():
        return float(current["x"])

    def update(t, x, u, params):
        current["x"] = x[0]
        return -x + first()

    return pieces(update, states=n)


@entry(pure=False)
def lazily_made_attribute(n):
    class Plant:
        x0 = None

        def update(self, t, x, u, params):
            if self.x0 is None:
                self.x0 = x.copy()
            return self.x0 - x

    return pieces(Plant().update, states=n)


@entry(pure=False)
def parameters_are_written(n):
    """python-control keeps what a function writes until the parameters are set again."""
    kept = {"k": 1.0}

    def update(t, x, u, params):
        kept.update(k=kept["k"] * 1.01)
        params["k"] = params["k"] + kept["k"]
        return -params["k"] * x

    return pieces(update, states=n, k=1.0)


@entry(pure=False)
def memory_in_a_parameter(n):
    """A list that travels as a parameter is the same one in every call."""

    def update(t, x, u, params):
        params["log"].append(1.0)
        return -x * len(params["log"])

    return pieces(update, states=n, log=[])


@entry(pure=False)
def walrus_on_an_outer_attribute(n):
    class Memory:
        pass

    memory = Memory()
    memory.last, memory.__dict__["count"] = 0.0, 0

    def update(t, x, u, params):
        d, memory.last = u[0] - memory.last, u[0]
        memory.__dict__["count"] += 1
        return -x * d + memory.count

    return pieces(update, states=n)


@entry(pure=False)
def loop_target_is_an_attribute(n):
    class Memory:
        last = 0.0

    def update(t, x, u, params):
        before = Memory.last
        for Memory.last in x:
            pass
        return -x + before

    return pieces(update, states=n)


@entry(pure=False)
def stateful_object_called(n):
    class Derivative:
        def __init__(self):
            self.last = 0.0

        def __call__(self, v):
            d, self.last = v - self.last, v
            return d

    derivative = Derivative()

    def update(t, x, u, params):
        return -x + derivative(u[0])

    return pieces(update, states=n)


@entry(pure=False)
def object_with_a_stateful_index(n):
    class Counter:
        count = 0

        def __getitem__(self, i):
            self.count += 1
            return self.count * i

        def __add__(self, other):
            self.count += 1
            return self.count + other

    counter = Counter()

    def update(t, x, u, params):
        return -x + counter[1] + (counter + u[0])

    return pieces(update, states=n)


@entry(pure=False)
def decorated_with_a_counter(n):
    def counted(function):
        calls = 0

        @functools.wraps(function)
        def wrapper(*args):
            nonlocal calls
            calls += 1
            return function(*args) * calls

        return wrapper

    @counted
    def update(t, x, u, params):
        return -x

    return pieces(update, states=n)


@entry(pure=False)
def popped_from_a_queue(n):
    queue = [0.1 * i for i in range(3000)]

    def update(t, x, u, params):
        return -x + queue.pop()

    return pieces(update, states=n)


@entry(pure=False)
def memory_changes_only_on_a_branch(n):
    """At zero nothing is written: one call tells nothing."""
    latch = {"on": False}

    def update(t, x, u, params):
        if u[0] > 0.9:
            latch["on"] = True
        return -x * 2 if latch["on"] else -x

    return pieces(update, states=n)


@entry(pure=False)
def rate_limiter_on_time(n):
    last = [0.0, 0.0]

    def output(t, x, u, params):
        dt, last[0] = t - last[0], t
        last[1] += max(-1.0 * dt, min(1.0 * dt, u[0] - last[1]))
        return last[1]

    return pieces(None, output)


@entry(pure=False)
def in_place_method_of_a_constant(n):
    gains = [3.0, 1.0, 2.0]

    def update(t, x, u, params):
        first = gains[0]
        gains.sort()
        return -first * x

    return pieces(update, states=n)


@entry(pure=False)
def ufunc_writes_into_a_kept_array(n):
    total = np.zeros(n)

    def update(t, x, u, params):
        np.add(total, x, out=total)
        return -total

    return pieces(update, states=n)


@entry(pure=False)
def text_buffer(n):
    texts = {"state": "0.0"}

    def update(t, x, u, params):
        old = json.loads(texts["state"])
        texts["state"] = json.dumps(float(u[0]))
        return -x + old

    return pieces(update, states=n)
