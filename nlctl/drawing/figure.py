"""A figure that shows itself in a notebook."""

from __future__ import annotations

import io

import matplotlib as mpl
from matplotlib.figure import Figure


class Drawing(Figure):
    """A matplotlib figure that a notebook shows as SVG, whatever backend is active.

    The same drawing gives the same bytes, so that notebooks under version control stay quiet.
    """

    def _repr_svg_(self) -> str:
        buffer = io.StringIO()
        with mpl.rc_context({"svg.hashsalt": "nlctl", "svg.fonttype": "path"}):
            self.savefig(buffer, format="svg", metadata={"Date": None})
        text = buffer.getvalue()
        return text[text.index("<svg") :]

    def _repr_html_(self) -> str:
        """The same within a box that scrolls, so that a wide diagram stays legible."""
        return f'<div style="overflow-x:auto">{self._repr_svg_()}</div>'
