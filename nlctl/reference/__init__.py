"""The reference engine: python-control's equations, SciPy's integrators, and one driver.

Simulate to the next stop, jump, go on.  `stops` are the instants that are known before the run,
`crossings` those that are located in it by `looks` at its steps, `jumps` what happens there, `past`
what transport delays need of it; `switches` and `rough` say where there is no end of steps;
`driver` goes from one stop to the next, and `interpreted` is the run as it is asked for.
"""
