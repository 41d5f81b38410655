"""Studies from file to result, against closed forms of a linear loop x' = -rate x."""

import json
import math
import os
import signal
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from studies_example import HEAD, ROWS, write

from nlctl.analysis.robustness import (
    clopper_pearson,
    elementary_effects,
    load,
    prepare,
    sobol_indices,
)
from nlctl.analysis.studies import (
    RunFolderError,
    StudyError,
    load_result,
    plan,
    read_study,
    replay,
    replay_figure,
    run,
    run_differences,
)
from nlctl.analysis.studies.file.schema import keyed
from nlctl.analysis.studies.folder import load_finding, load_run, save_finding
from nlctl.analysis.studies.intact import seal
from nlctl.analysis.studies.sealed import origin_key
from nlctl.errors import ParameterError, UnknownNameError

EVERY_KIND = """
[runs]
size = 200

[[analysis]]
kind = "probability"
confidence = 0.95
side = "both"
limit = 0.01

[[analysis]]
kind = "sequential"
limit = 0.5

[[analysis]]
kind = "morris"
trajectories = 4

[[analysis]]
kind = "sobol"
size = 64
of = "iae"

[[analysis]]
kind = "regional"

[[analysis]]
kind = "worst case"
runs = 40
limit = -1.0

[[analysis]]
kind = "radius"
quantities = ["lag.rate"]
largest = 0.9
runs = 20
draws = 20

[[analysis]]
kind = "degradation"
factors = [0.5, 1.0]
runs = 40
limit = 0.9

[[analysis]]
kind = "failure map"
x = "lag.rate"
y = "lag.x(0)"
cells = 4
levels = 3

[[analysis]]
kind = "compare"
keyword = "lag"
options = { function = "loop.py:lags" }
requirements = ["decays"]
runs = 20
metrics = { iae = "smaller" }
better = ["calm", "wild"]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("study")


@pytest.fixture(scope="module")
def result(folder):
    """Every kind of analysis, once."""
    return run(read_study(write(folder, HEAD, EVERY_KIND)), folder / "run", threads=1)


def decays(table):
    """Margin of the requirement, in closed form: y falls, so the first second decides."""
    return (0.5 - table["lag.x(0)"] * np.exp(-table["lag.rate"])) / 0.5


@pytest.mark.slow
def test_the_rows_are_those_of_the_closed_form(result):
    """Margins and counts, 200 independent draws of the laws."""
    table = result.rows.table
    np.testing.assert_allclose(table["decays"], decays(table), atol=1e-5)
    assert table["lag.rate"].between(0.5, 2.5).all()
    found = result["probability"]
    violations = int((decays(table) < 0).sum())
    assert (found.numbers["violations"], found.numbers["runs"]) == (violations, 200)
    bounds = clopper_pearson(violations, 200, 0.95, "both")
    assert (found.numbers["lower"], found.numbers["upper"]) == bounds
    assert "independent draws of lag.rate ~ uniform on [0.5, 2.5]" in found.sentence


def test_claims_decide_the_verdict(result):
    """Each claim is told apart, and the sentence names those that fail."""
    holds = {finding.key: finding.holds for finding in result.claims}
    assert holds == {
        "probability": False,  # some 12 % violate
        "sequential": True,
        "worst-case": True,
        "degradation": True,
        "compare": True,  # x^3 only ever slows the decay of x > 0
    }
    assert result.complete
    assert not result.holds
    assert result.answer == result["probability"].answer == "refuted"  # above 5 %, surely
    assert result.verdict == "1 of 5 claims is refuted: probability."


def test_searches_find_what_the_closed_form_says(result):
    """Worst corner (0.5, 1.5); radius along the rate; boundary x(0) = exp(rate) / 2."""
    worst = result["worst-case"].numbers
    assert worst["witness"] == {"lag.rate": 0.5, "lag.x(0)": 1.5}
    assert worst["margin"] == pytest.approx((0.5 - 1.5 * math.exp(-0.5)) / 0.5, abs=1e-6)
    assert worst["is_confirmed"] is True
    # nominal rate 1, box down to 0.5: y(1) = 0.5 at rate log 2
    assert result["radius"].numbers["upper"] == pytest.approx((1 - math.log(2)) / 0.5, rel=0.02)
    edge = result["failure-map"].tables["boundary"]
    np.testing.assert_allclose(edge["lag.x(0)"], np.exp(edge["lag.rate"]) / 2, rtol=0.05)
    curve = result["degradation"].tables["curve"]
    assert list(curve.index) == [0.5, 1.0]


def test_sensitivity_sees_both_quantities(result):
    """Of two quantities that both matter, shares of the variance lie between 0 and 1."""
    indices = result["sobol"].tables["indices"]
    assert list(indices.index) == ["lag.rate", "lag.x(0)"]
    assert ((indices["ST"] > 0.1) & (indices["ST"] < 1)).all()
    effects = result["morris"].tables["effects"]
    assert effects.loc["lag.rate", "mu"] > 0 > effects.loc["lag.x(0)", "mu"]
    apart = result["regional"].tables["differences"]
    assert apart.loc["lag.rate", "statistic"] > 0.5


def test_a_result_is_read_from_its_folder_without_running(result):
    """Everything but the objects: records, tables, rows with their design."""
    again = load_result(result.folder)
    assert again.plain() == result.plain()
    assert again.study == result.study
    for one, other in zip(result.findings, again.findings, strict=True):
        assert one.tables.keys() == other.tables.keys()
        for name in one.tables:
            pd.testing.assert_frame_equal(one.tables[name], other.tables[name])
    pd.testing.assert_frame_equal(again.rows.table, result.rows.table)
    drawn = again.rows.design.table
    np.testing.assert_array_equal(drawn, again.rows.table[drawn.columns])
    content = json.loads((result.folder / "results.json").read_text(encoding="utf-8"))
    assert content["verdict"] == result.verdict
    assert [f["key"] for f in content["findings"]] == [f.key for f in result.findings]
    with pytest.raises(UnknownNameError, match="unknown finding 'sobel'; nearest: 'sobol'"):
        result["sobel"]


@pytest.mark.parametrize(("part", "row"), [("", 7), ("worst-case", 3), ("compare", 11)])
def test_a_row_is_replayed_bit_for_bit(part, row, result):
    """Of the main table, of a search, and of a comparison; the signals are those of the row."""
    made = replay(result.folder, row, part)
    assert made.differences == ()
    assert "bit for bit" in str(made)
    assert made.signals["y"][0] == made.stored["lag.x(0)"]
    np.testing.assert_array_equal(made.signals["z"], 2 * made.signals["y"])
    assert len(replay_figure(made).axes) == 2


def test_a_replay_tells_a_difference(result):
    """Numbers of another processor, say, are not confirmed."""
    origin = origin_key(load_run(result.folder)["origin"])
    before = load_finding(result.folder, "worst-case", origin)
    table = before.tables["rows"].copy()
    table.loc[3, "iae"] = np.nextafter(table.loc[3, "iae"], np.inf)
    save_finding(result.folder, replace(before, tables=before.tables | {"rows": table}), origin)
    seal(result, origin)
    try:
        made = replay(result.folder, 3, "worst-case")
    finally:
        save_finding(result.folder, before, origin)
        seal(result, origin)
    assert made.differences == ("iae",)
    assert "1 column differs" in str(made)
    assert "The loop is the same; so are all versions: another processor?" in str(made)
    with pytest.raises(ParameterError, match="row 999 of the main table is not there"):
        replay(result.folder, 999)
    with pytest.raises(RunFolderError, match="keeps no rows"):
        replay(result.folder, 0, "regional")


@pytest.mark.ci
def test_an_interrupted_study_goes_on_to_the_same_result(result, folder):
    """Whatever is missing is run again: the same numbers, bit for bit."""
    path = write(folder, HEAD, EVERY_KIND)
    again = folder / "again"
    run(read_study(path), again, threads=1)
    chunks = sorted((again / "rows" / "chunks").glob("*.parquet"))
    chunks[1].unlink()
    (again / "radius" / "finding.json").unlink()
    (again / "results.json").unlink()
    with pytest.raises(RunFolderError, match="holds a run already: continue it with --resume"):
        run(read_study(path), again)
    resumed = run(read_study(path), again, resume=True)
    assert resumed.plain() == result.plain()
    columns = [c for c in result.rows.table if c != "wall_time"]
    pd.testing.assert_frame_equal(resumed.rows.table[columns], result.rows.table[columns])
    assert (again / "results.json").read_bytes() == (result.folder / "results.json").read_bytes()
    with pytest.raises(RunFolderError, match=r"another study \(runs differ\)"):
        run(read_study(path, ["runs.size=100"]), again, resume=True)


def test_a_folder_is_run_by_one_process_at_a_time(folder):
    """The second one is told who works there, and the first one goes on."""
    file, refused = read_study(write(folder, HEAD, ROWS, name="once.toml")), []

    def second(progress):
        with pytest.raises(RunFolderError, match=f"in use by process {os.getpid()} on") as error:
            run(file, folder / "once", resume=True)
        refused.append(error)

    assert run(file, folder / "once", threads=1, watch=lambda title: nullcontext(second)).complete
    assert refused
    with pytest.raises(RunFolderError, match=r"cannot write to '.*loop\.py'"):
        run(file, folder / "loop.py")


def test_two_names_of_one_parameter_are_a_mistake_of_the_file(folder):
    """With its place; each by itself would be right."""
    twice = HEAD.replace("[spec]", "rate = { uniform = [0.5, 1.5] }\n\n[spec]")
    with pytest.raises(StudyError, match=r"space: .* got twice: \['lag\.rate'\]"):
        read_study(write(folder, twice, ROWS, name="twice.toml"))


THREE = f"""{ROWS}
[[analysis]]
kind = "morris"
trajectories = 4

