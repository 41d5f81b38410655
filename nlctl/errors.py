"""What the user can put right.  Every message names the culprit, the rule and the value."""


class UsageError(ValueError):
    """Base of the errors that bad input causes; the command line shows them as one sentence."""


class ParameterError(UsageError):
    """A parameter breaks a rule: the message names record, rule, value and block."""


class UnknownNameError(UsageError):
    """A parameter, state, signal or block of that name does not exist."""


class UnknownKeywordError(UnknownNameError, TypeError):
    """A record has no parameter of that name; Python's own kind of error as well."""


class AmbiguousNameError(UsageError):
    """A name that means more than one thing in this diagram."""


class DiagramError(UsageError):
    """Blocks that cannot be connected: the message names block and signal."""


class BlockError(DiagramError, TypeError):
    """What cannot be made a block: the message says what it lacks; Python's kind as well."""


class DivergedError(RuntimeError):
    """A run that did not reach its last time: its state left the finite numbers, for instance.

    Attributes
    ----------
    time : float
        Last accepted time of the integrator (s).
    """

    def __init__(self, message: str, time: float) -> None:
        super().__init__(message)
        self.time = time


class ChatteringError(DivergedError):
    """A run that switches over and over again at one jump, and does not come away from it.

    ``time`` is where it was found.  What handles runs that did not reach their end handles it.
    """


class CompileError(UsageError):
    """A block that cannot be compiled: the message names it and says why."""
