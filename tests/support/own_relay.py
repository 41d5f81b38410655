"""A relay with hysteresis as a user writes one."""

import nlctl


@nlctl.record
class Side:
    """A relay with hysteresis whose output is its memory."""

    width: float = nlctl.param(1.0, unit="1", meaning="threshold", above=0)
    inputs, outputs, states, feedthrough = ("u",), ("v",), ("side",), False
    memory, initial = ("side",), {"side": -1.0}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (0.0,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def commit(t, x, u, p):
        if u[0] > p.width:
            return (1.0,)
        if u[0] < -p.width:
            return (-1.0,)
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def switching(t, x, u, p):
        return u[0] - p.width, u[0] + p.width