[[analysis]]
kind = "sobol"
size = 8
"""


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize(("part", "findings"), [("rows", 0), ("morris", 2), ("sobol", 3)])
@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_in_a_last_chunk_is_not_forgotten(folder, part, findings):
    """All rows of that part are there; what follows waits for --resume all the same."""
    file = read_study(write(folder, HEAD, THREE, name="three.toml"))

    def press(progress):
        if progress.done == progress.total:
            signal.raise_signal(signal.SIGINT)

    found = run(
        file, folder / part, threads=1, watch=lambda t: nullcontext(press if t == part else None)
    )
    assert found.interrupted
    assert found.rows.complete
    assert len(found.findings) == findings
    assert found.complete == (findings == 3)
    resumed = run(file, folder / part, resume=True)
    assert resumed.complete
    assert resumed.plain() == run(file, folder / f"{part}-straight").plain()


def test_two_runs_are_compared_number_by_number(result, folder):
    """The same run has no differences; another seed has some, each with its place."""
    assert run_differences(result.folder, result.folder) == []
    file = read_study(write(folder, HEAD, ROWS, name="other.toml"), ["study.seed=4"])
    other = run(file, folder / "other", threads=1)
    told = run_differences(result.folder, other.folder)
    assert any(text.startswith("findings.probability.numbers.violations was ") for text in told)
    assert any(text.startswith("findings.radius.") for text in told)  # only one of them has it


def test_a_sequential_test_alone_ends_the_rows_when_it_is_decided(folder):
    """About a tenth violate: a limit of one half needs few of 2000 rows."""
    alone = '[runs]\nsize = 2000\n\n[[analysis]]\nkind = "sequential"\nlimit = 0.5\n'
    file = read_study(write(folder, HEAD, alone, name="alone.toml"))
    found = run(file, folder / "alone", threads=1)
    assert found.complete
    assert found.holds
    assert found.rows.done < 1000
    resumed = run(file, folder / "alone", resume=True)
    assert resumed.rows.done == found.rows.done


def test_an_analysis_that_cannot_be_made_costs_no_other(folder):
    """Sobol' shares of a metric that is infinite for some rows; the probability stays."""
    text = ROWS + '\n[[analysis]]\nkind = "sobol"\nsize = 8\nof = "settled"\n'
    found = run(read_study(write(folder, HEAD, text, name="inf.toml")), folder / "inf", threads=1)
    assert found.complete
    endless = np.sum(np.isinf(load(folder / "inf" / "sobol" / "rows").table["settled"]))
    assert 0 < endless < 32
    assert found["sobol"].sentence.startswith(
        f"Not answered: {endless} of 32 rows have no finite 'settled': take a margin"
    )
    assert (found["sobol"].is_answered, found["sobol"].holds) == (False, False)
    assert found["sobol"].runs == 32
    assert found["probability"].holds is True
    assert (found.answer, found["sobol"].claim) == ("not shown yet", "the analysis has an answer")
    assert f"not shown yet: sobol (needs an answer: {endless} of 32 rows" in found.verdict


