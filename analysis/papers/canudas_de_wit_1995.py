"""Canudas de Wit et al. 1995, the LuGre model: its figures against a reconstruction of them."""

from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure as MatplotlibFigure

from nlctl.papers import canudas_de_wit_1995 as printed

from ..report.document import Equation, Paragraph
from ..reproductions.figures import paths_figure, rows_over_time
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

_F_S, _SIGMA_0, _PUSH = 1.5, 1e5, 1.425
_TIGHT: dict[str, Any] = {"rtol": 1e-8, "atol": 1e-12}

# as read off the reconstructed Fig. 4: rate of the force (N/s), force of break-away (N)
_BREAK_AWAY = {1.0: 1.425, 5.0: 1.307, 10.0: 1.212, 20.0: 1.090, 30.0: 1.012}
# as read off the reconstructed Fig. 3: frequency (rad/s), largest friction (N)
_LARGEST = {1.0: 1.389, 10.0: 1.378, 25.0: 1.346}
# as read off the reconstructed Fig. 8: extremes of the position (m), one after the other
_EXTREMES = (1.50, 0.765, 1.115, 0.925)


def _presliding() -> PaperCase:
    times = np.linspace(0, 60, 6001)
    push = _PUSH * np.interp(times, [0, 10, 15, 35, 40, 60], [0, 1, 1, -1, -1, 1])
    return PaperCase(key="presliding", make=printed.example_1, times=times, inputs=push, **_TIGHT)


def _ramp(rate: float) -> PaperCase:
    times = np.linspace(0, 2 / rate, 20_001)
    return PaperCase(
        key=f"ramp {rate:g}", make=printed.example_1, times=times, inputs=rate * times, **_TIGHT
    )


def _lag(omega: float) -> PaperCase:
    times = np.linspace(0, 5 + 2 * np.pi / omega, 40_001)
    make = partial(printed.example_2, omega=omega)
    return PaperCase(key=f"lag {omega:g}", make=make, times=times, rtol=1e-9, atol=1e-13)


_CASES = (
    _presliding(),
    *map(_ramp, _BREAK_AWAY),
    *map(_lag, _LARGEST),
    PaperCase(
        key="stick-slip", make=printed.example_3, times=np.linspace(0, 30, 15_001), **_TIGHT
    ),
    PaperCase(key="hunting", make=printed.example_4, times=np.linspace(0, 100, 20_001), **_TIGHT),
)  # fmt: skip


def position_at(run: PaperRun, time: float) -> float:
    """Return the displacement at a time, in micrometres."""
    return 1e6 * float(np.interp(time, run.time, run["position"]))


def break_away(run: PaperRun) -> float:
    """Return the friction from which it falls for the first time (N)."""
    force = run["force"]
    return float(force[np.argmax(np.diff(force) < 0)])


def last_period(run: PaperRun) -> tuple[np.ndarray, np.ndarray]:
    """Return velocity (m/s) and friction (N) over the last period of a lag."""
    late = run.time >= 5.0
    return run["velocity"][late], run["force"][late]


def width_at(run: PaperRun, velocity: float = 1e-3) -> float:
    """Return by how much friction is larger while the velocity rises (N)."""
    v, force = last_period(run)
    rising = np.gradient(v) > 0
    order = np.argsort(v[rising]), np.argsort(v[~rising])
    up = np.interp(velocity, v[rising][order[0]], force[rising][order[0]])
    down = np.interp(velocity, v[~rising][order[1]], force[~rising][order[1]])
    return float(up - down)


def slips(run: PaperRun) -> np.ndarray:
    """Return when slips begin (s)."""
    v = run["velocity"]
    return run.time[1:][(v[:-1] < 0.02) & (v[1:] >= 0.02)]


def resting_places(run: PaperRun) -> np.ndarray:
    """Return the positions in which the mass rests (m), one after the other."""
    x, v = run["position"], run["velocity"]
    moving = np.abs(v) > 1e-3
    stops = np.nonzero(moving[:-1] & ~moving[1:])[0]
    return x[stops + 1]


def rises(run: PaperRun) -> np.ndarray:
    """Return when the position rises through 1 m (s)."""
    x = run["position"]
    return run.time[1:][(x[:-1] < 1) & (x[1:] >= 1)]


