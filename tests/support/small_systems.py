"""Small systems to make diagrams of, and functions that take a table of rows for runs."""

import control as ct
import pandas as pd

import nlctl


@nlctl.record
class Affine:
    """y = k u + c."""

    k: float = nlctl.param(1.0, unit="1", meaning="gain", below=1e3)
    c: float = nlctl.param(0.0, unit="1", meaning="offset")
    takes: str = "u"
    delivers: str = "y"

    states = ()
    feedthrough = True

    @property
    def inputs(self):
        return (self.takes,)

    @property
    def outputs(self):
        return (self.delivers,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (p.k * u[0] + p.c,)


def gain(name, k=1.0, takes="u", delivers="y", **kwargs):
    return nlctl.block(Affine(k=k, takes=takes, delivers=delivers, **kwargs), name)


def third_party(name, key="q", default=2.0, takes="u", delivers="y", declared=True):
    """Return somebody else's gain, with a dict of parameters."""
    return ct.nlsys(
        None,
        lambda t, x, u, params: [params.get(key, default) * u[0]],
        inputs=[takes],
        outputs=[delivers],
        name=name,
        params={key: default} if declared else None,
    )


def out(system, params=None, u=1.0):
    """Return the one output of a static system with one input."""
    return float(system.output(0.0, [], [u], params=params)[0])


def chain(join=ct.interconnect, *, k=(2.0, 3.0), takes="u", middle="m", delivers="y", **kwargs):
    """Join two gains called first and second in series."""
    parts = [gain("first", k[0], takes, middle), gain("second", k[1], middle, delivers)]
    return join(parts, inputs=[takes], outputs=[delivers], **kwargs)


def function(formula):
    """What simulates nothing: the margin is a formula of the row."""
    return lambda table: pd.DataFrame({"spec": formula(table)}, index=table.index)
