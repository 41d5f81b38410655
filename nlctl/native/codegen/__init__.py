"""From expressions to LLVM IR.

`newton` and `solver` solve algebraic loops.  `rewrite` puts expressions into cheaper words, `plan`
says when each is computed and where it lies, `ir` writes a plan as LLVM IR, `interpret` carries it
out in plain Python.
"""
