"""From a diagram to LLVM IR.

`trace` reads functions, `lower` puts the expressions of a diagram (`equations/`) together as a
`program`, `newton` and `solver` solve algebraic loops in it.  `rewrite` puts expressions into
cheaper words, `plan` says when each is computed and where it lies, `ir` writes a plan as LLVM IR,
`interpret` carries it out in plain Python; `calls` is for functions that are called as they stand.
"""