FAILING = (
    HEAD.replace(
        '"lag.x(0)" = { bounds = [0.5, 1.5], nominal = 1.0 }',
        """\
"lag.gain" = { bounds = [0.0, 4.0], nominal = 0.0 }""",
    )
    + """
[[analysis]]
kind = "sobol"
size = 32
of = "iae"

[[analysis]]
kind = "morris"
trajectories = 8
of = "iae"

[[analysis]]
kind = "sobol"
key = "shares"
size = 32
of = "decays"

[[analysis]]
kind = "morris"
key = "effects"
trajectories = 8
"""
)


@pytest.fixture(scope="module")
def failing(folder):
    """Sensitivity where some runs diverge: of a metric, which they lack, and of margins."""
    file = read_study(write(folder, FAILING, name="failing.toml"))
    return file, run(file, folder / "failing", threads=1)


def solution(table, t):
    """y(t) in closed form, x^-2 = g / r + (1 - g / r) exp(2 r t) from x(0) = 1; NaN if it ended."""
    r, ratio = table["lag.rate"], table["lag.gain"] / table["lag.rate"]
    inverse_square = ratio + (1 - ratio) * np.exp(2 * r * t)
    return 1 / np.sqrt(inverse_square.where(inverse_square > 0))


@pytest.mark.slow
@pytest.mark.parametrize("key", ["sobol", "morris"])
def test_a_metric_that_failed_rows_lack_has_no_sensitivity(failing, key):
    """The finding says how many and what to take instead; the others are made, and stay made."""
    file, found = failing
    table = load(found.folder / key / "rows").table
    failed = int(solution(table, 2.0).isna().sum())
    assert 0 < failed < len(table)
    assert found[key].sentence == (
        f"Not answered: {failed} of {len(table)} rows have no finite 'iae', as runs did not "
        'reach their end: take a margin, such as of = "spec", which every row has, or a space '
        "without such rows."
    )
    assert (found[key].holds, found[key].runs) == (False, len(table))
    assert found.complete
    assert found["shares"].tables.keys() == {"indices"}
    titles = []
    again = run(file, found.folder, resume=True, watch=lambda t: nullcontext(titles.append(t)))
    assert titles == []
    assert again.plain() == found.plain()


