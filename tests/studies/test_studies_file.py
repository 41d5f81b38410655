"""Study files: every mistake at once with its place, and what a correct one stands for."""

import re

import numpy as np
import pytest
from rows import each_row
from studies_example import HEAD, ROWS, write

from nlctl import paper
from nlctl.analysis.robustness import nominal, resolved
from nlctl.analysis.studies import StudyError, from_toml, read_study, to_toml
from nlctl.analysis.studies.file.errors import place_text
from nlctl.analysis.studies.file.schema import keyed
from nlctl.analysis.studies.file.toml import line_numbers
from nlctl.analysis.studies.reading.own_kinds import model_of
from nlctl.errors import ParameterError
from nlctl.names import unknown


def mistakes(path, *settings):
    """Return the mistakes of a file as ``{place: (line, message)}``."""
    with pytest.raises(StudyError) as caught:
        read_study(path, settings)
    found = {p.plain()["text"]: (p.line, p.message) for p in caught.value.problems}
    assert len(found) == len(caught.value.problems)
    for problem in caught.value.problems:
        assert str(problem) in str(caught.value)
    return found


def test_all_mistakes_are_reported_at_once_each_with_its_line(tmp_path):
    """Mistakes of form, of formulas, of laws and of names in the loop, in one go."""
    text = """\
loop = "loop.py:loop"
lopp = 3

[study]
title = "A lag"
seed = -1

[space]
"lag.rat" = { uniform = [0.5, 2.5] }
"lag.x(0)" = { unifrm = [0.5, 1.5] }
"lag.y(0)" = { bounds = [0.5, 1.5] }
"lag.gain" = { law = "nrm", parameters = { loc = 0.0 } }
"gain" = { normal = [0.1, "wide"] }

[spec]
decays = "always from 1 s on yy <= 0.5"
small = { formula = "always |z| < 4" }
late = "always in [1, 3] s y <= 1"

[time]
end = 2.0
step = 0.03

[metrics]
band = 0.1
error = "why"

[[analysis]]
kind = "probability"
limit = 2
limt = 0.1

[[analysis]]
confidence = 0.9

[[analysis]]
kind = "moris"

[[analysis]]
kind = "regional"
"""
    found = mistakes(write(tmp_path, text))
    lines = {place: line for place, (line, _) in found.items()}
    said = {place: message for place, (_, message) in found.items()}
    assert lines["lopp"] == 2
    assert said["lopp"] == "unknown key 'lopp'; nearest: 'loop'"
    assert lines['space."lag.rat"'] == 9
    assert "nearest: 'lag.rate'" in said['space."lag.rat"']
    assert "unknown key 'unifrm'; nearest: 'uniform'" in said['space."lag.x(0)".unifrm']
    assert "unknown state 'lag.y'; nearest: 'lag.x'" in said['space."lag.y(0)"']
    assert "unknown law 'nrm' of scipy.stats" in said['space."lag.gain"']
    assert "valid number, got 'wide'" in said["space.gain.normal[1]"]
    assert lines["space.gain.normal[1]"] == 13
    assert "unknown signal 'yy'; nearest: 'y'" in said["spec.decays"]
    assert "needs '<=', found '<'" in said["spec.small"]
    assert "at least 3 s" in said["spec.late"]
    assert "multiple of the step" in said["time"]
    assert "unknown signal 'why'" in said["metrics.error"]
    assert "less than 1, got 2" in said["analysis[0].limit"]
    assert lines["analysis[0].limt"] == 31
    assert said["analysis[1].kind"] == "is missing"
    assert "unknown kind 'moris'; nearest: 'morris'" in said["analysis[2].kind"]
    assert "needs the main table: add [runs]" in said["analysis[3]"]  # its own number
    assert lines["analysis[3]"] == 39
    assert "greater than or equal to 0, got -1" in said["study.seed"]


