"""Lv et al. 2017 as a record: what its page has in common with that of every paper."""

from collections.abc import Callable

from nlctl import paper
from nlctl.faults import NEVER, Fault, with_faults

from ...report.document import History, Paragraph
from ...reproductions.paper import MovedLoop, Paper, PaperFigure, PaperRun, Part
from .. import BOUND, CASES, HORIZON, TAIL, expectations
from .. import figures as histories
from ..reproduction import expected_statement
from . import text as text

_PLOTS = (
    ("tracking", histories.tracking, r"Output \(y\) and reference \(y_d\)."),
    ("input", histories.control_input, r"Control input \(u\), and output \(v\) of the actuator."),
    (
        "error",
        histories.tracking_error,
        r"Tracking error \(e_1\); it stays in the band for "
        f"t ≥ {TAIL:g} s.",
    ),
    ("states", histories.upper_states, "The other states of the plant."),
    (
        "actuator",
        histories.actuator_path,
        "The part of the actuator's characteristic that is used.",
    ),
    (
        "nussbaum",
        histories.nussbaum_gain,
        r"Argument \(\zeta\) and value \(N(\zeta)\) of the Nussbaum gain.",
    ),
    (
        "adaptation",
        histories.adaptation,
        r"Norm of the weights \(\hat W\), and estimate \(\hat\delta\) of the robust term.",
    ),
)
_MOVED = {  # what |u| stays below without a fault, and sliders of the actuator
    1: (15.0, ("actuator.b_r", "actuator.b_l", "plant.p1=-1:1")),
    2: (5.0, ("actuator.c_r", "actuator.c_l", "plant.a")),
}
_SHOWN = ("tracking", "input")  # the other figures are folded


def _part(number: int) -> Part:
    key = f"example-{number}"
    return Part(
        key=key,
        title=text.TITLES[number],
        make=paper.EXAMPLES[f"example_{number}"],
        blocks=("plant", "actuator"),
        number=f"Ex. {number}",
        picture="The closed loop as simulated, and the inside of its controller.",
        figures=tuple(_figure(number, *plot) for plot in _PLOTS),
        more="The other signals over time, and the actuator's characteristic",
        parameters=text.PRINTED[number],
        items=lambda runs: [_interactive(number, runs[str(number)])],
        moved=_moved(number),
    )


def _moved(number: int) -> MovedLoop:
    """Return an example whose actuator may lose nine tenths of its gain."""
    (most, sliders), make = _MOVED[number], paper.EXAMPLES[f"example_{number}"]
    return MovedLoop(
        make=lambda: with_faults(make(), Fault("actuator.v", "gain", 0.1, at=NEVER)),
        call=f"nlctl.with_faults(nlctl.paper.example_{number}(), "
        'nlctl.Fault("actuator.v", "gain", 0.1, at=nlctl.faults.NEVER))',
        until=HORIZON,
        signals=(["yd", "y"], "e", "u", "zeta"),
        names=("fault_actuator_v", "plant.x1(0)", "controller.law.beta", *sliders),
        requirements=(
            (f"always from {TAIL:g} s on |e| <= {BOUND:g}", "the claim"),
            (f"always |u| <= {most:g}", "ours: the paper bounds no input"),
        ),
    )


def _figure(number: int, name: str, draw: Callable, caption: str) -> PaperFigure:
    return PaperFigure(
        key=f"example-{number}-{name}",
        caption=caption,
        draw=lambda runs: draw(runs[str(number)]),
        description=lambda runs: f"{caption} Over {HORIZON:g} s: {_summary(runs[str(number)])}",
        folded=name not in _SHOWN,
    )


def _summary(run: PaperRun) -> str:
    m = run.metrics
    return (
        f"max |e₁| for t ≥ {TAIL:g} s is {m['tail_max_e']:.5g}, max |u| {m['max_u']:.5g}, "
        f"zeta ends at {m['zeta_end']:.5g}, max norm of W_hat {m['max_W']:.3g}."
    )


def _interactive(number: int, run: PaperRun) -> History:
    names = ("y", "yd", "e", "u", "v", "zeta")
    return History(
        key=f"example-{number}-history",
        caption=f"{text.TITLES[number]}: output y, reference yd, tracking error e, control input "
        "u, output of the actuator v, argument of the Nussbaum gain zeta.",
        description=f"Chart of {', '.join(names)} over {HORIZON:g} s; the figures above show the "
        "same signals, the slider below shows their values.",
        time=run.time,
        signals={name: run.signals[name] for name in names},
        shown=("y", "yd", "e", "zeta"),
    )


LV_2017 = Paper(
    key="lv_2017",
    title="Adaptive neural control with an uncertain actuator, reproduced",
    question=text.QUESTION,
    citation=text.CITATION,
    heading="Plant class and controller",
    model=(
        Paragraph(text="The plant is a chain of integrators with a non-affine last equation:"),
        text.PLANT_CLASS,
        *text.CONTROLLER_PART,
    ),
    parts=(_part(1), _part(2)),
    cases=CASES,
    statements=tuple(map(expected_statement, expectations())),
    reproduced="both examples over 20 s, with either actuator",
    not_reproduced="the theorem: the lemma on which its proof depends is false",
    methods=text.METHODS_TEXT,
    others_cited=text.OTHERS_CITED,
    numbers_title="Comparison with {count} reference values",
    numbers_caption=(
        "Computed by nlctl's engine from the python-control diagrams; reference: converged digits "
        "of an independent integration that locates events."
    ),
    numbers_key="figures",
    asked="reference",
    digits=".10f",
    command="nlctl report",
    packages=("python-flint", "clarabel", "cma"),
)
