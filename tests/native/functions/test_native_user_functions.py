"""The corpus of users' functions: each agrees with python-control, or is refused with a reason."""

import pytest
import user_functions
from examples import some
from numba.core import config
from user_function_checks import GOOD, judged
from user_function_native import accepted, run

ENTRIES = {entry.name: entry for entry in user_functions.ENTRIES}
PURE = [entry for entry in ENTRIES.values() if entry.pure]
IMPURE = [entry for entry in ENTRIES.values() if not entry.pure]
GROUPS = 96  # of entries that are compiled one by one

machine_code = pytest.mark.skipif(
    getattr(config, "DISABLE_JIT", False), reason="nothing is compiled without JIT"
)


def sized(entries):
    """Entries with sizes: 9, at which arrays become loops, each day, the others once a week."""
    return [
        pytest.param(entry, n, id=f"{entry.theme}-{entry.name}-{n}", marks=when(i + n, n))
        for i, entry in enumerate(entries)
        for n in user_functions.SIZES
    ]


def when(number, n):
    """Another eighth of the entries of each other size in each `.ci/run`."""
    if n == 9:
        return ()
    return pytest.mark.weekly if number % 8 else pytest.mark.ci


def hold(entry, n, dt=0):
    """Report the entry, its size, the point and both numbers."""
    verdict = judged(entry, n, dt)
    where = f"{entry.theme}.{entry.name}, n={n}" + (f", dt={dt}" if dt else "")
    assert verdict.good, f"{where}: {verdict.kind}: {verdict.text}"


@pytest.mark.slow
@pytest.mark.parametrize(("entry", "n"), sized(PURE))
def test_a_pure_function_agrees_or_is_refused(entry, n):
    """At points of several scales, also with other parameters; python-control is as before."""
    hold(entry, n)


@pytest.mark.parametrize(("entry", "n"), sized([entry for entry in PURE if entry.discrete]))
def test_in_discrete_time_as_well(entry, n):
    """The same numbers are the next state."""
    hold(entry, n, 0.1)


@pytest.mark.parametrize(("entry", "n"), sized(IMPURE))
def test_an_impure_function_is_refused(entry, n):
    """Its memory stays as it was: python-control goes on as with a fresh instance."""
    hold(entry, n)
    assert judged(entry, n).kind == "refused"


def test_the_corpus_is_large():
    """Names are unique, and the counts do not shrink."""
    assert len(ENTRIES) == len(user_functions.ENTRIES)
    assert len(PURE) >= 300
    assert len(IMPURE) >= 50


@pytest.mark.weekly
def test_most_pure_functions_are_accepted():
    """Refusing all would be right and of no use."""
    kinds = [judged(entry, 9).kind for entry in PURE]
    assert kinds.count("refused") <= 0.4 * len(kinds)


def report(job, n, names):
    """Run entries in another process, and report all that fail at once."""
    found = run(job, n, names)
    assert set(found) == set(names)
    bad = {name: verdict for name, verdict in found.items() if verdict[0] not in GOOD}
    assert not bad, "\n".join(
        f"{name}, n={n}: {kind}: {text}" for name, (kind, text) in bad.items()
    )
    return found


def size(n):
    """The size at which arrays become loops in each `.ci/run`, the others once a week."""
    return pytest.param(n, marks=pytest.mark.ci if n == 9 else pytest.mark.weekly)


@machine_code
@pytest.mark.parametrize("n", [size(n) for n in user_functions.SIZES])
def test_traced_functions_in_one_diagram_in_machine_code(n):
    """Alone, side by side, and in a short run: a part of them, and once a week all."""
    found = report("joint", n, accepted(some(PURE, part=15), n, opaque=False))
    assert {kind for kind, _ in found.values()} == {"equal"}


def part(group):
    """A group that has some in each `.ci/run`, the others once a week."""
    return pytest.param(group, marks=pytest.mark.ci if group == 24 else pytest.mark.weekly)


@machine_code
@pytest.mark.parametrize("group", [part(group) for group in range(GROUPS)])
def test_functions_called_as_they_stand_in_machine_code(group):
    """numba compiles each, or the refusal names the reason."""
    report("single", 9, accepted(PURE[group::GROUPS], 9, opaque=True))


@machine_code
@pytest.mark.weekly
def test_steps_in_machine_code():
    """Discrete time, several steps in a row."""
    report("stepped", 9, [e.name for e in PURE if e.discrete and judged(e, 9, 0.1).good])
