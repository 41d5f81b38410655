"""One actuator in machine code, driven by an input that is given: what tests of actuators share."""

import functools

import numpy as np

import nlctl
from nlctl.blocks import default_state
from nlctl.params import declared_params


@functools.cache
def compiled(kind, sizes=()):
    """Return the machine code of a record class with one input and its defaults."""
    spec = kind(**dict(sizes))
    block = nlctl.block(spec, "actuator")
    diagram = nlctl.interconnect(
        [block], inputs=list(spec.inputs), outputs=list(spec.outputs), name="rig"
    )
    return nlctl.compile(diagram)


def values(spec):
    """Return the parameters of a record by their qualified names."""
    return {f"actuator.{name}": getattr(spec, name) for name in declared_params(spec)}


def drive(spec, times, u, x0=None, **options):
    """Return the response of a record to inputs that are linear between `times`.

    The machine code is that of the record class: numbers of a record are parameters of the run.
    """
    start = default_state(nlctl.block(spec, "actuator")) if x0 is None else x0
    return nlctl.input_output_response(
        compiled(type(spec)), times, u, start, params=values(spec), squeeze=False, **options
    )


def along(spec, path, x0=None):
    """Return the outputs at the turning points of an input, one second after the other."""
    path = np.asarray(path, dtype=float)
    return drive(spec, np.arange(float(path.size)), path, x0).outputs[0]


def dense(path, parts):
    """Return a path with `parts` equal steps from each turning point to the next."""
    path, k = np.asarray(path, dtype=float), np.arange(parts) / parts
    return np.append((path[:-1, None] * (1 - k) + path[1:, None] * k).ravel(), path[-1])
