"""Validated integration: enclosures of all solutions that begin in a box.

`series` has the Taylor coefficients of a motion and of its derivatives on boxes, as machine code,
`intervals` arithmetic of floats rounded outwards, `steps` one step of Lohner's method, `tube` a
whole integration.
"""
