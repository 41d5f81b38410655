"""Machine code: finished, kept on disk, called.

`finish` makes LLVM IR code of this process, `machine_code` does so with what numba has compiled,
`export` ships it as bitcode, and `integrators` are shipped so.  `fingerprint` makes keys of all
that code is made of, `store` keeps bytes under a key, `module` gives emitted source a place to
live in.  `routine`, `evaluations` and `called` are how it is called, and calls back; `ahead` makes
it before it is needed.
"""
