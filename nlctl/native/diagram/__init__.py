"""Reading a diagram: its wiring, the order of evaluation, feedthrough, algebraic loops.

`checks` reads its functions before any is called, `trace` runs them on symbols.  `parameters` and
`program` say where its numbers lie.
"""
