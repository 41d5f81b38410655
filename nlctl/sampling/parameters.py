"""What may be varied of a sampled block: its clock and its converters, as parameters."""

from typing import Any

from ..equations import equation
from ..errors import ParameterError
from ..params import param, record
from ..wording import counted
from .clock import Clock


@record
class Sampling:
    """How a block is sampled; one record for all blocks of a program.

    Whether outputs wait, and which signals go through a converter, is decided when the diagram is
    made: overrides change the numbers.

    Parameters
    ----------
    waiting : int, optional
        How many samples may wait at a time; 0 without a delay.
    converts_inputs, converts_outputs : bool, optional
        Whether they are rounded.
    own_time : bool, optional
        Whether what is sampled has a sampling time of its own, which cannot be overridden.

    Examples
    --------
    `sampled` makes one; its parameters are overridden as those of any block:

    >>> controller = nlctl.sampled(nlctl.block(nlctl.Gain(), "controller"), 0.1)
    >>> float(nlctl.parameters(controller)["value"]["controller.sampling.dt"])
    0.1
    """

    dt: float = param(0.01, unit="s", meaning="sampling time", above=0)
    offset: float = param(0.0, unit="s", meaning="time of the first sample", at_least=0)
    delay: float = param(0.0, unit="s", meaning="time from a sample to its outputs", at_least=0)
    jitter: float = param(0.0, unit="s", meaning="largest lateness of samples", at_least=0)
    seed: int = param(0, unit="1", meaning="seed of the lateness", at_least=0)
    input_quantum: float = param(0.0, unit="1", meaning="step of the inputs' converter", at_least=0)
    output_quantum: float = param(
        0.0, unit="1", meaning="step of the outputs' converter", at_least=0
    )
    waiting: int = 0
    converts_inputs: bool = False
    converts_outputs: bool = False
    own_time: float = 0.0

    inputs, outputs, states, feedthrough = (), (), (), False

    def check(self) -> None:
        """Refuse numbers that contradict each other, or what the diagram was made for."""
        self._check_delay(self.clock.pending)
        if self.own_time and self.dt != self.own_time:
            raise ParameterError(
                f"Sampling needs dt = {self.own_time:g}, got {self.dt:g}: what is sampled is made "
                "for this sampling time; method='euler' makes equations for any"
            )
        for name in ("input", "output"):
            value = getattr(self, f"{name}_quantum")
            if value and not getattr(self, f"converts_{name}s"):
                raise ParameterError(
                    f"Sampling needs {name}_quantum = 0 where there is no converter, got "
                    f"{value:g}: give nlctl.sampled {name}_quantum=0.0 to have one"
                )

    def _check_delay(self, pending: int) -> None:
        if not self.waiting and pending:
            rule, advice = "delay = 0 where no outputs wait", f"delay={self.delay:g}"
        elif self.waiting and not pending:
            rule, advice = "delay > 0 where outputs wait", "no delay"
        elif pending > self.waiting:
            rule = (
                f"delay <= {self.waiting * self.dt:g}, at most "
                f"{counted(self.waiting, 'sampling time')}"
            )
            advice = f"waiting={pending}"
        else:
            return
        raise ParameterError(
            f"Sampling needs {rule}, got {self.delay:g}: give nlctl.sampled {advice}"
        )

    @property
    def clock(self) -> Clock:
        """When it samples."""
        return Clock(
            dt=self.dt, offset=self.offset, delay=self.delay, jitter=self.jitter, seed=self.seed
        )

    def derived(self) -> dict[str, Any]:
        """How many samples wait, as a number."""
        return {"pending": float(self.clock.pending)}

    @equation
    def output(t, x, u, p):
        return ()
