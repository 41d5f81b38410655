"""Integrators: two methods that take turns, control of the step, events, memory, samples.

`advance` takes steps of an explicit pair or of `stiff` (`rodas5p`) as `control` chooses them,
`events` are located and `restart` resumes behind them; `memory` is what turns, `state` and
`workspace` are what a lane has.  All is compiled to bitcode, which `nlctl.native.driver` calls.
"""
