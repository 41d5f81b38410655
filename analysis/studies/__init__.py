"""Study files: what is uncertain, what is asked, and everything joined to answer it."""

from .file.errors import Problem, StudyError
from .file.parse import StudyFile, read_study
from .file.schema import Study
from .file.shipped import shipped
from .file.written import from_toml, to_toml
from .folder import load_result, origin_differences, run_differences
from .plan import Plan, plan
from .replay import Replay, replay, replay_figure
from .result import Finding, Result
from .run import run
from .sealed import RunFolderError

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
