"""What several test modules share: hypothesis settings, gains to make diagrams of, margins."""

import os
import signal

import control as ct
import pandas as pd
import pytest
from hypothesis import settings

import nlctl

# The same examples in every run, and no clocks.
settings.register_profile("nlctl", deadline=None, derandomize=True, database=None, max_examples=50)
settings.load_profile("nlctl")


def pytest_configure(config):
    """Keep machine code in one folder for all workers, the processes they start and later runs.

    `pytest --cache-clear` empties it.
    """
    if "NLCTL_CACHE_DIR" not in os.environ and getattr(config, "cache", None) is not None:
        os.environ["NLCTL_CACHE_DIR"] = str(config.cache.mkdir("machine-code"))


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items):
    """Count as slow what needs a browser, a cluster or other people's tests, unless it is weekly.

    So is the machine code, ``native=True``, of what the same test compares as plain Python.
    """
    for item in items:
        values = item.callspec.params if hasattr(item, "callspec") else {}
        marked = any(item.get_closest_marker(name) for name in ("browser", "cluster", "upstream"))
        weekly = item.get_closest_marker("weekly")
        if not weekly and (marked or values.get("native") is True):
            item.add_marker("slow")


def many(examples):
    """Number of examples of a test of random programs: a fifth, but all of them once a week."""
    return examples if os.environ.get("ALL_EXAMPLES") else examples // 5


@pytest.fixture
def ctrl_c():
    """Listen to Ctrl-C, here and in the processes that a test starts.

    Shells let what they start in the background ignore SIGINT, and children inherit that.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@nlctl.record
class Affine:
    """y = k u + c."""

    k: float = nlctl.param(1.0, unit="1", meaning="gain", below=1e3)
    c: float = nlctl.param(0.0, unit="1", meaning="offset")
    takes: str = "u"
    delivers: str = "y"

    states = ()
    feedthrough = True

    @property
    def inputs(self):
        return (self.takes,)

    @property
    def outputs(self):
        return (self.delivers,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (p.k * u[0] + p.c,)


def gain(name, k=1.0, takes="u", delivers="y", **kwargs):
    return nlctl.block(Affine(k=k, takes=takes, delivers=delivers, **kwargs), name)


def foreign(name, key="q", default=2.0, takes="u", delivers="y", declared=True):
    """Return somebody else's gain, with a dict of parameters."""
    return ct.nlsys(
        None,
        lambda t, x, u, params: [params.get(key, default) * u[0]],
        inputs=[takes],
        outputs=[delivers],
        name=name,
        params={key: default} if declared else None,
    )


def out(system, params=None, u=1.0):
    """Return the one output of a static system with one input."""
    return float(system.output(0.0, [], [u], params=params)[0])


def chain(join=ct.interconnect, *, k=(2.0, 3.0), takes="u", middle="m", delivers="y", **kwargs):
    """Join two gains called first and second in series."""
    parts = [gain("first", k[0], takes, middle), gain("second", k[1], middle, delivers)]
    return join(parts, inputs=[takes], outputs=[delivers], **kwargs)


def function(formula):
    """What simulates nothing: the margin is a formula of the row."""
    return lambda table: pd.DataFrame({"spec": formula(table)}, index=table.index)
