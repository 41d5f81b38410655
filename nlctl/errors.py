"""What the user can put right.  Every message names the culprit, the rule and the value."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy import ndarray

__all__ = [
    "AlgebraicLoopError",
    "AmbiguousNameError",
    "AuditError",
    "BlockError",
    "CacheWarning",
    "ChatteringError",
    "CompileError",
    "DiagramError",
    "DivergedError",
    "EngineWarning",
    "InexactWarning",
    "OperatingPointError",
    "ParameterError",
    "UnknownKeywordError",
    "UnknownNameError",
    "UsageError",
    "ZenoError",
]


class UsageError(ValueError):
    """Base of the errors that bad input causes; the command line shows them as one sentence.

    Examples
    --------
    >>> try:
    ...     nlctl.interconnect({"gain": nlctl.Gain(k="high")})
    ... except nlctl.errors.UsageError as error:
    ...     print(error)
    Gain needs numbers for k, got 'high'
    """


class ParameterError(UsageError):
    """A parameter breaks a rule: the message names record, rule, value and block.

    Examples
    --------
    >>> nlctl.DeadZone(b_r=-0.1)
    Traceback (most recent call last):
    nlctl.errors.ParameterError: DeadZone needs b_r >= 0, got -0.1
    """


class UnknownNameError(UsageError):
    """A parameter, state, signal or block of that name does not exist.

    Examples
    --------
    >>> zone = nlctl.block(nlctl.DeadZone(), "actuator")
    >>> nlctl.input_output_response(zone, [0.0, 1.0], 0.5, params={"actuator.br": 0.6})
    Traceback (most recent call last):
    nlctl.errors.UnknownNameError: unknown parameter 'br' of block 'actuator'; nearest: 'b_r'
    """


class UnknownKeywordError(UnknownNameError, TypeError):
    """A record has no parameter of that name; Python's own kind of error as well.

    Examples
    --------
    >>> nlctl.DeadZone(br=0.1)
    Traceback (most recent call last):
    nlctl.errors.UnknownKeywordError: unknown parameter 'br' of DeadZone; nearest: 'b_r'
    """


class AmbiguousNameError(UsageError):
    """A name that means more than one thing in this diagram.

    Examples
    --------
    >>> stage = nlctl.actuators.cascade({"gain": nlctl.Gain()})
    >>> two = nlctl.actuators.cascade({"first": stage, "second": stage.copy(name="second")})
    >>> nlctl.input_output_response(two, [0.0, 1.0], 1.0, params={"gain.k": 2.0})
    Traceback (most recent call last):
    nlctl.errors.AmbiguousNameError: parameter 'gain.k' could be first.gain.k or second.gain.k
    """


class DiagramError(UsageError):
    """Blocks that cannot be connected: the message names block and signal.

    Examples
    --------
    >>> nlctl.interconnect({"a": nlctl.Lag(), "b": nlctl.Lag()}, inputs=["u"], outputs=["v"])
    Traceback (most recent call last):
    nlctl.errors.DiagramError: signal 'v' is an output of 'a' and of 'b'; rename one, or ...
    """


class BlockError(DiagramError, TypeError):
    """What cannot be made a block: the message says what it lacks; Python's kind as well.

    Examples
    --------
    >>> nlctl.block(nlctl.DeadZone, "actuator")
    Traceback (most recent call last):
    nlctl.errors.BlockError: DeadZone is a class: make a record of it first
    """


class DivergedError(RuntimeError):
    """A run that did not reach its last time: its state left the finite numbers, for instance.

    Attributes
    ----------
    time : float
        Last accepted time of the integrator (s).

    Examples
    --------
    x' = x^2 from x = 1 is 1 / (1 - t): it does not reach t = 2.

    >>> import control as ct
    >>> escapes = ct.nlsys(lambda t, x, u, params: x**2, inputs=0, states=1, name="escapes")
    >>> try:
    ...     nlctl.input_output_response(escapes, [0.0, 2.0], 0, [1.0])
    ... except nlctl.errors.DivergedError as error:
    ...     print(round(error.time, 6))
    1.0
    """

    def __init__(self, message: str, time: float) -> None:
        super().__init__(message)
        self.time = time


class ChatteringError(DivergedError):
    """A run that switches over and over again at one jump, and does not come away from it.

    ``time`` is where it was found.  What handles runs that did not reach their end handles it.

    Examples
    --------
    An ideal relay takes x to 0 at t = 1, and would hold it there:

    >>> import control as ct
    >>> import numpy as np
    >>> holds = ct.nlsys(lambda t, x, u, params: -np.sign(x), inputs=0, states=1, name="holds")
    >>> try:
    ...     nlctl.input_output_response(holds, [0.0, 2.0], 0, [1.0], slide=False)
    ... except nlctl.errors.ChatteringError as error:
    ...     print(round(error.time, 3))
    1.0
    """


class ZenoError(DivergedError):
    """A run whose jumps follow each other ever faster: no time lies beyond all of them.

    ``time`` is where they accumulate.  What handles runs that did not reach their end handles it.

    Examples
    --------
    A ball that loses half of its speed at each bounce comes to rest after infinitely many:

    >>> @nlctl.record
    ... class Ball:
    ...     inputs, outputs, states, feedthrough = (), ("h",), ("h", "v"), False
    ...     initial = {"h": 1.0}
    ...     update = staticmethod(lambda t, x, u, p: (x[1], -2.0))
    ...     output = staticmethod(lambda t, x, u, p: (x[0],))
    ...     guard = staticmethod(lambda t, x, u, p: (x[0],))
    ...     reset = staticmethod(lambda t, x, u, p: (x[0], -0.5 * x[1]))
    >>> ball = nlctl.block(Ball(), "ball")
    >>> try:
    ...     nlctl.input_output_response(ball, [0.0, 4.0], engine="python-control")
    ... except nlctl.errors.ZenoError as error:
    ...     print(round(error.time, 4))
    3.0
    """

    @classmethod
    def of(cls, block: str, limit: float) -> ZenoError:
        """Return the error of a block whose guard falls again and again.

        Parameters
        ----------
        block : str
            Its name.
        limit : float
            Time at which the jumps accumulate (s).

        Returns
        -------
        ZenoError
            With that time.
        """
        return cls(
            f"block '{block}' jumps without end before t = {limit:.6g} s (Zeno): a guard that "
            "falls again and again needs a reset, or another state, that ends it",
            float(limit),
        )


class InexactWarning(UserWarning):
    """Derivatives hold differences, such as of a function that is called in Python: it says which.

    Examples
    --------
    >>> import warnings
    >>> import control as ct
    >>> import scipy.special
    >>> system = ct.nlsys(
    ...     lambda t, x, u, params: [u[0] - scipy.special.yv(0, x[0])],
    ...     None, states=1, inputs=1, outputs=1, name="plant",
    ... )
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     linear = nlctl.linearize(system, [1.0])
    >>> print(caught[0].category.__name__, linear.A.round(6))  # Y_0' = -Y_1
    InexactWarning [[-0.781213]]
    """


class CompileError(UsageError):
    """A block that cannot be compiled: the message names it and says why.

    Examples
    --------
    A function that remembers is not one of its arguments; python-control still runs it:

    >>> import control as ct
    >>> def remembers(t, x, u, params):
    ...     seen.append(u[0])
    ...     return u
    >>> seen = []
    >>> nlctl.compile(ct.nlsys(None, remembers, inputs=1, outputs=1, name="block"))
    Traceback (most recent call last):
    nlctl.errors.CompileError: block 'block' cannot be compiled: ...
    """


class AlgebraicLoopError(UsageError):
    """Signals that depend on each other at the same instant; the message prints the loop.

    Examples
    --------
    >>> import control as ct
    >>> def half(t, x, u, params):
    ...     return 1 + 0.5 * u
    >>> half = ct.nlsys(None, half, inputs="v", outputs="w", name="half")
    >>> same = ct.nlsys(None, lambda t, x, u, params: u, inputs="w", outputs="v", name="same")
    >>> loop = ct.interconnect([half, same], outputs="w", name="loop")
    >>> nlctl.compile(loop)
    Traceback (most recent call last):
    nlctl.errors.AlgebraicLoopError: ...
    >>> print(nlctl.compile(loop, algebraic_loops="solve").output(0, []))  # w = 1 + w / 2
    [2.]
    """


class AuditError(UsageError):
    """Machine code and python-control differ; the message names the block and both numbers.

    Examples
    --------
    A function that reads a clock is not one of its arguments; the audit sees it where reading its
    code does not.  With ``engine="auto"`` python-control takes over, and an `EngineWarning` says
    so:

    >>> issubclass(nlctl.errors.AuditError, nlctl.errors.UsageError)
    True
    """


class OperatingPointError(UsageError):
    """No operating point was found: the message says how far the nearest place is from one.

    Attributes
    ----------
    states, inputs : ndarray
        Where the search has ended.
    residual : float
        Largest violation there.

    Examples
    --------
    >>> import control as ct
    >>> never = ct.nlsys(lambda t, x, u, params: x**2 + 1, inputs=0, states=1, name="never")
    >>> try:
    ...     nlctl.find_operating_point(never)
    ... except nlctl.errors.OperatingPointError as error:
    ...     print(error.residual)
    1.0
    """

    def __init__(self, message: str, states: ndarray, inputs: ndarray, residual: float) -> None:
        super().__init__(message)
        self.states, self.inputs, self.residual = states, inputs, residual


class EngineWarning(UserWarning):
    """A diagram could not be compiled, and python-control runs it: the message says why.

    Examples
    --------
    >>> import warnings
    >>> import control as ct
    >>> def remembers(t, x, u, params):
    ...     seen.append(u[0])
    ...     return u
    >>> seen = []
    >>> block = ct.nlsys(None, remembers, inputs=1, outputs=1, name="block")
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     response = nlctl.input_output_response(block, [0.0, 1.0], 2.0)
    >>> print(caught[0].category.__name__, response.outputs)
    EngineWarning [2. 2.]
    """


class CacheWarning(UserWarning):
    """Machine code is not kept: others may write to the folder, or it is another user's.

    Examples
    --------
    A folder in which others may write keeps no machine code: it would be executed.

    >>> import os, tempfile, warnings
    >>> from unittest import mock
    >>> with (
    ...     tempfile.TemporaryDirectory() as folder,
    ...     mock.patch.dict(os.environ, NLCTL_CACHE_DIR=folder),
    ...     warnings.catch_warnings(record=True) as caught,
    ... ):
    ...     warnings.simplefilter("always")
    ...     os.chmod(folder, 0o777)
    ...     outputs = nlctl.compile(nlctl.block(nlctl.Gain(), "gain")).output(0, [], [1.0])
    >>> {warning.category.__name__ for warning in caught}
    {'CacheWarning'}
    """