def _on_figure_2_and_4() -> list[Statement]:
    say = partial(Statement, part="example-1")
    slide = partial(
        say, claim="Fig. 2: how far does a mass move before it slides?", case="up to ±1.425 N"
    )
    away = partial(say, claim="Fig. 4: at which force does it break away?")
    return [
        slide(
            quantity="displacement at 1.425 N (µm)", printed="45", tolerance=0.5, read="figure",
            value=lambda runs: position_at(runs["presliding"], 15.0),
        ),
        slide(
            quantity="displacement at −1.425 N (µm)", printed="-10", tolerance=0.5, read="figure",
            value=lambda runs: position_at(runs["presliding"], 40.0),
        ),
        slide(
            quantity="to the closed form of a slow push, (F_s/σ₀) ln 20 (µm)",
            printed=f"{1e6 * _F_S / _SIGMA_0 * np.log(20):.2f}", tolerance=0.5,
            value=lambda runs: position_at(runs["presliding"], 10.0),
        ),
        say(
            claim="Fig. 2: is the loop closed?", case="up to ±1.425 N",
            quantity="displacement at 60 s less that at 15 s (µm)", printed="0", tolerance=0.5,
            value=lambda runs: position_at(runs["presliding"], 60.0)
            - position_at(runs["presliding"], 15.0),
        ),
        *(
            away(
                case=f"{rate:g} N/s", quantity="force of break-away (N)", printed=f"{force:g}",
                tolerance=0.015, read="figure",
                value=lambda runs, rate=rate: break_away(runs[f"ramp {rate:g}"]),
            )
            for rate, force in _BREAK_AWAY.items()
        ),
    ]  # fmt: skip


def _on_figure_3() -> list[Statement]:
    say = partial(Statement, part="example-2")
    claim = "Fig. 3: does friction lag behind the velocity, by more when it varies faster?"
    return [
        *(
            say(
                claim=claim, case=f"{omega:g} rad/s", quantity="largest friction (N)",
                printed=f"{force:g}", tolerance=0.005, read="figure",
                value=lambda runs, omega=omega: float(last_period(runs[f"lag {omega:g}"])[1].max()),
            )
            for omega, force in _LARGEST.items()
        ),
        *(
            say(
                claim=claim, case=f"{slow:g} and {fast:g} rad/s",
                quantity="width of the loops at 1 mm/s, slow / fast", printed="1", relation="≤",
                value=lambda runs, slow=slow, fast=fast: width_at(runs[f"lag {slow:g}"])
                / width_at(runs[f"lag {fast:g}"]),
            )
            for slow, fast in ((1.0, 10.0), (10.0, 25.0))
        ),
    ]  # fmt: skip


def _on_figure_6() -> list[Statement]:
    say = partial(
        Statement, part="example-3", case="pulled at 0.1 m/s", read="figure",
        claim="Fig. 6: does a mass stick and slip that a spring pulls?",
    )  # fmt: skip
    return [
        say(
            quantity="first slip at (s)", printed="7.45", tolerance=0.1,
            value=lambda runs: float(slips(runs["stick-slip"])[0]),
        ),
        say(
            quantity="time between slips (s)", printed="6.37", tolerance=0.1,
            value=lambda runs: float(np.diff(slips(runs["stick-slip"])).mean()),
        ),
        say(
            quantity="position between the first slips (m)", printed="0.64", tolerance=0.02,
            value=lambda runs: 1e-6 * position_at(runs["stick-slip"], 12.0),
        ),
        say(
            quantity="largest friction (N)", printed="1.48", tolerance=0.01,
            value=lambda runs: float(runs["stick-slip"]["force"].max()),
        ),
        say(
            quantity="largest velocity (m/s)", printed="0.37", tolerance=0.02,
            value=lambda runs: float(runs["stick-slip"]["velocity"].max()),
        ),
    ]  # fmt: skip


def _on_figure_8() -> list[Statement]:
    say = partial(
        Statement, part="example-4", case="PID to 1 m", read="figure",
        claim="Fig. 8: does the integral make it hunt?",
    )  # fmt: skip
    return [
        *(
            say(
                quantity=f"rest {i + 1} (m)", printed=f"{place:g}", tolerance=0.01,
                value=lambda runs, i=i: float(resting_places(runs["hunting"])[i]),
            )
            for i, place in enumerate(_EXTREMES)
        ),
        say(
            quantity="amplitude of the limit cycle (m)", printed="0.064", tolerance=0.005,
            value=lambda runs: float(np.ptp(resting_places(runs["hunting"])[-2:]) / 2),
        ),
        say(
            quantity="period of the limit cycle (s)", printed="24.4", tolerance=0.5,
            value=lambda runs: float(np.diff(rises(runs["hunting"]))[-1]),
        ),
    ]  # fmt: skip


