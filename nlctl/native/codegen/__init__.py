"""From expressions to machine code, and machine code kept on disk.

`rewrite` puts expressions into cheaper words, `plan` says when each is computed and where it lies.
`ir` writes a plan as LLVM IR, `finish` makes that code of this process, `interpret` carries it out
in plain Python; `calls` is for functions that are called as they stand.

`fingerprint` makes keys of all that code is made of, `store` keeps bytes under a key,
`machine_code` turns what numba has compiled into bytes and back, `module` gives emitted source a
place to live in.
"""
