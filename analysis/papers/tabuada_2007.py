"""Tabuada 2007, its linear example: what is quoted of it, and what of that holds."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure as MatplotlibFigure

from nlctl.papers import tabuada_2007 as printed

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

PLANT_MATRIX = np.array([[0.0, 1.0], [-2.0, 3.0]])
BK = np.array([[0.0], [1.0]]) @ np.array([[1.0, -4.0]])
LYAPUNOV_MATRIX = np.array([[1.0, 0.25], [0.25, 1.0]])
_Q = np.array([[0.5, 0.25], [0.25, 1.5]])
_SIGMA = 0.05  # up to here the decay of V is kept
_HORIZON = 15.0

_CASES = (
    PaperCase(
        key="1",
        make=printed.example_1,
        times=np.append(np.linspace(0, 1, 4001), np.linspace(1, _HORIZON, 2801)[1:]),
        start=printed.INITIAL_STATE,
    ),
)


def least_eigenvalue() -> float:
    """Return the least eigenvalue of Q."""
    return float(np.linalg.eigvalsh(_Q)[0])


def quoted_coupling() -> float:
    """Return |K^T B^T P + P B K|, which bounds the effect of an error in the direction of x."""
    return float(np.linalg.norm(BK.T @ LYAPUNOV_MATRIX + LYAPUNOV_MATRIX @ BK, 2))


def coupling() -> float:
    """Return the least b for which 2 x^T P B K e <= b |x| |e| for all x and e."""
    return 2 * float(np.linalg.norm(LYAPUNOV_MATRIX @ BK, 2))


def sampling_times(run: PaperRun) -> np.ndarray:
    """Return when samples were taken (s), the first one right behind the start."""
    rows = run.events
    return np.asarray(rows["time"][rows["block"] == "hold"])


def intervals(run: PaperRun) -> np.ndarray:
    """Return the times between samples (s)."""
    return np.diff(sampling_times(run))


def interval_bound(sigma: float) -> float:
    """Return the time below which no interval falls (s)."""
    return printed.least_interval(
        float(np.linalg.norm(PLANT_MATRIX + BK, 2)), float(np.linalg.norm(BK, 2)), sigma
    )


def energy_of_state(run: PaperRun) -> np.ndarray:
    """Return V = x^T P x along a run."""
    x = np.array([run["x1"], run["x2"]])
    return np.einsum("ik,ij,jk->k", x, LYAPUNOV_MATRIX, x)


def ratio(run: PaperRun) -> np.ndarray:
    """Return |e| / |x| along a run, behind the first sample."""
    x, w = (np.array([run[f"{name}1"], run[f"{name}2"]])[:, 1:] for name in "xw")
    return np.linalg.norm(w - x, axis=0) / np.linalg.norm(x, axis=0)


def _residual() -> float:
    """Return the largest entry of (A + BK)^T P + P (A + BK) + Q."""
    closed = PLANT_MATRIX + BK
    return float(np.abs(closed.T @ LYAPUNOV_MATRIX + LYAPUNOV_MATRIX @ closed + _Q).max())


def steepest(run: PaperRun) -> float:
    """Return the largest change of V from one output time to the next."""
    return float(np.diff(energy_of_state(run)[1:]).max())


_DECAY = "Does V fall along every solution while |e| ≤ 0.05 |x|?"


def _of_algebra() -> list[Statement]:
    say = partial(Statement, part="example-1", case="algebra", read="notes")
    return [
        say(
            claim="Is V = xᵀPx a Lyapunov function of the loop without sampling?",
            quantity="largest entry of (A + BK)ᵀP + P(A + BK) + Q",
            printed="0", tolerance=1e-12, value=lambda runs: _residual(),
        ),
        say(
            claim=_DECAY, quantity="λₘ(Q)", printed="0.44", relation="≥",
            value=lambda runs: least_eigenvalue(),
        ),
        say(
            claim="Is the quoted b the norm that it is defined as?",
            quantity="|KᵀBᵀP + PBK|", printed="8", tolerance=1e-12,
            value=lambda runs: quoted_coupling(),
        ),
        say(
            claim="Does that b bound the effect of e, V′ ≤ −a|x|² + b|x||e| for all x and e?",
            quantity="least b, 2 |PBK|", printed="8", relation="≤",
            value=lambda runs: coupling(), by="the article as quoted",
        ),
        say(
            claim=_DECAY, quantity="0.05 · 2 |PBK| / λₘ(Q)", printed="1", relation="≤", read="",
            value=lambda runs: _SIGMA * coupling() / least_eigenvalue(),
        ),
    ]  # fmt: skip


def _of_the_run() -> list[Statement]:
    say = partial(Statement, part="example-1", case=f"run of {_HORIZON:g} s, σ = 0.03")
    return [
        say(
            claim=_DECAY, quantity="largest change of V between outputs", printed="0",
            relation="≤", value=lambda runs: steepest(runs["1"]),
        ),
        say(
            claim="Is the error never larger than the rule allows?",
            quantity="max |e| / |x|", printed="0.03", relation="≤", tolerance=1e-6,
            value=lambda runs: float(ratio(runs["1"]).max()),
        ),
        say(
            claim="Is no interval between samples shorter than the bound of its differential "
            "equation?",
            quantity="least interval / bound", printed="1", relation="≥",
            value=lambda runs: float(intervals(runs["1"]).min() / interval_bound(0.03)),
        ),
    ]  # fmt: skip


def _states(runs: PaperRuns) -> MatplotlibFigure:
    """The states and the control input, which is held between samples."""
    run = runs["1"]
    t = run.time[1:]  # from the first sample on
    x_1, x_2, u = (run[name][1:] for name in ("x1", "x2", "u"))
    return rows_over_time({"state": {"$x_1$": (t, x_1), "$x_2$": (t, x_2)}, "$u$": {"u": (t, u)}})


def _errors(runs: PaperRuns) -> MatplotlibFigure:
    """The ratio |e| / |x|, a sawtooth below sigma, over the first half second."""
    t, y = runs["1"].time[1:], ratio(runs["1"])
    early = t <= 0.5
    signals = {"$|e|/|x|$": (t[early], y[early]), "rule": ([0.0, 0.5], [0.03, 0.03])}
    return rows_over_time({"$|e| / |x|$": signals})


def _gaps(runs: PaperRuns) -> MatplotlibFigure:
    """The intervals between samples, and the bound."""
    least = 1e3 * interval_bound(0.03)
    taken = (sampling_times(runs["1"])[1:], 1e3 * intervals(runs["1"]))
    signals = {
        "intervals": taken,
        "bound of the differential equation": ([0, _HORIZON], [least] * 2),
    }
    return rows_over_time({"interval (ms)": signals})


_MODEL = (
    Paragraph(text="The plant and its feedback, with the state held at its last sample:"),
    Equation(
        latex=r"\dot x = \left[\begin{matrix} 0 & 1 \\ -2 & 3 \end{matrix}\right] x"
        r" + \left[\begin{matrix} 0 \\ 1 \end{matrix}\right] u,\quad u = K (x + e),"
        r"\quad K = \left[\begin{matrix} 1 & -4 \end{matrix}\right]"
    ),
    Equation(
        latex=r"V = x^T P x,\quad P = \left[\begin{matrix} 1 & 1/4 \\ 1/4 & 1 \end{matrix}\right],"
        r"\quad Q = \left[\begin{matrix} 1/2 & 1/4 \\ 1/4 & 3/2 \end{matrix}\right]"
    ),
    Equation(latex=r"\dot V \le -a |x|^2 + b |x| |e|,\quad a = \lambda_m(Q),\quad"
             r" b = |K^T B^T P + P B K|"),
    Paragraph(
        text="A sample is taken where |e| reaches σ |x|, with σ below a / b. From a sample on "
        r"\(y = |e| / |x|\) grows no faster than \(\dot y = (1 + y)(|A + BK| + |BK| y)\): the time "
        "from 0 to σ is a lower bound of the intervals."
    ),
)  # fmt: skip

REPRODUCTION = Paper(
    key="tabuada_2007",
    title="Event-triggered sampling of a linear feedback, reproduced",
    question="does the linear example do what is quoted of it, and which constants are right?",
    citation=(
        "P. Tabuada: Event-triggered real-time scheduling of stabilizing control tasks. IEEE "
        "Transactions on Automatic Control 52(9), 2007, pp. 1680–1685. "
        "doi 10.1109/TAC.2007.904277."
    ),
    model=_MODEL,
    parts=(
        Part(
            key="example-1",
            title="The linear example",
            make=printed.example_1,
            blocks=("plant", "rule"),
            figures=(
                PaperFigure(
                    key="example-1-states", draw=_states,
                    caption="States, and the control input that is held between samples.",
                ),
                PaperFigure(
                    key="example-1-error", draw=_errors,
                    caption="The error as a part of the state: it falls to 0 at every sample.",
                ),
                PaperFigure(
                    key="example-1-intervals", draw=_gaps,
                    caption="Intervals between samples, and the bound that none undercuts.",
                ),
            ),
            parameters=(
                ("A, second row", "−2, 3", "{plant.A[1][0]:g}, {plant.A[1][1]:g}", ""),
                ("K", "1, −4", "{rule.K[0]:g}, {rule.K[1]:g}", ""),
                (
                    "σ", "0.03", "{rule.sigma:g}",
                    "below the bound 0.05 that keeps V falling; quoted as a choice",
                ),
                ("x(0)", "not read", "(0.5, 0.5)", "of the program in the notes"),
            ),
        ),
    ),
    cases=_CASES,
    statements=(*_of_algebra(), *_of_the_run()),
    reproduced="Lyapunov equation, constants, decay, and the bound on intervals of its example",
    not_reproduced=(
        "the inequality with the quoted b = 8, which needs 8.5 (σ = 0.05 is still small enough); "
        "delays of the task; the article's figures, which could not be read."
    ),
    sources=(
        PaperSource(
            key="notes",
            text="A reader's notes on the article in a public repository (in Chinese, dated "
            "2023-07-20, “Paper 1: Event-Triggered Real-Time Scheduling of Stabilizing Control "
            "Tasks, 2007, TAC”): plant, K, P, Q, a > 0.44, b = 8, the bound 0.05 and σ′ = 0.03, "
            "and a program that starts from (0.5, 0.5).",
        ),
        PaperSource(
            key="etctime",
            text="The test program of a toolbox for event-triggered control, which has the same "
            "plant, K and P as those of Heemels, Donkers and Teel (2013).",
        ),
    ),
    open_points=(
        "The article itself could not be read: every printed number is one that the notes quote.",
        "b = |KᵀBᵀP + PBK| = 8 is the norm of a symmetric matrix and bounds the effect of an "
        "error in the direction of x. For any e and x the term is 2 xᵀPBKe, and the least b is "
        "2 |PBK| = 8.5. The conclusion stands: 0.05 · 8.5 = 0.425 is below λₘ(Q) = 0.441.",
        "A printed value of the shortest interval was not found. The bound here is the closed "
        "form of the differential equation, 17.6 ms at σ = 0.03 and 28.4 ms at σ = 0.05.",
        "The article's theorem allows a delay between sample and input; here there is none.",
    ),
    methods=(
        "Plant, rule and hold are blocks of python-control; samples are events that both engines "
        "locate. Norms and eigenvalues are NumPy's.",
    ),
    limits=(
        "A run from one start shows nothing of others; the decay of V and the bound on intervals "
        "are proved by the inequalities, not by the run.",
    ),
    lead=PaperFigure(
        key="lead", draw=_gaps,
        caption="No interval between samples is shorter than the bound.",
    ),
)  # fmt: skip
