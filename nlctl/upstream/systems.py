"""What nlctl asks of python-control's systems and responses, as types: no class is named."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np


class System(Protocol):
    """A block or a diagram: a `control.NonlinearIOSystem`, and whatever answers as it does."""

    input_labels: Any  # properties that are made by a call, of which type checkers know nothing
    output_labels: Any
    state_labels: Any

    @property
    def name(self) -> Any: ...
    @property
    def dt(self) -> Any: ...
    @property
    def ninputs(self) -> Any: ...
    @property
    def noutputs(self) -> Any: ...
    @property
    def nstates(self) -> Any: ...
    @property
    def input_index(self) -> Mapping[str, int]: ...
    @property
    def output_index(self) -> Mapping[str, int]: ...
    @property
    def state_index(self) -> Mapping[str, int]: ...


class SystemResponse(Protocol):
    """A response of one: `control.TimeResponseData`, and what nlctl makes of it."""

    t: Any  # attributes that are set after they were None
    x: Any
    y: Any
    u: Any

    @property
    def time(self) -> np.ndarray: ...
    @property
    def outputs(self) -> Any: ...
    @property
    def states(self) -> Any: ...
    @property
    def inputs(self) -> Any: ...
    @property
    def output_labels(self) -> Any: ...
    @property
    def state_labels(self) -> Any: ...
    @property
    def input_labels(self) -> Any: ...
    @property
    def sysname(self) -> Any: ...