@each_row(
    ("old", "new", "place", "message"),
    [
        ('loop = "loop.py:loop"', 'loop = "example-3"', "loop", "nearest: 'example-2'"),
        ("loop.py:loop", "lop.py:loop", "loop", "there is no file"),
        ("loop.py:loop", "loop.py:lop", "loop", "unknown function 'lop' in 'loop.py'"),
        ("loop.py:loop", "no_such:loop", "loop", "there is no module 'no_such'"),
        ("[time]", "[options]\nlagg = 1\n[time]", "options.lagg", "unknown keyword 'lagg'"),
        (
            "[time]",
            '[options]\nlag = { block = "DeadZon" }\n[time]',
            "options.lag",
            "nearest: 'DeadZone'",
        ),
        (
            "[time]",
            '[options]\nlag = { function = "loop.py:Lag", rat = 1 }\n[time]',
            "options.lag",
            "unknown keyword 'rat' of Lag; nearest: 'rate'",
        ),
        (
            "[time]",
            '[options]\nlag = { function = "loop.py:Lag", rate = -1 }\n[time]',
            "options.lag",
            "Lag needs rate > 0, got -1",
        ),
        (
            "[time]",
            "[choices.lag]\noptions = { a = 1 }\nweights = { b = 1.0 }\n[time]",
            "choices.lag",
            "unknown option 'b'",
        ),
        ("uniform = [0.5, 2.5]", "uniform = [-0.5, 2.5]", 'space."lag.rate"', "rate > 0, got -0.5"),
        (
            "uniform = [0.5, 2.5]",
            'law = "truncnorm", parameters = { a = 1.0 }',
            'space."lag.rate"',
            "the law truncnorm needs b as well",
        ),
        ("uniform = [0.5, 2.5]", "normal = [1.0, -0.1]", 'space."lag.rate"', "does not exist for"),
        (
            "uniform = [0.5, 2.5]",
            "uniform = [0.5, 2.5], normal = [1.0, 0.1]",
            'space."lag.rate"',
            "one of uniform, normal and law, or bounds alone, got uniform and normal",
        ),
        ("nominal = 1.0", "nominal = 3.0", 'space."lag.x(0)"', "nominal value in its box"),
        ("size = 200", 'size = 200\ndesign = "Sobol\'"', "runs", "power of 2 as its size, got 200"),
        ("size = 200", 'size = 200\ndesign = "corners"', "runs.size", "takes no size"),
        (
            "size = 200",
            'size = 256\ndesign = "Sobol\'"',
            "analysis[0]",
            "no guarantee from a design of kind 'Sobol''",
        ),
        (
            "limit = 0.5",
            '[[analysis]]\nkind = "sobol"\nsize = 16\nof = "iea"',
            "analysis[1].of",
            "unknown column 'iea'; nearest: ",
        ),
        (
            "limit = 0.5",
            '[[analysis]]\nkind = "sobol"\nsize = 17',
            "analysis[1]",
            "power of 2 as its size, got 17",
        ),
        (
            "limit = 0.5",
            '[[analysis]]\nkind = "failure map"\nx = "lag.rate"\ny = "lag.x"',
            "analysis[1].y",
            "unknown quantity 'lag.x'; nearest: 'lag.x(0)'",
        ),
        (
            "limit = 0.5",
            'limit = 0.5\nside = "lower"',
            "analysis[0]",
            "a limit needs side = 'upper' or 'both'",
        ),
        (
            "limit = 0.5",
            '[[analysis]]\nkind = "degradation"\nfactors = [0.5]\nruns = 5\nlimit = 0.1',
            "analysis[1]",
            "not among the factors",
        ),
        (
            "limit = 0.5",
            '[[analysis]]\nkind = "compare"\nkeyword = "lag"\nruns = 5\n'
            'options = { function = "loop.py:lags" }\nonly = ["clam"]\n'
            'metrics = { iae = "smaller" }',
            "analysis[1]",
            "unknown option 'clam'; nearest: 'calm'",
        ),
        (
            "limit = 0.5",
            '[[analysis]]\nkind = "compare"\nkeyword = "lag"\nruns = 5\n'
            'options = { function = "loop.py:lags" }\nrequirements = ["smal"]\n'
            'metrics = { iae = "smaller" }',
            "analysis[1]",
            "unknown requirement 'smal'; nearest: 'small'",
        ),
        (
            "limit = 0.5",
            'key = "rows"',
            "analysis[0].key",
            "needs a key of its own, 'rows' is taken",
        ),
    ],
)
def test_a_single_mistake_is_found_where_it_stands(old, new, place, message, tmp_path):
    """Each by itself in a file that is correct otherwise."""
    path = write(tmp_path, HEAD, ROWS)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    found = mistakes(path)
    if "design" in new and place.startswith("runs"):
        found.pop("analysis[0]", None)  # its rows are not independent draws, another mistake
    assert list(found) == [place]
    assert message in found[place][1]


