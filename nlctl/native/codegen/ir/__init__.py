"""LLVM IR from a plan, as text.

`text` is how instructions are written, `functions` what exp, sin and others are made of,
`numbers`, `loops` and `linear_systems` write the parts of a function, `program` whole programs.
"""
