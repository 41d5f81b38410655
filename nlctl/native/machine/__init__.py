"""Machine code: finished, kept on disk, called.

`finish` makes LLVM IR code of this process, `machine_code` does so with what numba has compiled,
`export` makes bitcode of that.  `fingerprint` makes keys of all that code is made of, `store` keeps
bytes under a key.  `routine` and `evaluations` are how it is called, and `calls` how it calls back.
"""