def test_a_file_that_is_no_toml_names_the_line(tmp_path):
    """tomllib's own words."""
    with pytest.raises(StudyError, match=r"is not TOML: .*line 2"):
        read_study(write(tmp_path, "loop = 'a'\nfree text\n"))


def test_the_study_is_what_the_file_says(tmp_path):
    """Laws, spec, times, metrics, solver, and the loop from a file beside it."""
    extra = "[solver]\nrtol = 1e-9\n\n[options]\nlag = { function = 'loop.py:Lag', gain = 0.1 }\n"
    file = read_study(write(tmp_path, HEAD, extra, ROWS))
    experiment = file.experiment
    rate, start = experiment.space.quantities
    assert rate.law.support() == (0.5, 2.5)
    assert (start.box, start.nominal) == ((0.5, 1.5), 1.0)
    assert [str(r.formula) for r in experiment.spec.requirements] == [
        "always from 1 s on y <= 0.5",
        "always |z| <= 4",
    ]
    np.testing.assert_array_equal(experiment.timepts, np.linspace(0, 2, 101))
    assert {m.signal for m in experiment.metrics} == {"y", "z"}  # the loop has no v and no zeta
    assert (experiment.rtol, experiment.atol) == (1e-9, 1e-10)
    diagram = experiment.build()
    assert diagram.params["lag.gain"] == 0.1
    assert nominal(resolved(experiment.space, diagram)) == {"lag.rate": 1.0, "lag.x(0)": 1.0}


def test_blocks_and_choices_of_the_papers_example(tmp_path):
    """A record by name with its fields; "default" is what the example has by itself."""
    text = """\
loop = "example-1"

[study]
title = "Dead zones"
seed = 0

[options]
phase = "integral"

[choices.actuator]
options = { published = "default", wide = { block = "DeadZone", b_r = 0.9 } }
weights = { published = 0.75, wide = 0.25 }

[spec]
small = "always from 10 s on |e| <= 0.2"

[time]
end = 20
step = 0.01
"""
    file = read_study(write(tmp_path, text))
    (choice,) = file.experiment.space.choices
    assert choice.weights == (0.75, 0.25)
    wide = file.experiment.build(actuator=choice.options["wide"])
    assert wide.params["actuator.b_r"] == 0.9
    published = file.experiment.build(actuator=choice.options["published"])
    assert dict(published.params).keys() == dict(paper.example_1().params).keys()
    assert published.params["plant.integrate_w"] is True


LOADED_LATER = """
loop = "nlctl:{name}"
options = {{ spec = {{ block = "Lag", T = 0.2 }}, name = "lag" }}
study = {{ title = "A lag", seed = 1 }}
space."lag.T".bounds = [0.1, 0.4]
inputs.u = 1.0
spec.rises = "always from 1 s on v >= 0.9"
time = {{ end = 1.2, step = 0.1 }}
"""


def test_a_function_that_a_package_loads_when_asked_is_a_loop(tmp_path):
    """`nlctl.block` is not among nlctl's attributes before; a wrong name has its nearest."""
    path = tmp_path / "lag.toml"
    path.write_text(LOADED_LATER.format(name="block"), encoding="utf-8")
    experiment = read_study(path).experiment
    assert nominal(resolved(experiment.space, experiment.build())) == {"lag.T": 0.2}
    path.write_text(LOADED_LATER.format(name="blok"), encoding="utf-8")
    line, message = mistakes(path)["loop"]
    assert line == 2
    assert message.startswith("unknown function 'blok' in 'nlctl'; nearest: 'block'")


