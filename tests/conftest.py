"""What tests have in common: hypothesis settings, one cache of machine code, marks, Ctrl-C."""

import collections
import gc
import os
import signal
import sys
import tempfile

import pytest
from examples import many
from hypothesis import settings

# The same examples in every run, and no clocks; more of them once a week.
settings.register_profile(
    "nlctl", deadline=None, derandomize=True, database=None, max_examples=many(50)
)
settings.load_profile("nlctl")

NEEDY = ("weekly", "browser", "cluster", "docs", "export", "upstream")  # marks of what counts as ci


def pytest_configure(config):
    """Keep machine code in one folder for all workers, the processes they start and later runs.

    `pytest --cache-clear` empties it.
    """
    if "NLCTL_CACHE_DIR" not in os.environ and getattr(config, "cache", None) is not None:
        os.environ["NLCTL_CACHE_DIR"] = str(config.cache.mkdir("machine-code"))
    if "NLCTL_CONFIG_DIR" not in os.environ:  # what this user trusts is no test's business
        folder = tempfile.TemporaryDirectory()
        config.add_cleanup(folder.cleanup)
        os.environ["NLCTL_CONFIG_DIR"] = folder.name


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Spare the garbage collector what imports leave: it is there until the end.

    Looking through it again and again takes as long as the imports do.  Behind them no bytecode is
    written: tests edit files within a second, which bytecode does not notice.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()
        os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
        sys.dont_write_bytecode = True


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items):
    """Count as ci what is weekly, needs what only an extra brings, or other people's tests.

    So is the machine code, ``native=True``, of what the same test compares as plain Python.
    What is ci is slow.
    """
    part_rows(items)
    for item in items:
        values = item.callspec.params if hasattr(item, "callspec") else {}
        marked = any(item.get_closest_marker(name) for name in NEEDY)
        if marked or values.get("native") is True:
            item.add_marker("ci")
        if item.get_closest_marker("ci"):
            item.add_marker("slow")


def part_rows(items):
    """Count as weekly all but every third row of a test with the mark ``parted``, or ``part=n``-th.

    Of combinations, those of each day have every value of each table.
    """
    tests = collections.defaultdict(list)
    for item in items:
        if item.get_closest_marker("parted"):
            tests[item.nodeid.partition("[")[0]].append(item)
    for rows in tests.values():
        places = [places_in(table, rows) for table in tables_of(rows[0])]
        lengths = sorted(len(set(column)) for column in places)
        asked = rows[0].get_closest_marker("parted").kwargs.get("part", 3)
        part = min(asked, lengths[-2] if len(lengths) > 1 else lengths[-1])
        for item, *place in zip(rows, *places, strict=True):
            if sum(place) % part:
                item.add_marker("weekly")


def tables_of(item):
    """Names of the values of each table of a test; parameters of fixtures are tables of one."""
    names = [mark.args[0] for mark in item.iter_markers("parametrize")]
    tables = [n.replace(" ", "").split(",") if isinstance(n, str) else [*n] for n in names]
    listed = {name for table in tables for name in table}
    return tables + [[name] for name in item.callspec.params if name not in listed]


def places_in(table, rows):
    """Which row of a table each row of a test has."""
    places = {}
    keys = [tuple(id(item.callspec.params[name]) for name in table) for item in rows]
    return [places.setdefault(key, len(places)) for key in keys]


@pytest.fixture
def ctrl_c():
    """Listen to Ctrl-C, here and in the processes that a test starts.

    Shells let what they start in the background ignore SIGINT, and children inherit that.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
