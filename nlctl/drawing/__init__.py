"""Block diagrams as pictures.

`records` on paper, `order` of blocks, `heights`, `routes`, and the `picture`.
"""

from .picture import draw

__all__ = ["draw"]