def test_settings_replace_what_stands_in_the_file(tmp_path):
    """Dotted keys as in TOML, entries of lists by number, key or kind, texts without quotes."""
    path = write(tmp_path)
    settings = [
        "runs.size=12",
        'space."lag.rate".uniform=[0.6, 1.7]',
        "analysis.0.limit=0.25",
        "analysis.probability.confidence=0.9",
        "study.title=Another lag",
        "solver.rtol=1e-7",
    ]
    study = read_study(path, settings).study
    assert study.runs.size == 12
    assert study.space["lag.rate"].uniform == (0.6, 1.7)
    assert (study.analysis[0].limit, study.analysis[0].confidence) == (0.25, 0.9)
    assert study.study.title == "Another lag"
    assert study.solver.rtol == 1e-7


@each_row(
    ("setting", "message"),
    [
        ("runs.size", "KEY=VALUE"),
        ("=3", "KEY=VALUE"),
        ("runs.size.more=3", "runs.size is not a table"),
        ("analysis.7.limit=0.1", r"number \(0 to 0\), or key or kind of one entry"),
    ],
)
def test_settings_that_cannot_be_read_are_refused(setting, message, tmp_path):
    """With what was given and what is needed."""
    with pytest.raises(ParameterError, match=message):
        read_study(write(tmp_path), [setting])


def test_a_wrong_setting_is_a_mistake_of_the_study(tmp_path):
    """It has a place, and no line that would show something else."""
    found = mistakes(write(tmp_path), "runs.sise=12")
    assert found["runs.sise"][1] == "unknown key 'sise'; nearest: 'size'"


def test_a_study_survives_being_written_and_read(tmp_path):
    """TOML round trip, nothing added and nothing lost."""
    study = read_study(write(tmp_path)).study
    text = to_toml(study)
    assert from_toml(text) == study
    assert to_toml(from_toml(text)) == text


def test_line_numbers_are_those_of_an_editor():
    """Headers, dotted keys, values over several lines, strings that look like TOML."""
    text = '''\
# a comment
a.b = 1
c = [
  1,
  2,
]
d = """
[e]
f = 1
"""

[[g]]
h = 1

[g.i]
"j.k" = 2

[[g]]
h = { x = 1 }
'''
    lines = line_numbers(text)
    assert (lines["a", "b"], lines[("c",)], lines[("d",)]) == (2, 3, 7)
    assert ("e",) not in lines
    assert (lines["g", 0, "h"], lines["g", 0, "i", "j.k"]) == (13, 16)
    assert (lines["g", 1], lines["g", 1, "h", "x"]) == (18, 19)


def test_the_schema_names_every_key_with_a_description():
    """Editors can complete and explain a study file."""
    schema = model_of({}).model_json_schema()
    assert set(schema["required"]) == {"loop", "study", "spec", "time"}
    assert schema["additionalProperties"] is False
    kinds = schema["properties"]["analysis"]["items"]["discriminator"]["mapping"]
    assert {"probability", "worst case", "failure map", "compare"} <= set(kinds)


def test_analyses_have_keys_of_their_own(tmp_path):
    """Their kind, numbered, and never one that another analysis asks for."""
    text = (
        ROWS
        + '[[analysis]]\nkind = "regional"\n\n[[analysis]]\nkind = "probability"\n'
        + '[[analysis]]\nkind = "regional"\nkey = "probability-2"\n'
    )
    study = read_study(write(tmp_path, HEAD, text)).study
    assert list(keyed(study)) == ["probability", "regional", "probability-3", "probability-2"]
    assert list(keyed(study).values()) == list(study.analysis)


def test_boxes_that_fit_one_by_one_but_not_together_are_a_mistake(tmp_path):
    """A backlash needs c_l < c_r: no row has to be drawn to find that out."""
    text = HEAD.replace("loop.py:loop", "example-2").replace("on y <=", "on e <=")
    head, _, rest = text.partition("[space]")
    tail = rest.partition("[spec]")[2].replace("|z|", "|u|").partition("[metrics]")[0]
    boxes = '"actuator.c_r" = { bounds = [-0.5, 0.6] }\n"actuator.c_l" = { bounds = [-0.8, 0.4] }'
    ((line, message),) = mistakes(write(tmp_path, f"{head}[space]\n{boxes}\n[spec]{tail}")).values()
    assert line == text.splitlines().index("[space]") + 1
    assert message.startswith("boxes do not fit together: Backlash needs c_l < c_r")


