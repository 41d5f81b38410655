"""What is relied on of python-control and numba besides their documented interfaces.

`control_internals` has python-control's private names, `numba_internals` numba's; nothing else
uses one, and of llvmlite only the documented interface is used.  Each name has a test in
``tests/upstream/`` that says what it is relied on for: where a new version of a library breaks
something here, that test says what.
"""
