"""Study files: what is uncertain, what is asked, and everything connected to answer it."""

from .differences import origin_differences, run_differences
from .file.errors import Problem, StudyError
from .file.schema import Asked, Study, Varied, to_toml
from .folder import Integrity, load_result, verify
from .kind import Ground, Kind, Setup, finding_of
from .kinds import KINDS
from .plan import Plan, plan
from .reading.own_kinds import from_toml
from .reading.parse import StudyFile, read_study, shipped
from .replay import Replay, replay, replay_figure
from .result import Finding, Result
from .run import run
from .sealed import RunFolderError

__all__ = [
    "KINDS",
    "Asked",
    "Finding",
    "Ground",
    "Integrity",
    "Kind",
    "Plan",
    "Problem",
    "Replay",
    "Result",
    "RunFolderError",
    "Setup",
    "Study",
    "StudyError",
    "StudyFile",
    "Varied",
    "finding_of",
    "from_toml",
    "load_result",
    "origin_differences",
    "plan",
    "read_study",
    "replay",
    "replay_figure",
    "run",
    "run_differences",
    "shipped",
    "to_toml",
    "verify",
]
