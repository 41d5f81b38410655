"""A study's page shows the loop that was run: diagram, parameters, equations, source, limits."""

import hashlib

import control as ct
import numpy as np
import pandas as pd
import pytest
from rows import each_row
from studies_example import HEAD, LOOP, ROWS, write

from nlctl.analysis import figures
from nlctl.analysis.pages.study.histories import histories
from nlctl.analysis.pages.study.loop import StudyLoop, loop_of, loop_sections
from nlctl.analysis.pages.study.report import study_report
from nlctl.analysis.report import Equation, Figure, Paragraph, Table, render_html
from nlctl.analysis.robustness import Requirement, always, eventually, in_band, prepare
from nlctl.analysis.robustness.stl.spec import limits_of_requirements
from nlctl.analysis.studies import read_study, run


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A study of a loop in a file of its own, and the loop as it was prepared."""
    folder = tmp_path_factory.mktemp("study")
    file = read_study(write(folder, HEAD, ROWS))
    return run(file, folder / "run"), prepare(file.experiment)


@pytest.fixture(scope="module")
def sections(study):
    result, prepared = study
    return {s.key: s for s in loop_sections(loop_of(prepared), result)}


def test_the_source_is_that_of_the_users_file_with_its_hash(study, sections):
    """Byte for byte, folded, and named where the loop is shown."""
    _, prepared = study
    found = loop_of(prepared)
    assert (found.maker, found.file) == ("loop", "loop.py")
    assert found.source == LOOP
    assert found.sha256 == hashlib.sha256(LOOP.encode()).hexdigest()
    assert found.sha256 in sections["study_loop"].items[0].text
    assert sections["study_source"].folded
    assert sections["study_source"].items[0].code == LOOP


def test_all_parameters_are_listed_with_what_was_varied(study, sections):
    """Each law of the study stands beside its parameter, and nowhere else."""
    result, _ = study
    (table,) = (i for i in sections["study_loop"].items if isinstance(i, Table))
    varied = {row[0]: row[3] for row in table.rows}
    assert {"lag.rate", "lag.gain", "lag.scale"} == set(varied)
    laws = result.quantities["law"].to_dict()
    assert varied == {name: laws.get(name, "") for name in varied}
    assert varied["lag.rate"]


def test_the_diagram_and_the_equations_are_those_that_run(sections):
    """x' = -rate x + gain x^3, y = scale x, z = 2 x."""
    (figure,) = (i for i in sections["study_loop"].items if isinstance(i, Figure))
    assert "lag" in figure.description
    told = [i.latex for i in sections["study_equations"].items if isinstance(i, Equation)]
    assert len(told) == 3
    assert [line.partition(" = ")[0] for line in told] == [r"\dot{x}", "y", "z"]


def test_a_loop_without_formulas_or_blocks_is_shown_as_far_as_it_goes(study):
    """A single system is not a diagram; one that calls what cannot be read says so."""
    result, _ = study

    def secret(t, x, u, params):
        return np.frombuffer(x.tobytes()) * -1.0

    single = ct.nlsys(secret, None, states=["x"], inputs=0, outputs=["x"], name="single")
    made = {s.key: s for s in loop_sections(StudyLoop(diagram=single, maker="f"), result)}
    assert not [i for i in made["study_loop"].items if isinstance(i, Figure)]
    assert "no formulas of this loop" in made["study_equations"].items[0].text
    assert "study_source" not in made
    lag = ct.ss(-1, 1, 1, 0, inputs="x", outputs="y", name="lag")
    single = ct.nlsys(lambda t, x, u, p: [-np.linalg.eigvals(np.diag([1, 2, x[0]])).real.max()],
                      None, states=["x"], inputs=0, outputs=["x"], name="single")  # fmt: skip
    both = ct.interconnect([single, lag], inputs=[], inplist=[], outputs=["y"], name="both")
    items = loop_sections(StudyLoop(diagram=both, maker="f"), result)
    (section,) = (s for s in items if s.key == "study_equations")
    texts = [i.text for i in section.items if isinstance(i, Paragraph)]
    assert texts[1].startswith("Block single")
    assert "There is no formula of it: " in texts[2]
    assert [i.latex for i in section.items if isinstance(i, Equation)][-1] == "y = x_{1}"