def test_failed_rows_count_as_the_least_margin_of_the_others(failing):
    """Shares and effects are those of the closed form, with one number where a run ended early."""
    file, found = failing
    space = prepare(file.experiment).experiment.space
    made = {"shares": ("indices", sobol_indices), "effects": ("effects", elementary_effects)}
    for key, (name, analysis) in made.items():
        asked = keyed(file.study)[key]
        design = asked.definition.design(asked, space, file.study.study.seed)
        end = solution(design.table, 2.0)
        margin = (0.5 - np.fmax(solution(design.table, 1.0), end)) / 0.5
        if asked.of == "spec":
            margin = np.minimum(margin, (4 - 2 * np.fmax(end, 1.0)) / 4)
        least = min(margin[end.notna()].min(), -1.0)
        expected = analysis(design, margin.where(end.notna(), least))
        pd.testing.assert_frame_equal(found[key].tables[name], expected, rtol=1e-3, atol=1e-4)
        assert found[key].numbers["failed"] == end.isna().sum() > 0
        assert found[key].numbers["counted_as"] == pytest.approx(least, rel=1e-4)
        assert found[key].sentence.endswith(
            f"{end.isna().sum()} of them did not reach their end: each counts as a margin of "
            f"{least:.4g}, no better than any of the others."
        )


def test_a_plan_counts_the_runs(folder):
    """Rows and designs exactly, searches at most."""
    found = plan(read_study(write(folder, HEAD, EVERY_KIND)), threads=1)
    assert found.runs["rows"] == 200
    assert found.runs["morris"] == 4 * 3
    assert found.runs["sobol"] == 64 * 4
    assert found.runs["degradation"] == 80
    assert found.runs["compare"] == 60
    assert set(found.at_most) == {"worst-case", "radius", "failure-map"}
    assert found.total == sum(found.runs.values())
    assert found.seconds > 0
