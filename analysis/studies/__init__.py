"""Study files: what is uncertain, what is asked, and everything joined to answer it."""

from .folder import load_result, origin_differences, run_differences
from .plain import RunFolderError
from .plan import Plan, plan
from .problems import Problem, StudyError
from .read import StudyFile, read_study
from .replay import Replay, replay, replay_figure
from .result import Finding, Result
from .run import run
from .schema import Study
from .shipped import shipped
from .written import from_toml, to_toml

__all__ = [
    "Finding",
    "Plan",
    "Problem",
    "Replay",
    "Result",
    "RunFolderError",
    "Study",
    "StudyError",
    "StudyFile",
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
]
