"""The picture of a block: its symbol, and what follows from its defaults.

A block with one input and one output shows its characteristic where it has no state or a memory,
and else its response to a square wave; a block without inputs shows its outputs over time.
"""

import control as ct
import numpy as np
from matplotlib.figure import Figure

import nlctl
from nlctl.errors import DivergedError
from nlctl.params import equation_arguments

INK, LINE = "#1b2733", "#0072B2"
WIDE, FLAT = (4.4, 2.9), (6.4, 2.4)
CYCLES = 3.0  # of the input of a characteristic: memories forget how they started


def draw_made(made):
    """Draw a diagram that a function makes."""
    return nlctl.draw(made)


def draw_block(block):
    """Draw the characteristic or response, else the symbol."""
    if getattr(block, "isdtime", lambda **_: False)(strict=True):
        return symbol(block)
    if block.ninputs == 0:
        return over_time(block, np.linspace(0, 20, 801), None)
    if (block.ninputs, block.noutputs) != (1, 1):
        return symbol(block)
    static = block.nstates == 0 and not is_supplied(block)
    if is_memory(block) or static or block.input_labels == ["velocity"]:
        return characteristic(block)
    try:
        return over_time(block, *square(block))
    except DivergedError:  # it is made for inputs that come back
        return symbol(block)


def symbol(block):
    """Draw the box with its inputs and outputs."""
    alone = ct.interconnect([block], inputs=block.input_labels, outputs=block.output_labels)
    return nlctl.draw(alone)


def is_memory(block):
    """Whether its states move when a step is accepted, and not by a rate."""
    return hasattr(block.spec, "commit")


def is_supplied(block):
    """Whether its output follows from a whole run only."""
    return getattr(block.spec, "supplied", None) is not None


def characteristic(block):
    """Draw the output over an input that goes up and down with falling height."""
    t, reach = np.linspace(0, CYCLES, 2401), 2.0
    u = reach * (1 - 0.25 * np.floor(t)) * np.sin(2 * np.pi * t)
    if block.nstates == 0:
        reach = 2 * corner(block) or reach
        u = np.linspace(-reach, reach, 801)
        v = np.array([block.output(0.0, [], [each])[0] for each in u])
    else:
        v = nlctl.input_output_response(block, t, u).outputs
    figure, ax = axes(WIDE)
    ax.plot(u, broken(u, v), color=LINE, linewidth=1.6)
    ax.set_xlabel(block.input_labels[0])
    ax.set_ylabel(block.output_labels[0])
    return figure


def corner(block):
    """Return the input at the outermost corner of a static characteristic, 0 without one."""
    switching = getattr(block.spec, "switching", None)
    if switching is None:
        return 0.0
    p, u = equation_arguments(block.spec), np.linspace(-100, 100, 20001)
    signs = np.sign([np.atleast_1d(switching(0.0, (), (each,), p)) for each in u])
    changes = np.abs(u[:-1][(signs[1:] != signs[:-1]).any(axis=1)])
    return 0.0 if len(changes) > 9 else changes.max(initial=0.0)  # steps without end: any will do


def broken(u, v):
    """Return samples with a gap where the output jumps."""
    v = np.array(v, dtype=float)
    steps = np.abs(np.diff(v))
    jumps = steps > 8 * np.abs(np.diff(u)).max() * max(1.0, np.quantile(steps, 0.9) / 0.02)
    v[1:][jumps] = np.nan
    return v


def square(block):
    """Return times and a square wave that is as slow as the block needs."""
    for horizon in (0.1, 1.0, 10.0):
        t = np.linspace(0, horizon, 801)
        u = np.where(t < 0.05 * horizon, 0.0, np.where(t < 0.55 * horizon, 1.0, -1.0))
        v = nlctl.input_output_response(block, t, u).outputs
        moved = np.abs(np.diff(v[np.searchsorted(t, [0.45 * horizon, 0.54 * horizon])]))[0]
        if moved < 0.02 * np.ptp(v):
            break
    return t, u


def over_time(block, t, u):
    """Draw the outputs over time, with the input if there is one."""
    run = nlctl.input_output_response(block, t, *([] if u is None else [u]))
    figure, ax = axes(FLAT)
    if u is not None:
        ax.plot(t, u, color="0.6", linewidth=1.2, label=block.input_labels[0])
    styles = ("-", "--", "-.", ":")
    for i, name in enumerate(block.output_labels):
        ax.plot(t, np.atleast_2d(run.y)[i], styles[i % 4], linewidth=1.5, label=name)
    ax.set_xlabel("time (s)")
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def axes(size):
    """Return an empty figure with quiet axes."""
    figure = Figure(figsize=size, layout="constrained")
    ax = figure.add_subplot()
    ax.axhline(0, color="0.85", linewidth=0.8, zorder=0)
    ax.axvline(0, color="0.85", linewidth=0.8, zorder=0)
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(colors=INK, labelsize=9)
    return figure, ax
