"""The figure of a claim about a probability: which of its two statements decides, and that it does.

Bounds that hold after every run (a confidence sequence) are wider than exact bounds after a number
of runs that was fixed in advance.  A fixed number of runs shows both, and the exact ones decide.
"""

import pytest
from matplotlib.collections import FillBetweenPolyCollection
from matplotlib.container import ErrorbarContainer
from matplotlib.text import Text
from studies_example import HEAD, write

from nlctl.analysis.pages.study.report import study_report
from nlctl.analysis.report.document import Figure
from nlctl.analysis.report.outline import claim_status
from nlctl.analysis.studies import read_study, run

LIMITS = {"refuted": 0.02, "not shown yet": 0.13, "shown": 0.3}  # of a probability of 0.13
ASKED = '[[analysis]]\nkind = "{kind}"\nlimit = {limit}\nkey = "{key}"\n'
BAND, BAR = "bounds at all n", "exact bounds"
KEYS = [(k, answer) for k in ("probability", "sequential") for answer in LIMITS]


def key_of(kind, answer):
    """Return the key of the analysis that has this answer."""
    return f"{kind}-{answer.replace(' ', '-')}"


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The page of a study that claims what is true, what is false and what nobody can tell."""
    folder = tmp_path_factory.mktemp("convergence")
    asked = [ASKED.format(kind=k, limit=LIMITS[a], key=key_of(k, a)) for k, a in KEYS]
    study = read_study(write(folder, HEAD, "[runs]\nsize = 200\n", *asked))
    return study_report(run(study, folder / "run"))


def drawn_bounds(figure, *, of_band):
    """Return the ends of the band after the last run, or of the bar, as they are drawn."""
    (ax,) = figure.axes
    if of_band:
        (band,) = ax.findobj(FillBetweenPolyCollection)
        corners = band.get_paths()[0].vertices
        last = corners[corners[:, 0] == corners[:, 0].max(), 1]
        return last.min(), last.max()
    (bar,) = (c for c in ax.containers if isinstance(c, ErrorbarContainer))
    (stem,) = bar.lines[2]
    heights = stem.get_segments()[0][:, 1]
    return heights.min(), heights.max()


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize(("kind", "answer"), KEYS)
def test_what_is_said_to_decide_does(report, kind, answer):
    """In the text and in the figure, and its ends on paper give the answer that the claim has."""
    key = key_of(kind, answer)
    items = [i for s in report.sections for i in s.items if isinstance(i, Figure)]
    (shown,) = (i for i in items if i.key == f"{key}-running")
    (claim,) = (c for c in report.claims if c.evidence == key)
    assert claim_status(claim)[0] == answer
    sequential = kind == "sequential"
    labels = {t.get_text() for t in shown.figure.axes[0].get_legend().findobj(Text)}
    assert {t for t in labels if "decide" in t} == {f"{BAND if sequential else BAR}: decide"}
    assert (BAND in labels) is not sequential
    told = "rests on the band" if sequential else "rests on the exact bounds at the end alone"
    assert told in shown.caption
    assert told in shown.description
    limit = LIMITS[answer]
    low, high = drawn_bounds(shown.figure, of_band=sequential)
    assert ("shown" if high <= limit else "refuted" if low > limit else "not shown yet") == answer
