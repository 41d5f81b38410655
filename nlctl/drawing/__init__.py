"""Block diagrams as pictures.

`records` on paper, `order` of blocks, `routes`, and the `picture`.
"""

from .picture import draw

__all__ = ["draw"]
