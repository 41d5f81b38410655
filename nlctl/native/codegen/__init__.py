"""From source to machine code, and machine code kept on disk.

`fingerprint` makes keys of all that code is made of, `store` keeps bytes under a key,
`machine_code` turns compiled functions into bytes and back, `module` gives emitted source a place
to live in.
"""
