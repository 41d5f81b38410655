"""The top of nlctl: what most scripts need, and rooms with all else."""

import importlib
import inspect
import warnings

import pytest

import nlctl
from nlctl.host.rooms import public_names

ROOMS = [name for name in nlctl.__all__ if inspect.ismodule(getattr(nlctl, name))]
MOVED = {
    name: room
    for room in ("actuators", "controllers", "describing", "errors", "native", "observers")
    + ("plants", "references", "sampling", "sensitivities", "sources")
    for name in public_names(room)
    if name not in nlctl.__all__
}


@pytest.fixture
def former():
    """What a name of the top means, with the warnings of its first use in a process."""

    def look_up(name):
        vars(nlctl).pop(name, None)
        with warnings.catch_warnings(record=True) as raised:
            warnings.simplefilter("always")
            first, second = getattr(nlctl, name), getattr(nlctl, name)
        assert first is second
        return first, [(one.category, str(one.message), one.filename) for one in raised]

    yield look_up
    for name in MOVED:
        vars(nlctl).pop(name, None)


def test_the_top_is_short():
    """At most 80 names, of which a dozen or two are rooms; `dir` has the same."""
    public = [name for name in nlctl.__all__ if not name.startswith("__")]
    assert len(public) <= 80
    assert dir(nlctl) == nlctl.__all__
    assert {"actuators", "controllers", "errors", "native", "sources"} <= set(ROOMS)


def test_every_name_of_a_room_is_there():
    """What `__all__` says without an import is what the imported room has."""
    for room in ROOMS:
        module = importlib.import_module(f"nlctl.{room}")
        assert public_names(room) == module.__all__
        assert [name for name in module.__all__ if not hasattr(module, name)] == []


def test_a_former_name_means_the_same_and_warns_once(former):
    """The warning says where the name is now, at the line that uses the former one."""
    assert {"BoucWen", "NussbaumLaw", "ZenoError", "Compiled", "TimeTable", "Tuned"} <= set(MOVED)
    for name, room in MOVED.items():
        thing, said = former(name)
        place = f"nlctl.{room}.{name}"
        assert thing is getattr(importlib.import_module(f"nlctl.{room}"), name)
        ((category, message, file),) = said
        assert (category, file) == (DeprecationWarning, __file__)
        assert message.startswith(f"nlctl.{name} is {place} now: ")


def test_importing_a_former_name_warns_once(former):
    """Python looks twice for a name that is imported."""
    former("BoucWen")
    vars(nlctl).pop("BoucWen")
    with pytest.warns(DeprecationWarning, match=r"is nlctl\.actuators\.BoucWen now") as raised:
        from nlctl import BoucWen
    assert (len(raised), raised[0].filename) == (1, __file__)
    assert BoucWen is nlctl.actuators.BoucWen


def test_what_is_nowhere_is_no_attribute():
    """Nor is a name of a room that never was at the top."""
    for name in ("BoucWan", "example_1", "Target", "_places"):
        with pytest.raises(AttributeError, match=f"nlctl.*{name}"):
            getattr(nlctl, name)