MISTAKES = [  # what is replaced, by what, and the place that has to be named
    ("seed = 3", "seed = -3", "study.seed"),
    ('title = "A lag"', 'titel = "A lag"', "study.titel"),
    ('"lag.rate" = { uniform = [0.5, 2.5] }', '"lag.rat" = { uniform = [0.5, 2.5] }', "lag.rat"),
    ("bounds = [0.5, 1.5]", "bounds = [1.5, 0.5]", "lag.x(0)"),
    ("on y <= 0.5", "on yy <= 0.5", "spec.decays"),
    ("always |z| <= 4", "alway |z| <= 4", "spec.small"),
    ("step = 0.02", "step = 0.03", "time"),
    ('error = "y"', 'error = "why"', "metrics.error"),
    ("size = 200", "size = 200\nlevels = 3", "runs"),
    ('kind = "probability"', 'kind = "probability"\nconfidence = 2', "analysis[0].confidence"),
    ("trajectories = 4", "trajectories = 4\nlevels = 3", "analysis[1]"),
    ("size = 16", "size = 17", "analysis[2]"),
    ('keyword = "lag"', 'keyword = "lagg"', "analysis[3].keyword"),
    ('x = "lag.rate"', 'x = "lag.speed"', "analysis[4].x"),
]
ALL_KINDS = """
[[analysis]]
kind = "morris"
trajectories = 4
[[analysis]]
kind = "sobol"
size = 16
[[analysis]]
kind = "compare"
keyword = "lag"
options = { a = { function = "loop.py:Lag" } }
runs = 3
metrics = { iae = "smaller" }
[[analysis]]
kind = "failure map"
x = "lag.rate"
y = "lag.x(0)"
"""


def test_all_mistakes_are_told_at_once(tmp_path):
    """Of form, of names, of formulas and of designs: every one that is told alone."""
    text = "\n".join((HEAD, ROWS, ALL_KINDS))
    every = text
    for before, after, place in MISTAKES:
        assert before in every
        every = every.replace(before, after, 1)
        one = text.replace(before, after, 1)
        with pytest.raises(StudyError) as told:
            read_study(write(tmp_path, one))
        assert any(place in place_text(p.place) for p in told.value.problems), told.value
    with pytest.raises(StudyError) as told:
        read_study(write(tmp_path, every))
    named = [place_text(p.place) for p in told.value.problems]
    assert [m[2] for m in MISTAKES if not any(m[2] in name for name in named)] == []


def test_a_wrong_time_hides_no_other_mistake(tmp_path):
    """Nor does a missing one: names and formulas are looked at all the same."""
    text = "\n".join((HEAD, ROWS)).replace("on y <= 0.5", "on yy <= 0.5")
    for before, after in (("end = 2.0", "end = -2.0"), ("step = 0.02", ""), ("end = 2.0", "e = 2")):
        assert before in text
        with pytest.raises(StudyError) as told:
            read_study(write(tmp_path, text.replace(before, after, 1)))
        named = {place_text(p.place) for p in told.value.problems}
        assert any(name.startswith("time") for name in named)
        assert "spec.decays" in named


def test_mistakes_of_settings_are_blamed_on_them(tmp_path):
    """Not on a line of the file; where a setting has a part in it, the line is named as well."""
    path = write(tmp_path)
    settings = ["study.seed=-3", "study.titel=x", "time.step=0.03"]
    with pytest.raises(StudyError) as told:
        read_study(path, settings)
    lines = str(told.value).splitlines()[1:]
    assert lines[0].strip().startswith("--set study.seed=-3: ")
    assert lines[1].strip().startswith("--set study.titel=x: unknown key 'titel'")
    assert re.search(r"line \d+, time: .*\(with --set time.step=0.03\)", str(told.value))


def test_lists_of_names_say_how_many_are_left_out():
    """Nothing is cut in silence."""
    names = [f"signal_{i:02}" for i in range(40)]
    told = str(unknown("signal", "?", names))
    shown = told.count("'signal_")
    assert told.endswith(f"and {40 - shown} more")
    assert str(unknown("signal", "?", names[:9])).count("'signal_") == 9
