"""The content of a study file: shapes and types only.  `check` compares it with the loop."""

from __future__ import annotations

import itertools
import re
from typing import Annotated, Any, ClassVar, Literal

import tomli_w
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, SerializeAsAny

from nlctl.annotations import as_annotated
from nlctl.arguments import ATOL, RTOL

# strict: "0.3" and true are no numbers
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Names = tuple[str, ...]
Id = Annotated[str, Field(pattern=r"^[^\s,;]*$", max_length=60)]
Pair = tuple[Number, Number]
Flag = Annotated[bool, Field(strict=True)]
Confidence = Annotated[float, Field(strict=True, gt=0, lt=1)]
Size = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]


class Strict(BaseModel):
    """A table of the file: unknown keys are refused, nothing changes once it is read."""

    model_config = ConfigDict(extra="forbid", frozen=True)


Ids = Annotated[
    tuple[Id, ...], BeforeValidator(lambda given: (given,) if isinstance(given, str) else given)
]


class Asked(Strict):
    """Keys of every analysis in a study file; the schema of a kind adds its own.

    Examples
    --------
    The keys of a table of one's own, checked as those of nlctl's kinds are:

    >>> from typing import Any, ClassVar
    >>> from pydantic import Field
    >>> from nlctl.analysis.studies import Asked
    >>> class Spread(Asked):
    ...     of: str = Field("spec", description="Column of the main table.")
    ...     limit: float | None = Field(None, gt=0, description="Claim: it is at most this.")
    ...     claimed: ClassVar[str] = "the spread is at most {limit:g}"
    >>> Spread(kind="spread", limit=0.5).claim
    'the spread is at most 0.5'
    >>> Spread(kind="spread", limit=-1.0)
    Traceback (most recent call last):
    pydantic_core._pydantic_core.ValidationError: 1 validation error for Spread
    limit
      Input should be greater than 0 ...
    """

    key: str = Field(
        "",
        pattern=r"^[a-z0-9-]*$",
        description="Name of its folder: lower-case letters, digits, hyphens; by default the kind.",
    )
    title: str = Field("", description="Its heading in the report.")
    id: Ids = Field(
        (), description="Ids of the requirements that its claim answers: one, or a list."
    )
    kind: str
    definition: ClassVar[Any] = None
    """The `Kind` of the table, once a file has named it."""
    claimed: ClassVar[str] = ""
    """What it claims with a key ``limit`` that is given, with keys of the table in braces."""

    @property
    def claim(self) -> str:
        """What the study claims by asking for it; empty if it asks and claims nothing."""
        is_given = getattr(self, "limit", None) is not None
        return self.claimed.format_map(vars(self)) if is_given else ""


class Varied(Asked):
    """An analysis that may vary a part of the quantities.

    Examples
    --------
    >>> from nlctl.analysis.studies import Varied
    >>> class Corners(Varied):
    ...     levels: int = 2
    >>> Corners(kind="corners", quantities=["lag.T"]).quantities
    ('lag.T',)
    >>> Corners(kind="corners").quantities  # all
    ()
    """

    quantities: Names = Field((), description="What is varied, the rest nominal; all by default.")


RESERVED = {"rows"}
"""Keys that no analysis has: the folder of the main table."""


class About(Strict):
    """What the study is about."""

    title: str = Field(min_length=1, description="Title of the report.")
    question: str = Field("", description="What the study is to answer, in words.")
    seed: Whole = Field(ge=0, description="All random numbers of the study follow from it.")


class Law(Strict):
    """An uncertain number: one of uniform, normal, law, or bounds alone."""

    uniform: Pair | None = Field(None, description="[low, high]")
    normal: Pair | None = Field(None, description="[mean, standard deviation]")
    law: str | None = Field(None, description="A law of scipy.stats, such as 'lognorm'.")
    parameters: dict[str, Number] = Field({}, description="Parameters of law, by SciPy's names.")
    bounds: Pair | None = Field(None, description="The box of corners and searches: [low, high].")
    nominal: Number | None = Field(None, description="By default the loop's own value.")
    unit: str = Field("", description="By default the loop's.")


class Choices(Strict):
    """A block or a setting that is one of several.

    An option is a number or a text for the loop's keyword, ``"default"``, a table ``{ block =
    "DeadZone", b_r = 0.6 }`` or ``{ function = "file.py:name", ... }``.
    """

    options: dict[str, Any] = Field(min_length=1, description="Label -> option.")
    nominal: str = Field("", description="Label that holds by default; the first one.")
    weights: dict[str, Number] = Field({}, description="Label -> probability; all alike.")


class Rule(Strict):
    """A requirement."""

    formula: str = Field(description="For example 'always from 10 s on |e| <= 0.15'.")
    meaning: str = Field("", description="In words.")
    until: Number | None = Field(None, description="Where windows end (s); the end of the run.")
    id: Id = Field("", description="Its id where requirements are kept, such as 'REQ-12'.")


class Times(Strict):
    """When signals are sampled."""

    end: Number = Field(gt=0, description="Length of a run (s).")
    step: Number = Field(gt=0, description="Sampling interval (s).")


