from . import actuators, controllers, functions, native, paper, plants, references
from ._block import Block, block
from ._diagram import initial_state, interconnect, parameters, state_names
from ._equation import equation
from ._errors import (
    AmbiguousNameError,
    DiagramError,
    DivergedError,
    ParameterError,
    UnknownNameError,
)
from ._param import param, record
from .actuators import Backlash, DeadZone
from .controllers import (
    AdaptiveWeights,
    DeadZoneNussbaumLaw,
    FilteredError,
    GaussianBasis,
    KnownSignLaw,
    LeakyNussbaumLaw,
    MonotoneNussbaumLaw,
    NussbaumLaw,
    RobustTerm,
    Zero,
    adaptive_neural,
    diagonal_centres,
    grid_centres,
    latin_hypercube_centres,
)
from .drawing import draw
from .native import (
    AlgebraicLoopError,
    Compiled,
    CompileError,
    Ensemble,
    compile,  # noqa: A004
    ensemble_response,
)
from .plants import ForcedDuffing, Genesio, PureFeedback
from .references import BandLimitedNoise, FilteredStep, FunctionReference, SumOfSines
from .response import EngineWarning, input_output_response

__all__ = [
    "AdaptiveWeights",
    "AlgebraicLoopError",
    "AmbiguousNameError",
    "Backlash",
    "BandLimitedNoise",
    "Block",
    "CompileError",
    "Compiled",
    "DeadZone",
    "DeadZoneNussbaumLaw",
    "DiagramError",
    "DivergedError",
    "EngineWarning",
    "Ensemble",
    "FilteredError",
    "FilteredStep",
    "ForcedDuffing",
    "FunctionReference",
    "GaussianBasis",
    "Genesio",
    "KnownSignLaw",
    "LeakyNussbaumLaw",
    "MonotoneNussbaumLaw",
    "NussbaumLaw",
    "ParameterError",
    "PureFeedback",
    "RobustTerm",
    "SumOfSines",
    "UnknownNameError",
    "Zero",
    "actuators",
    "adaptive_neural",
    "block",
    "compile",
    "controllers",
    "diagonal_centres",
    "draw",
    "ensemble_response",
    "equation",
    "functions",
    "grid_centres",
    "initial_state",
    "input_output_response",
    "interconnect",
    "latin_hypercube_centres",
    "native",
    "paper",
    "param",
    "parameters",
    "plants",
    "record",
    "references",
    "state_names",
]