def _draw_presliding(runs: PaperRuns) -> MatplotlibFigure:
    """Friction over displacement before sliding."""
    run = runs["presliding"]
    path = {"friction": (1e6 * run["position"], run["force"])}
    return paths_figure(path, "displacement (µm)", "friction (N)")


def _draw_away(runs: PaperRuns) -> MatplotlibFigure:
    """The force of break-away over the rate of the force."""
    rates = list(_BREAK_AWAY)
    paths = {
        "here": (rates, [break_away(runs[f"ramp {rate:g}"]) for rate in rates]),
        "as read": (rates, list(_BREAK_AWAY.values())),
    }
    return paths_figure(paths, "rate of the force (N/s)", "force of break-away (N)")


def _draw_lag(runs: PaperRuns) -> MatplotlibFigure:
    """Friction over velocity at three frequencies."""
    paths = {}
    for omega in _LARGEST:
        v, force = last_period(runs[f"lag {omega:g}"])
        paths[f"{omega:g} rad/s"] = (1e3 * v, force)
    return paths_figure(paths, "velocity (mm/s)", "friction (N)")


def _draw_stick_slip(runs: PaperRuns) -> MatplotlibFigure:
    """Position and the end of the spring, friction, velocity."""
    run = runs["stick-slip"]
    t = run.time
    return rows_over_time(
        {
            "position (m)": {"mass": (t, run["position"]), "end of the spring": (t, 0.1 * t)},
            "friction (N)": {"friction": (t, run["force"])},
            "velocity (m/s)": {"velocity": (t, run["velocity"])},
        }
    )


def _draw_hunting(runs: PaperRuns) -> MatplotlibFigure:
    """The position under PID control, and the force."""
    run = runs["hunting"]
    t = run.time
    return rows_over_time(
        {
            "position (m)": {"mass": (t, run["position"]), "wanted": ([0.0, 100.0], [1.0, 1.0])},
            "force (N)": {"applied": (t, run["applied"])},
        }
    )


_MODEL = (
    Paragraph(text="Bristles that bend and slip, at the relative velocity v:"),
    Equation(
        latex=r"\dot z = v - \frac{|v|}{g(v)} z,\quad"
        r" \sigma_0 g(v) = F_C + (F_S - F_C) e^{-(v / v_s)^2},\quad"
        r" F = \sigma_0 z + \sigma_1 \dot z + \sigma_2 v"
    ),
    Paragraph(text="A mass of 1 kg is pushed, pulled by a spring, or moved to a position:"),
    Equation(latex=r"\ddot x = u - F,\quad u = -K_v \dot x - K_p (x - x_d) - K_i \int (x - x_d)"),
)
_TABLE_I = (
    ("σ₀", "10⁵ N/m", "{friction.sigma_0:g}", "Table I"),
    ("σ₁", "√10⁵ N s/m", "{friction.sigma_1:.5g}", "Table I"),
    ("σ₂", "0.4 N s/m", "{friction.sigma_2:g}", "Table I"),
    ("F_C, F_S", "1 N, 1.5 N", "{friction.F_c:g}, {friction.F_s:g}", "Table I"),
    ("v_s", "0.001 m/s", "{friction.v_s:g}", "Table I"),
)

