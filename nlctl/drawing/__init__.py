"""Block diagrams as pictures.

`records` on paper, `order` of blocks, `heights`, `routes`, and the `picture`.
"""

from .picture import draw, lay_out, signal_graph

__all__ = ["draw", "lay_out", "signal_graph"]
