"""Enclosures of expressions over boxes, as machine code.

`rounding` makes bounds of rounded numbers, `arithmetic` intervals of them, `rules` has the table of
interval rules for the operations of an expression, `writer` walks a plan, `boxes` makes the code of
a function of a box, `search` divides boxes.
"""
