"""Chowdhary and Johnson 2010, their uncertain pendulum: what the author's program shows."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure as MatplotlibFigure
from scipy.linalg import solve_continuous_lyapunov

from nlctl.papers import chowdhary_2010 as printed

from ..report.document import Equation, Paragraph
from ..reproductions.figures import rows_over_time
from ..reproductions.paper import (
    Paper,
    PaperCase,
    PaperFigure,
    PaperRun,
    PaperRuns,
    PaperSource,
    Part,
    Statement,
)

_TIMES = np.linspace(0, 40, 4001)
W, _GAMMA = (-1.0, 1.0, 0.5), 3.5
_P = solve_continuous_lyapunov(np.array([[0.0, 1.0], [-1.5, -1.3]]).T, -np.eye(2))

_CASES = (
    PaperCase(key="with", make=printed.example_1, times=_TIMES, start=printed.INITIAL_STATE),
    PaperCase(
        key="without",
        make=partial(printed.example_1, concurrent=False),
        times=_TIMES,
        start=printed.INITIAL_STATE,
    ),
)


def weights(run: PaperRun) -> np.ndarray:
    """Return the estimates, one row a weight."""
    return np.array([run[f"weights.W_hat[{i}]"] for i in range(3)])


def farthest(run: PaperRun) -> float:
    """Return the largest error of a weight at the end."""
    return float(np.abs(weights(run)[:, -1] - W).max())


def record_matrix(run: PaperRun) -> np.ndarray:
    """Return the sum of psi psi^T over the recorded points."""
    return np.array([[run[f"stack.Omega[{i},{j}]"][-1] for j in range(3)] for i in range(3)])


def largest_error(run: PaperRun, start: float = 0.0) -> float:
    """Return max |e| from a time on."""
    return float(np.abs(run["e"][run.time >= start]).max())


def lyapunov_function(run: PaperRun) -> np.ndarray:
    """Return V = E^T P E + |W_hat - W|^2 / Gamma along a run."""
    E = np.array([run[f"plant.x{i}"] - run[f"model.xm{i}"] for i in (1, 2)])
    off = weights(run) - np.array(W)[:, None]
    return np.einsum("ik,ij,jk->k", E, _P, E) + np.sum(off**2, axis=0) / _GAMMA


def decay_rate(run: PaperRun) -> float:
    """Return the rate of V that Q and the record imply (1/s)."""
    of_state = 1.0 / np.linalg.eigvalsh(_P)[-1]
    return float(min(of_state, 2 * _GAMMA * np.linalg.eigvalsh(record_matrix(run))[0]))


def above_bound(run: PaperRun) -> float:
    """Return the largest V over its bound, 1 s to 12 s; the bound begins with V at 0.5 s."""
    V, rate = lyapunov_function(run), decay_rate(run)
    begin = int(np.argmax(run.time >= 0.5))  # all points are recorded
    bound = V[begin] * np.exp(-rate * (run.time - run.time[begin]))
    shown = (run.time >= 1.0) & (run.time <= 12.0)
    return float((V[shown] / bound[shown]).max())


def _statements() -> list[Statement]:
    """Return what the program has, and what the authors say of it."""
    say = partial(Statement, part="example-1")
    recorded, other = "with recorded points", "without"
    converge = "Do the weights come to their true values although nothing is excited?"
    return [
        *(
            say(
                claim=converge, case=recorded, quantity=f"W_{i} at 40 s", printed=f"{value:g}",
                tolerance=1e-3, read="program",
                value=lambda runs, i=i: float(weights(runs["with"])[i, -1]),
            )
            for i, value in enumerate(W)
        ),
        say(
            claim="Are as many recorded points independent as there are weights?", case=recorded,
            quantity="rank of Ω", printed="3", read="abstract",
            value=lambda runs: float(np.linalg.matrix_rank(record_matrix(runs["with"]))),
        ),
        say(
            claim="Without a record, do the weights miss them?", case=other,
            quantity="largest error of a weight at 40 s", printed="0.1", relation="≥",
            value=lambda runs: farthest(runs["without"]),
        ),
        say(
            claim="Does the tracking error tend to 0?", case=recorded,
            quantity="max |e| for t ≥ 35 s",
            printed="0.001", relation="≤", read="abstract",
            value=lambda runs: largest_error(runs["with"], 35.0),
        ),
        say(
            claim="Is the transient smaller with a record?", case="both",
            quantity="max |e| with / without", printed="1", relation="≤",
            value=lambda runs: largest_error(runs["with"]) / largest_error(runs["without"]),
        ),
        say(
            claim="Do errors decay exponentially, as fast as the record says?",
            case=recorded, quantity="V / its bound, 1 s to 12 s", printed="1", relation="≤",
            read="abstract", value=lambda runs: above_bound(runs["with"]),
        ),
    ]  # fmt: skip


def _tracked(runs: PaperRuns) -> MatplotlibFigure:
    """The angle and its model, and the errors of both laws."""
    recorded, other = runs["with"], runs["without"]
    angles = {"model": (_TIMES, recorded["xm1"]), "plant": (_TIMES, recorded["y"])}
    return rows_over_time(
        {
            "$x_1$": angles,
            "$e$": {"with a record": (_TIMES, recorded["e"]), "without": (_TIMES, other["e"])},
        }
    )


def _learned(runs: PaperRuns) -> MatplotlibFigure:
    """The weights of both laws, and the true ones."""
    rows = {}
    for key, label in (("with", "with a record"), ("without", "without")):
        names = [rf"$\hat W_{i}$" for i in range(3)]
        estimates = zip(names, weights(runs[key]), strict=True)
        rows[label] = {name: (_TIMES, values) for name, values in estimates}
    figure = rows_over_time(rows)
    for ax in figure.axes:
        for value in W:
            ax.axhline(value, color="#6b7280", linewidth=0.8, linestyle=":")
    return figure


_MODEL = (
    Paragraph(text="A plant like an inverted pendulum, and a model that it shall follow:"),
    Equation(
        latex=r"\ddot x = \delta - \sin(\pi x) + |\dot x| \dot x"
        r" + \frac{1}{2} \exp(-x \dot x),\quad \ddot x_m = r - x_m - 2 \dot x_m"
    ),
    Paragraph(text="Weights learn from the present error, and from those at recorded points:"),
    Equation(
        latex=r"\dot{\hat W} = \Gamma \left( \psi(x) b^T P (x - x_m)"
        r" - \sum_j \psi_j (\hat W^T \psi_j - \Delta_j) \right),\quad"
        r" \Omega = \sum_j \psi_j \psi_j^T"
    ),
    Equation(
        latex=r"V = E^T P E + \frac{1}{\Gamma} |\hat W - W|^2,\quad"
        r" \dot V = -E^T Q E - 2 (\hat W - W)^T \Omega (\hat W - W)"
    ),
)

REPRODUCTION = Paper(
    key="chowdhary_2010",
    title="Concurrent learning without persistent excitation, reproduced",
    question="do weights that learn from recorded points come to their true values?",
    citation=(
        "G. Chowdhary, E. Johnson: Concurrent learning for convergence in adaptive control without "
        "persistency of excitation. 49th IEEE Conference on Decision and Control, 2010, p. 3674."
    ),
    model=_MODEL,
    parts=(
        Part(
            key="example-1",
            title="The uncertain pendulum",
            make=printed.example_1,
            blocks=("plant", "basis", "law"),
            figures=(
                PaperFigure(
                    key="example-1-weights", draw=_learned,
                    caption="Weights with and without a record; dotted, the true ones.",
                ),
                PaperFigure(
                    key="example-1-tracking", draw=_tracked,
                    caption="The angle follows its model; the error with and without a record.",
                ),
            ),
            parameters=(
                ("W", "−1, 1, 0.5", "{plant.W[0]:g}, {plant.W[1]:g}, {plant.W[2]:g}", ""),
                ("x(0)", "(1, 1)", "({plant.initial[x1]:g}, {plant.initial[x2]:g})", ""),
                ("K_p, K_d", "1.5, 1.3", "{error.K[0]:g}, {error.K[1]:g}", ""),
                ("Q", "identity", "diag({error.Q[0]:g}, {error.Q[1]:g})", ""),
                ("Γ, present and recorded", "3.5, 3.5", "{weights.Gamma:g}", "one gain for both"),
                ("ω, ζ of the model", "1, 1", "a = ({model.a[0]:g}, {model.a[1]:g})", ""),
                ("novelty of a point", "0.2", "0.2", "of |ψ|"),
                ("points", "by a rule of rank", "5", "the rule stops there, too"),
                ("step", "0.01 s, Euler for Ŵ", "exact events; points every 0.01 s", ""),
            ),
        ),
    ),
    cases=_CASES,
    statements=tuple(_statements()),
    reproduced="weights with and without a record, on the first author's uncertain pendulum",
    not_reproduced=(
        "the article's figures, which could not be read; its rule that trains on present data "
        "first; recorded points by the rule of rank; only their number is used."
    ),
    sources=(
        PaperSource(
            key="program",
            text="G. Chowdhary's program “inverted pendulum like system simulation with structured "
            "uncertainty”, last modified 2010-11-16, with its function inv_pendu, in a public "
            "repository; it refers to the article.",
        ),
        PaperSource(
            key="abstract",
            text="The abstracts of “Adaptive flight control with guaranteed convergence” and of "
            "“Exponential parameter and tracking error convergence guarantees for adaptive "
            "controllers without persistency of excitation” by the same authors.",
        ),
    ),
    open_points=(
        "The article itself could not be read: all values are those of the author's program.",
        "The program stops recording by a rule of rank and of a determinant, in which the "
        "candidate counts. A transcription of it records 5 points within 0.2 s; here their number "
        "is given.",
        "The program integrates weights by Euler's method and holds the input for 10 ms; here "
        "all but the record is in continuous time. Its largest error is therefore another one.",
        "The projection that trains on present data first is switched off in the program, and "
        "not implemented here.",
    ),
    methods=(
        "Blocks of nlctl: the record is a program in discrete time, the weights are continuous. "
        "The acceleration is measured, as in the program.",
    ),
    limits=("One run from one start; there is no noise on the acceleration.",),
    lead=PaperFigure(
        key="lead", draw=_learned,
        caption="With a record the weights come to their true values (dotted).",
    ),
)  # fmt: skip