class Measured(Strict):
    """The usual numbers of a tracking loop, for every row.

    A signal that is not named is the paper's, and left out where the loop lacks it.
    """

    band: Number = Field(gt=0, description="|e| up to this counts as settled.")
    start: Number | None = Field(None, ge=0, description="Late errors count from here (s).")
    swing: Number = Field(0.01, ge=0, description="Swings of u up to this are no reversals.")
    error: str | None = Field(None, description="Name of the signal e.")
    control: str | None = Field(None, description="Name of the signal u.")
    actuated: str | None = Field(None, description="Name of the signal v.")
    weights: str | None = Field(None, description="Name of the signal |W_hat|.")
    gain: str | None = Field(None, description="Name of the signal zeta.")
    more: tuple[dict[str, Any], ...] = Field(
        (), description="{ function = ... } that return other metrics of a row."
    )


class SolverTable(Strict):
    """How runs are integrated."""

    rtol: Number = Field(RTOL, gt=0, lt=1, description="Relative tolerance.")
    atol: Number = Field(ATOL, gt=0, description="Absolute tolerance.")
    max_steps: Whole = Field(
        1_000_000, ge=1, le=10**15, description="A run that needs more has failed."
    )
    method: str = Field("auto", description="As in nlctl.input_output_response.")


class Rows(Strict):
    """The rows that probability, sequential and regional analyses look at."""

    design: Literal[
        "i.i.d.", "Sobol'", "Latin hypercube", "grid", "corners", "one at a time"
    ] = "i.i.d."  # fmt: skip
    size: Whole | None = Field(None, ge=1, description="Number of rows of the first three.")
    levels: Whole | None = Field(None, ge=1, description="Values per quantity of a grid.")


class Faulty(Strict):
    """What may happen to a signal: the kind of a fault, and how large it is."""

    stuck: Number | Literal[True] | None = Field(
        None, description="Stuck at this value; true: at the one of the onset."
    )
    bias: Number | None = Field(None, description="Offset.")
    drift: Number | None = Field(None, description="Rate of an offset, per s.")
    gain: Number | None = Field(None, description="Factor, a loss of effectiveness.")
    noise: Size | None = Field(None, description="RMS of band-limited noise.")
    delay: Number | None = Field(None, gt=0, description="The signal as it was so long before (s).")
    dropout: Number | None = Field(None, gt=0, description="0 for so long (s).")
    disconnection: Literal[True] | None = Field(None, description="true: 0 for ever.")


class Study(Strict):
    """A study file; `own_kinds.study_model` adds what its analyses look like.

    Examples
    --------
    See `from_toml`.
    """

    loop: str = Field(
        description="'example-1', 'example-2', 'path/to/file.py:function' or 'module:function'."
    )
    study: About
    options: dict[str, Any] = Field({}, description="Keywords of the loop; as options of choices.")
    space: dict[str, Law] = Field({}, description="Parameter or initial state -> what is known.")
    inputs: dict[str, Number] = Field(
        {}, description="Input of the loop from outside -> its value, the same all the time."
    )
    choices: dict[str, Choices] = Field({}, description="Keyword of the loop -> its options.")
    faults: dict[str, Faulty] = Field(
        {}, description="Signal of the loop -> kinds of faults, for the analysis 'faults'."
    )
    spec: dict[
        str,
        Annotated[
            Rule,
            BeforeValidator(lambda given: {"formula": given} if isinstance(given, str) else given),
        ],
    ] = Field(
        description="Name -> requirement.",
        json_schema_extra={"minProperties": 1},  # `checked_experiment` says so, with all else
    )
    time: Times
    metrics: Measured | None = Field(None, description="Without it only margins are taken.")
    solver: SolverTable = SolverTable()  # type: ignore[call-arg]
    runs: Rows | None = Field(None, description="The main table.")
    analysis: tuple[SerializeAsAny[Asked], ...] = Field((), description="What is asked.")


def study_data(study: Study) -> dict[str, Any]:
    """Return the data of a file with this study; what is left to defaults is left out."""
    return study.model_dump(mode="json", exclude_unset=True, exclude_none=True)


@as_annotated
def to_toml(study: Study) -> str:
    """Return the text of a study file with this study; what is left to defaults is left out.

    Parameters
    ----------
    study : Study
        What is written.

    Returns
    -------
    str
        TOML.

    Examples
    --------
    >>> from nlctl.analysis.studies import from_toml, shipped, to_toml
    >>> study = from_toml(shipped("example-1-quick").read_text(encoding="utf-8"))
    >>> text = to_toml(study)
    >>> from_toml(text) == study
    True
    >>> print(text[text.index("[time]"):].split("[metrics]")[0].strip())
    [time]
    end = 20.0
    step = 0.01
    """
    return tomli_w.dumps(study_data(study))


def keyed(study: Study) -> dict[str, Any]:
    """Return the analyses by key: their own, or their kind, numbered where it is not alone."""
    named: dict[str, Any] = {}
    taken = {asked.key for asked in study.analysis} | RESERVED
    for asked in study.analysis:
        plain = re.sub("[^a-z0-9]+", "-", asked.kind.rpartition(":")[2].lower())
        key = asked.key or plain
        numbers = itertools.count(2)
        while key in named or (key in taken and not asked.key):
            key = f"{plain}-{next(numbers)}"
        named[key] = asked
    return named
