"""Geometry of block diagrams: `records` on paper, `order` of blocks, `heights`, `routes`."""
