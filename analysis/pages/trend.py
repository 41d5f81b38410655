"""The figure of one study over its revisions, for the gallery."""

from __future__ import annotations

from .. import figures
from ..report.document import Figure
from ..report.outline import claim_status
from ..report.trends import Trend

_DRAWN = 4  # numbers of a figure
_ENDS = {
    **dict.fromkeys(("pass", "proved", "checked"), "holds"),
    **dict.fromkeys(("refuted", "fail"), "fails"),
}


def trend_figure(trend: Trend) -> Figure:
    """Return the figure: how each claim ended, and the first of the main numbers."""
    claims = {  # how each ended, in one of the words of the figure
        name: ["" if c is None else _ENDS.get(claim_status(c)[1], "open") for c in row]
        for name, row in trend.claims.items()
    }
    numbers = dict(list(trend.numbers.items())[:_DRAWN])
    ended = "; ".join(
        f"{name}: {', '.join(end or 'not made' for end in ends)}" for name, ends in claims.items()
    )
    return Figure(
        key="trend",
        caption=f"{trend.title}: its claims and main numbers over {', '.join(trend.labels)}.",
        description=f"Claims over {', '.join(trend.labels)}. {ended}",
        figure=figures.trend(trend.labels, claims, numbers),
    )