@pytest.mark.slow
def test_the_page_begins_with_a_picture_of_the_runs_and_the_question(study):
    """The signal that the spec limits first; without runs to draw, their margins."""
    result, prepared = study
    kept = histories(prepared, result.rows.table, most=20)
    report = study_report(result, kept, loop=loop_of(prepared))
    assert [ax.get_ylabel().split(" ")[0] for ax in report.lead.figure.axes] == ["y"]
    page = render_html(report)
    assert page.index('id="lead"') < page.index('id="claims"') < page.index("study_loop")
    assert "margin" in study_report(result).lead.figure.axes[0].get_xlabel()


def test_fans_show_the_limits_where_they_count_and_the_units(study):
    """|z| <= 4 over the whole run, y <= 0.5 from 1 s on; a peak has its signal's unit."""
    result, prepared = study
    kept = histories(prepared, result.rows.table, most=20)
    assert kept.limits == {"y": [(0.5, 1.0, 2.0)], "z": [(-4.0, 0.0, 2.0), (4.0, 0.0, 2.0)]}
    assert kept.units == {"y": "1", "z": "1"}
    assert kept.groups == ()
    figure = figures.fans(
        kept.time, kept.signals, kept.nominal, kept.worst, limits=kept.limits, units=kept.units
    )
    drawn = [
        (float(y), float(x0), float(x1))
        for lines in figure.axes[0].collections
        if lines.get_label() == figures.LIMIT
        for (x0, y), (x1, _) in lines.get_segments()
    ]
    assert drawn == kept.limits["y"]
    assert [ax.get_ylabel() for ax in figure.axes] == ["y (1)", "z (1)"]


BAND = in_band("y", upper=1.0)


@each_row(
    ("formula", "wanted"),
    [
        (always(BAND), [(1.0, 0.0, 9.0)]),
        (always(BAND, 2, 5), [(1.0, 2.0, 5.0)]),
        (always(always(BAND, 1, 2), 3, 4), [(1.0, 4.0, 6.0)]),
        (always(BAND) & always(in_band("y", lower=-1.0)), [(1.0, 0.0, 9.0), (-1.0, 0.0, 9.0)]),
        (eventually(BAND, 0, 5), None),
        (~always(BAND), None),
        (always(BAND | in_band("y", lower=2.0)), None),
        (BAND, None),
    ],
)
def test_only_what_is_always_required_is_a_line(formula, wanted):
    """What may hold at some time, or instead of something else, limits no run at any time."""
    found = limits_of_requirements([Requirement(key="r", formula=formula, until=9.0)])
    assert found.get("y") == wanted


def test_runs_of_different_kinds_make_no_band_together():
    """Two kinds, two bands: nothing is shaded between them."""
    t = np.linspace(0, 1, 11)
    low, high = np.zeros((20, 11)), np.ones((20, 11))
    wobble = np.linspace(0, 0.1, 20)[:, None]
    samples = {"y": np.concatenate([low + wobble, high + wobble])}
    kinds = ["low"] * 20 + ["high"] * 20
    mixed = figures.fans(t, samples, {"y": low[0]}, {"y": high[0]}, groups=kinds)
    (ax,) = mixed.axes
    bands = [c.get_paths()[0].vertices[:, 1] for c in ax.collections]
    assert len(bands) == 2
    assert all(np.ptp(band) < 0.2 for band in bands)
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert {"low", "high"} <= set(labels)
    assert not [label for label in labels if "%" in label]


@each_row(("margins", "share"), [([0.1, 0.2, 0.3, 0.4], 0.0), ([-0.3, 0.1, 0.2, 0.6], 1 / 3)])
def test_the_colours_of_a_map_fit_its_margins_with_0_in_the_middle(margins, share):
    """The colour bar ends where the margins end; white is 0 and nothing else; the box is drawn."""
    points = pd.DataFrame({"a": [0, 1, 0, 1], "b": [0, 0, 1, 1], "spec": margins}, dtype=float)
    triangles, box = np.array([[0, 1, 2], [1, 3, 2]]), ((0.25, 0.75), (0.25, 0.5))
    made = figures.failure_map_figure(points, triangles, ("a", "b"), box=box)
    ax, bar = made.axes
    norm = ax.images[0].norm
    assert norm(0.0) == pytest.approx(0.5)
    assert norm(max(margins)) == pytest.approx(1.0)
    assert bar.get_ylim() == pytest.approx((min(margins), max(margins)))
    assert (norm.vmin < -0.05) == (share > 0)
    drawn = [np.column_stack(line.get_data()) for line in ax.lines if len(line.get_xdata()) == 5]
    corners = {tuple(point) for point in drawn[-1]}
    assert corners == {(0.25, 0.25), (0.75, 0.25), (0.75, 0.5), (0.25, 0.5)}
