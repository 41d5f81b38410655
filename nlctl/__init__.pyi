from . import (
    actuators,
    controllers,
    describing,
    errors,
    export,
    faults,
    functions,
    native,
    observers,
    paper,
    papers,
    plants,
    references,
    sampling,
    sensitivities,
    sources,
)
from ._version import __version__ as __version__
from .actuators import (
    Backlash,
    DeadZone,
    Gain,
    Lag,
    Quantiser,
    RateLimiter,
    Relay,
    Saturation,
)
from .blocks import Block, Spec, block
from .controllers import (
    PID,
    PID2,
    adaptive_neural,
    dynamic_surface_control,
    l1_adaptive,
    mrac,
    sliding_mode,
)
from .delays import TransportDelay
from .describing import describing_function, describing_function_plot, limit_cycles
from .diagrams import initial_state, interconnect, parameters, state_names
from .drawing.picture import draw
from .equations import equation
from .faults import Fault, with_faults
from .fmi import FMU
from .native import (
    compile,  # noqa: A004
    ensemble_response,
    find_operating_point,
    find_operating_points,
    frequency_response,
    linearize,
    stepper,
    typeset,
    vector_stepper,
)
from .params import param, record
from .plants import PureFeedback
from .references import FilteredStep, FunctionReference, SumOfSines
from .response import input_output_response
from .sampling import Clock, TriggeredHold, discretise, sampled
from .sensitivities import Measurement, fit, metric_gradient, sensitivity_response, tune
from .sliding import IdealRelay
from .sources import Sine, Step

__all__ = [
    "FMU",
    "PID",
    "PID2",
    "Backlash",
    "Block",
    "Clock",
    "DeadZone",
    "Fault",
    "FilteredStep",
    "FunctionReference",
    "Gain",
    "IdealRelay",
    "Lag",
    "Measurement",
    "PureFeedback",
    "Quantiser",
    "RateLimiter",
    "Relay",
    "Saturation",
    "Sine",
    "Spec",
    "Step",
    "SumOfSines",
    "TransportDelay",
    "TriggeredHold",
    "actuators",
    "adaptive_neural",
    "block",
    "compile",
    "controllers",
    "describing",
    "describing_function",
    "describing_function_plot",
    "discretise",
    "draw",
    "dynamic_surface_control",
    "ensemble_response",
    "equation",
    "errors",
    "export",
    "faults",
    "find_operating_point",
    "find_operating_points",
    "fit",
    "frequency_response",
    "functions",
    "initial_state",
    "input_output_response",
    "interconnect",
    "l1_adaptive",
    "limit_cycles",
    "linearize",
    "metric_gradient",
    "mrac",
    "native",
    "observers",
    "paper",
    "papers",
    "param",
    "parameters",
    "plants",
    "record",
    "references",
    "sampled",
    "sampling",
    "sensitivities",
    "sensitivity_response",
    "sliding_mode",
    "sources",
    "state_names",
    "stepper",
    "tune",
    "typeset",
    "vector_stepper",
    "with_faults",
]