REPRODUCTION = Paper(
    key="canudas_de_wit_1995",
    title="The LuGre model of friction, reproduced",
    question="does the model show what its figures show, with the parameters of its Table I?",
    citation=(
        "C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky: A new model for control of "
        "systems with friction. IEEE Transactions on Automatic Control 40(3), 1995, pp. 419–425. "
        "doi 10.1109/9.376053."
    ),
    model=_MODEL,
    parts=(
        Part(
            key="example-1",
            title="A mass that is pushed: presliding and break-away (Figs. 2 and 4)",
            make=printed.example_1,
            blocks=("mass", "friction"),
            figures=(
                PaperFigure(
                    key="example-1-presliding", draw=_draw_presliding,
                    caption="Fig. 2: below the static friction the mass moves by micrometres.",
                ),
                PaperFigure(
                    key="example-1-break-away", draw=_draw_away,
                    caption="Fig. 4: the faster the force rises, the earlier the mass slides.",
                ),
            ),
            parameters=(*_TABLE_I, ("mass", "unit", "1", "in kg"),
                        ("largest push", "1.425 N, 95 % of F_S", "1.425", "")),
        ),
        Part(
            key="example-2",
            title="Friction behind a velocity that varies (Fig. 3)",
            make=printed.example_2,
            blocks=("motion",),
            figures=(
                PaperFigure(
                    key="example-2-lag", draw=_draw_lag,
                    caption="Fig. 3: friction is larger while the velocity rises.",
                ),
            ),
            parameters=(
                ("velocity", "10⁻³ (cos ωt + 1.5) m/s", "{motion.amplitudes[1]:g} (cos ωt + 1.5)",
                 "of the program; the article says around an equilibrium"),
                ("ω", "1, 10, 25 rad/s", "1, 10, 25", ""),
            ),
        ),
        Part(
            key="example-3",
            title="A mass that a spring pulls: stick and slip (Fig. 6)",
            make=printed.example_3,
            blocks=("end", "spring"),
            figures=(
                PaperFigure(
                    key="example-3-stick-slip", draw=_draw_stick_slip,
                    caption="Fig. 6: it sticks until the spring is strong enough, and slips.",
                ),
            ),
            parameters=(
                ("stiffness", "2 N/m", "{spring.D[0][0]:g}", ""),
                ("velocity of the end", "0.1 m/s", "0.1", ""),
            ),
        ),
        Part(
            key="example-4",
            title="A mass under PID control: hunting (Fig. 8)",
            make=printed.example_4,
            blocks=("control",),
            figures=(
                PaperFigure(
                    key="example-4-hunting", draw=_draw_hunting,
                    caption="Fig. 8: the integral grows while the mass sticks, and it never rests.",
                ),
            ),
            parameters=(
                ("K_v, K_p", "6, 3", "{control.K_v:g}, {control.K_p:g}", ""),
                ("K_i", "4", "{control.K_i:g}", ""),
                ("x_d", "1 m", "1", ""),
            ),
        ),
    ),
    cases=_CASES,
    statements=(*_on_figure_2_and_4(), *_on_figure_3(), *_on_figure_6(), *_on_figure_8()),
    reproduced="Figs. 2, 3, 4, 6 and 8: presliding, lag, break-away, stick-slip, hunting",
    not_reproduced=(
        "the article's own pictures, which could not be read (numbers are read off a "
        "reconstruction); Figs. 5 and 7; the friction observer."
    ),
    sources=(
        PaperSource(
            key="figure",
            text="Pictures of the repository auralius/LuGre (commit 1b72c62, 2023-02-14), which "
            "calls itself a full reconstruction of the article and says which picture is which "
            "figure; read off by eye, to about a pixel.",
        ),
        PaperSource(
            key="program",
            text="The MATLAB programs of that repository: Table I, unit mass, spring, gains of the "
            "PID controller, and what the article says of how each figure was made.",
        ),
    ),
    open_points=(
        "The article itself could not be read. All values are those of a program that "
        "reconstructs it, and all numbers are read off its pictures: a pixel is 0.003 N or 0.2 s.",
        "Forces of break-away are 0.006 N to 0.013 N larger here. The program takes the sample "
        "behind the peak, of a run with a relative tolerance of 10⁻³; here it is the peak.",
        "Above 30 N/s the picture does not fall any more. There the friction of break-away is "
        "below that of sliding, so that its first fall says nothing: it is not compared.",
        "The article determines break-away by a sharp increase of the velocity, the program by "
        "the first fall of the force; these are not the same number.",
    ),
    methods=(
        "Every run is one of the block nlctl.actuators.LuGre with the parameters of Table I, in "
        "machine code; steps end where the velocity reverses.",
    ),
    limits=(
        "The model's behaviour is reproduced, not that of friction: nothing here was measured.",
    ),
    lead=PaperFigure(
        key="lead", draw=_draw_hunting,
        caption="Under PID control the mass hunts about the position that is wanted.",
    ),
)  # fmt: skip
