"""Wrong calls of the public functions: each (name, call, what its message says)."""

import numpy as np
import pandas as pd
import sweep_examples
from scipy import stats
from small_systems import chain, function

import nlctl
from nlctl.analysis import lyapunov, paper, robustness
from nlctl.analysis.intervals.box import Box
from nlctl.analysis.metrics import Metric, peak
from nlctl.analysis.robustness import (
    Choice,
    Requirement,
    Space,
    Spec,
    Uncertain,
    always,
    in_band,
)

NAN = float("nan")
T = np.linspace(0, 1, 11)
X = Uncertain(name="x", bounds=(-1.0, 1.0), nominal=0.0)
Y = Uncertain(name="y", bounds=(-1.0, 1.0), nominal=0.0)
SPACE = Space(quantities=(X, Y))
ARM = Choice(name="arm", options={"a": 1, "b": 2})
DRAWN = robustness.independent(SPACE, 8, 1)
GOOD = function(lambda table: 1.0 - table["x"])
TWO = {"one": np.arange(8.0), "other": np.ones(8)}
WALK = robustness.morris(SPACE, 4, entropy=1)
SALTELLI = robustness.saltelli(SPACE, 4, entropy=1)


def prepared():
    return robustness.prepare(sweep_examples.experiment())


def experiment(**changes):
    return sweep_examples.experiment(**changes)


def loop():
    return chain()


def example():
    return nlctl.paper.example_1()


SQUARE = Box(names=("x1", "x2"), low=(-1.0, -1.0), high=(1.0, 1.0))

STATISTICS = {
    "clopper_pearson side": lambda: robustness.clopper_pearson(1, 5, side="Both"),
    "clopper_pearson side None": lambda: robustness.clopper_pearson(1, 5, side=None),
    "clopper_pearson confidence nan": lambda: robustness.clopper_pearson(1, 5, NAN),
    "clopper_pearson confidence text": lambda: robustness.clopper_pearson(1, 5, "0.9"),
    "clopper_pearson confidence None": lambda: robustness.clopper_pearson(1, 5, None),
    "clopper_pearson float": lambda: robustness.clopper_pearson(1.5, 5),
    "clopper_pearson many": lambda: robustness.clopper_pearson(10**18, 10**19),
    "runs_needed nan": lambda: robustness.runs_needed(NAN),
    "runs_needed text": lambda: robustness.runs_needed("0.1"),
    "runs_needed tiny": lambda: robustness.runs_needed(1e-300),
    "violation_probability side": lambda: robustness.violation_probability(
        DRAWN, np.ones(8), side="Both"
    ),
    "violation_probability design": lambda: robustness.violation_probability(None, np.ones(8)),
    "violation_probability text": lambda: robustness.violation_probability(DRAWN, ["a"] * 8),
    "violation_probability 2d": lambda: robustness.violation_probability(DRAWN, np.ones((8, 2))),
    "violation_probability empty": lambda: robustness.violation_probability(DRAWN, []),
    "violation_probability None": lambda: robustness.violation_probability(DRAWN, None),
    "confidence_sequence conf": lambda: robustness.confidence_sequence(DRAWN, np.ones(3), 1.5),
    "sequence_bounds": lambda: robustness.sequence_bounds(2, 1),
    "sequence_bounds nan": lambda: robustness.sequence_bounds(1, 2, NAN),
    "decide nan": lambda: robustness.decide(DRAWN, np.ones(3), NAN),
    "decide text": lambda: robustness.decide(DRAWN, np.ones(3), "x"),
    "until_decided": lambda: robustness.until_decided(DRAWN, 2),
    "until_decided none": lambda: robustness.until_decided(None, 0.1),
    "bound_verdict": lambda: robustness.bound_verdict(
        robustness.violation_probability(DRAWN, np.ones(8)), 2
    ),
    "differences better": lambda: robustness.differences(DRAWN, TWO, better="Smaller"),
    "differences one": lambda: robustness.differences(DRAWN, {"one": np.ones(8)}),
    "differences text": lambda: robustness.differences(DRAWN, {"one": ["a"] * 8, "b": np.ones(8)}),
    "differences list": lambda: robustness.differences(DRAWN, [np.ones(8), np.ones(8)]),
    "differences conf": lambda: robustness.differences(DRAWN, TWO, "0.9"),
    "wins better": lambda: robustness.wins(DRAWN, TWO, better=None),
    "wins design": lambda: robustness.wins(None, TWO),
    "mcnemar 2d": lambda: robustness.mcnemar(DRAWN, {"a": np.ones((8, 2)), "b": np.ones(8)}),
    "mcnemar short": lambda: robustness.mcnemar(DRAWN, {"a": np.ones(7), "b": np.ones(8)}),
    "holm": lambda: robustness.holm([0.1, 2.0]),
    "holm text": lambda: robustness.holm(["a"]),
    "censored empty": lambda: robustness.censored([]),
    "censored text": lambda: robustness.censored(["a"]),
    "elementary_effects kind": lambda: robustness.elementary_effects(DRAWN, np.ones(8)),
    "elementary_effects None": lambda: robustness.elementary_effects(WALK, None),
    "elementary_effects text": lambda: robustness.elementary_effects(WALK, ["a"] * WALK.size),
    "elementary_effects nan": lambda: robustness.elementary_effects(WALK, np.full(WALK.size, NAN)),
    "sobol_indices resamples": lambda: robustness.sobol_indices(
        SALTELLI, np.arange(SALTELLI.size), resamples=0
    ),
    "sobol_indices resamples float": lambda: robustness.sobol_indices(
        SALTELLI, np.arange(SALTELLI.size), resamples=1.5
    ),
    "sobol_indices conf": lambda: robustness.sobol_indices(
        SALTELLI, np.arange(SALTELLI.size), confidence=0
    ),
    "regional text": lambda: robustness.regional(DRAWN, ["a"] * 8),
    "regional short": lambda: robustness.regional(DRAWN, [1, -1]),
    "regional none": lambda: robustness.regional(DRAWN, None),
}
DESIGNS = {
    "independent size": lambda: robustness.independent(SPACE, 0),
    "independent float": lambda: robustness.independent(SPACE, 2.5),
    "independent huge": lambda: robustness.independent(SPACE, 10**30).table,
    "independent space": lambda: robustness.independent(None, 3),
    "independent entropy": lambda: robustness.independent(SPACE, 3, entropy="x"),
    "independent entropy neg": lambda: robustness.independent(SPACE, 3, entropy=-1),
    "from_table list": lambda: robustness.from_table(SPACE, [[0, 0]]),
    "from_table dict": lambda: robustness.from_table(SPACE, {"x": [0], "y": [0]}),
    "from_table twice": lambda: robustness.from_table(
        SPACE, pd.DataFrame([[0, 0, 0]], columns=["x", "y", "y"])
    ),
    "from_table flag": lambda: robustness.from_table(
        SPACE, pd.DataFrame({"x": [0], "y": [0]}), drawn_independently="no"
    ),
    "from_table nan": lambda: robustness.from_table(SPACE, pd.DataFrame({"x": [0], "y": [NAN]})),
    "sobol 3": lambda: robustness.sobol(SPACE, 3),
    "sobol huge": lambda: robustness.sobol(SPACE, 2**40),
    "latin huge": lambda: robustness.latin_hypercube(SPACE, 10**15),
    "latin float": lambda: robustness.latin_hypercube(SPACE, 4.0),
    "grid huge": lambda: robustness.grid(SPACE, 10**18),
    "grid float": lambda: robustness.grid(SPACE, 2.5),
    "grid text": lambda: robustness.grid(SPACE, "two"),
    "grid list": lambda: robustness.grid(SPACE, [2, 2]),
    "grid missing": lambda: robustness.grid(SPACE, {"x": 2}),
    "corners many": lambda: robustness.corners(
        Space(quantities=tuple(Uncertain(name=f"q{i}", bounds=(0, 1)) for i in range(60)))
    ),
    "one_at_a_time levels": lambda: robustness.one_at_a_time(SPACE, 1),
    "one_at_a_time nominal": lambda: robustness.one_at_a_time(
        Space(quantities=(Uncertain(name="x", bounds=(0, 1)),))
    ),
    "morris levels": lambda: robustness.morris(SPACE, 4, levels=3),
    "morris float": lambda: robustness.morris(SPACE, 4.5),
    "morris huge": lambda: robustness.morris(SPACE, 10**15),
    "saltelli one": lambda: robustness.saltelli(Space(quantities=(X,)), 4),
    "saltelli size": lambda: robustness.saltelli(SPACE, 0),
    "rows": lambda: robustness.rows(DRAWN, range(9)),
    "rows list": lambda: robustness.rows(DRAWN, [0, 1]),
    "row_seed neg": lambda: robustness.row_seed(DRAWN, -1),
    "row_seed float": lambda: robustness.row_seed(DRAWN, 1.5),
    "uncertain nothing": lambda: Uncertain(name="x"),
    "uncertain nan": lambda: Uncertain(name="x", bounds=(NAN, 1)),
    "uncertain text": lambda: Uncertain(name="x", bounds=("a", "b")),
    "uncertain number": lambda: Uncertain(name="x", bounds=3),
    "uncertain law": lambda: Uncertain(name="x", law=stats.norm),
    "uncertain law nan": lambda: Uncertain(name="x", law=stats.norm(NAN, 1)),
    "uncertain law neg": lambda: Uncertain(name="x", law=stats.norm(0, -1)),
    "uncertain nominal nan": lambda: Uncertain(name="x", bounds=(0, 1), nominal=NAN),
    "uncertain nominal text": lambda: Uncertain(name="x", bounds=(0, 1), nominal="a"),
    "uncertain name": lambda: Uncertain(name=3, bounds=(0, 1)),
    "choice list": lambda: Choice(name="a", options=["x", "y"]),
    "choice weights": lambda: Choice(name="a", options={"x": 1}, weights=(NAN,)),
    "choice weights text": lambda: Choice(name="a", options={"x": 1}, weights=("1",)),
    "choice weights number": lambda: Choice(name="a", options={"x": 1}, weights=1.0),
    "choice labels": lambda: Choice(name="a", options={1: 1, 2: 2}),
    "choice nominal": lambda: Choice(name="a", options={"x": 1}, nominal="z"),
    "space empty": lambda: Space(),
    "space scale nan": lambda: Space(quantities=(X,), scale=NAN),
    "space scale text": lambda: Space(quantities=(X,), scale="1"),
    "space not tuple": lambda: Space(quantities=X),
    "space wrong": lambda: Space(quantities=("x",)),
    "scaled nan": lambda: robustness.scaled(SPACE, NAN),
    "scaled text": lambda: robustness.scaled(SPACE, "2"),
    "nominal none": lambda: robustness.nominal(
        Space(quantities=(Uncertain(name="x", bounds=(0, 1)),))
    ),
    "arguments column": lambda: robustness.arguments(SPACE, pd.DataFrame({"x": [0.0]})),
    "arguments text": lambda: robustness.arguments(SPACE, pd.DataFrame({"x": ["a"], "y": ["b"]})),
    "resolved": lambda: robustness.resolved(SPACE, loop()),
    "resolved diagram": lambda: robustness.resolved(SPACE, None),
    "diagrams build": lambda: robustness.diagrams(SPACE, None),
    "diagrams build returns": lambda: robustness.diagrams(SPACE, lambda: 3),
    "diagrams keyword": lambda: robustness.diagrams(
        Space(quantities=(X,), choices=(ARM,)), lambda: loop()
    ),
}
SPECS = {
    "in_band nan": lambda: in_band("y", upper=NAN),
    "in_band nan lower": lambda: in_band("y", lower=NAN, upper=1.0),
    "in_band text": lambda: in_band("y", upper="1"),
    "in_band none": lambda: in_band("y"),
    "in_band signal": lambda: in_band(3, upper=1.0),
    "in_band scale nan": lambda: in_band("y", upper=1, scale=NAN),
    "in_band scale text": lambda: in_band("y", upper=1, scale="a"),
    "always nan": lambda: always(in_band("y", upper=1), NAN),
    "always text": lambda: always(in_band("y", upper=1), "0"),
    "always part": lambda: always("y <= 1"),
    "eventually part": lambda: robustness.eventually(None),
    "and": lambda: in_band("y", upper=1) & 3,
    "or": lambda: in_band("y", upper=1) | "x",
    "requirement formula": lambda: Requirement(key="a", formula="y <= 1", until=1),
    "requirement until nan": lambda: Requirement(key="a", formula=in_band("y", upper=1), until=NAN),
    "requirement until text": lambda: Requirement(
        key="a", formula=in_band("y", upper=1), until="1"
    ),
    "requirement key": lambda: Requirement(key="", formula=in_band("y", upper=1), until=1),
    "spec empty": lambda: Spec(requirements=()),
    "spec one": lambda: Spec(
        requirements=Requirement(key="a", formula=in_band("y", upper=1), until=1)
    ),
    "spec wrong": lambda: Spec(requirements=("a",)),
    "margin signal": lambda: robustness.margin(
        Requirement(key="a", formula=in_band("y", upper=1), until=1), T, {"z": T}
    ),
    "margin length": lambda: robustness.margin(
        Requirement(key="a", formula=in_band("y", upper=1), until=1), T, {"y": T[:3]}
    ),
    "margin text": lambda: robustness.margin(
        Requirement(key="a", formula=in_band("y", upper=1), until=1), T, {"y": ["a"] * 11}
    ),
    "margin order": lambda: robustness.margin(
        Requirement(key="a", formula=in_band("y", upper=1), until=1), T[::-1], {"y": T}
    ),
    "margins signals": lambda: robustness.margins(
        Spec(requirements=(Requirement(key="a", formula=in_band("y", upper=1), until=1),)), T, None
    ),
    "metric": lambda: Metric(key="a", signal="y", unit="1", meaning="", function=None),
}
EXPERIMENTS = {
    "experiment method": lambda: robustness.prepare(experiment(method="euler")),
    "experiment rtol": lambda: experiment(rtol=-1),
    "experiment rtol nan": lambda: experiment(rtol=NAN),
    "experiment atol": lambda: experiment(atol="x"),
    "experiment max_steps": lambda: experiment(max_steps=0),
    "experiment times": lambda: experiment(timepts=[0, NAN, 2]),
    "experiment times text": lambda: experiment(timepts="abc"),
    "experiment times ragged": lambda: experiment(timepts=[[0], [1, 2]]),
    "experiment late": lambda: experiment(timepts=[1, 2, 3]),
    "experiment build": lambda: robustness.prepare(experiment(build=3)),
    "experiment space": lambda: experiment(space=None),
    "experiment spec": lambda: experiment(spec=None),
    "experiment metrics": lambda: experiment(metrics=(3,)),
    "experiment inputs nan": lambda: robustness.prepare(experiment(inputs=NAN)),
    "experiment inputs text": lambda: robustness.prepare(experiment(inputs="a")),
    "prepare": lambda: robustness.prepare(None),
    "evaluate column": lambda: robustness.evaluate(
        prepared(), pd.DataFrame({"lag.rate": [1.0], "lag.gian": [1.0]})
    ),
    "evaluate list": lambda: robustness.evaluate(prepared(), [1.0]),
    "evaluate text": lambda: robustness.evaluate(
        prepared(), pd.DataFrame({"lag.rate": ["a"], "lag.gain": [1.0]})
    ),
    "evaluate nan": lambda: robustness.evaluate(
        prepared(), pd.DataFrame({"lag.rate": [NAN], "lag.gain": [1.0]})
    ),
    "evaluate inf": lambda: robustness.evaluate(
        prepared(), pd.DataFrame({"lag.rate": [np.inf], "lag.gain": [1.0]})
    ),
    "evaluate threads": lambda: robustness.evaluate(
        prepared(), pd.DataFrame({"lag.rate": [1.0], "lag.gain": [1.0]}), threads=-1
    ),
    "evaluate twice": lambda: robustness.evaluate(
        prepared(), pd.DataFrame({"lag.rate": [1.0, 2.0], "lag.gain": [1.0, 1.0]}, index=[0, 0])
    ),
    "evaluate prepared": lambda: robustness.evaluate(experiment(), pd.DataFrame()),
    "sweep design": lambda: robustness.sweep(prepared(), DRAWN),
    "sweep chunk": lambda: robustness.sweep(
        prepared(), robustness.independent(prepared().experiment.space, 3, 1), chunk=0
    ),
    "sweep threads": lambda: robustness.sweep(
        prepared(), robustness.independent(prepared().experiment.space, 3, 1), threads=0
    ),
    "sweep executor": lambda: robustness.sweep(
        prepared(), robustness.independent(prepared().experiment.space, 3, 1), executor="threads"
    ),
    "sweep resume": lambda: robustness.sweep(
        prepared(), robustness.independent(prepared().experiment.space, 3, 1), resume=True
    ),
    "load": lambda: robustness.load("/nonexistent"),
}
SEARCHES = {
    "worst_case runs": lambda: robustness.worst_case(GOOD, SPACE, 0),
    "worst_case runs float": lambda: robustness.worst_case(GOOD, SPACE, 1.5),
    "worst_case evaluate": lambda: robustness.worst_case(None, SPACE, 5),
    "worst_case evaluate wrong": lambda: robustness.worst_case(lambda table: 3, SPACE, 5),
    "worst_case evaluate column": lambda: robustness.worst_case(lambda table: table, SPACE, 5),
    "worst_case evaluate index": lambda: robustness.worst_case(
        lambda t: pd.DataFrame({"spec": np.ones(len(t))}, index=t.index + 1), SPACE, 5
    ),
    "worst_case target nan": lambda: robustness.worst_case(GOOD, SPACE, 5, target=NAN),
    "worst_case target text": lambda: robustness.worst_case(GOOD, SPACE, 5, target="a"),
    "worst_case space": lambda: robustness.worst_case(GOOD, None, 5),
    "radius tolerance": lambda: robustness.robustness_radius(GOOD, SPACE, tolerance=NAN),
    "radius largest": lambda: robustness.robustness_radius(GOOD, SPACE, np.inf),
    "radius largest text": lambda: robustness.robustness_radius(GOOD, SPACE, "4"),
    "radius confidence": lambda: robustness.robustness_radius(GOOD, SPACE, runs=5, confidence=2),
    "radius runs": lambda: robustness.robustness_radius(GOOD, SPACE, runs=0),
    "radius space": lambda: robustness.robustness_radius(GOOD, X),
    "degradation factors": lambda: robustness.degradation_curve(GOOD, SPACE, 3.0, 5),
    "degradation factors text": lambda: robustness.degradation_curve(GOOD, SPACE, "abc", 5),
    "degradation factors nan": lambda: robustness.degradation_curve(GOOD, SPACE, [1.0, NAN], 5),
    "degradation runs": lambda: robustness.degradation_curve(GOOD, SPACE, [1.0], "5"),
    "degradation flag": lambda: robustness.degradation_curve(
        GOOD, SPACE, [1.0], 5, simultaneous="yes"
    ),
    "failure_map x": lambda: robustness.failure_map(GOOD, SPACE, "z", "y"),
    "failure_map same": lambda: robustness.failure_map(GOOD, SPACE, "x", "x"),
    "failure_map cells": lambda: robustness.failure_map(GOOD, SPACE, "x", "y", cells=0),
    "failure_map levels": lambda: robustness.failure_map(GOOD, SPACE, "x", "y", levels=2.5),
    "failure_map levels huge": lambda: robustness.failure_map(GOOD, SPACE, "x", "y", levels=10**6),
    "failure_map cells huge": lambda: robustness.failure_map(GOOD, SPACE, "x", "y", cells=10**6),
    "failure_map most": lambda: robustness.failure_map(GOOD, SPACE, "x", "y", most="a"),
    "failure_map most neg": lambda: robustness.failure_map(GOOD, SPACE, "x", "y", most=-1),
    "failure_map at": lambda: robustness.failure_map(GOOD, SPACE, "x", "y", at=3),
    "failure_map at nan": lambda: robustness.failure_map(
        GOOD, Space(quantities=(X, Y, Uncertain(name="z", bounds=(0, 1)))), "x", "y", at={"z": NAN}
    ),
    "boundary": lambda: robustness.boundary(None),
    "shrink row": lambda: robustness.shrink(GOOD, SPACE, {"x": 2.0}),
    "shrink margin": lambda: robustness.shrink(GOOD, SPACE, {"x": 0.0, "y": 0.0}),
    "shrink nan": lambda: robustness.shrink(GOOD, SPACE, {"x": NAN, "y": 0.0}),
    "shrink steps": lambda: robustness.shrink(GOOD, SPACE, {"x": 2.0, "y": 0.0}, steps=-1),
    "shrink most": lambda: robustness.shrink(GOOD, SPACE, {"x": 2.0, "y": 0.0}, most="a"),
    "confirm row": lambda: robustness.confirm(prepared(), {"lag.rate": 1.0}),
    "confirm unknown": lambda: robustness.confirm(
        prepared(), {"lag.rate": 1.0, "lag.gain": 1.0, "x": 1}
    ),
    "confirm nan": lambda: robustness.confirm(prepared(), {"lag.rate": NAN, "lag.gain": 1.0}),
    "largest_scale": lambda: robustness.largest_scale(prepared(), NAN),
    "largest_scale names": lambda: robustness.largest_scale(prepared(), 2.0, ["x"]),
    "largest_scale text": lambda: robustness.largest_scale(prepared(), "4"),
    "compare metrics": lambda: robustness.compare(DRAWN, ARM, robustness.crossed(DRAWN, ARM), {}),
    "compare better": lambda: robustness.compare(
        DRAWN,
        ARM,
        robustness.crossed(DRAWN, ARM).assign(spec=1.0, status="OK", m=1.0),
        {"m": "less"},
    ),
    "compare column": lambda: robustness.compare(
        DRAWN, ARM, robustness.crossed(DRAWN, ARM), {"m": "smaller"}
    ),
    "compare list": lambda: robustness.compare(DRAWN, ARM, [1], {"m": "smaller"}),
    "compare metrics list": lambda: robustness.compare(
        DRAWN, ARM, robustness.crossed(DRAWN, ARM).assign(spec=1.0, status="OK", m=1.0), ["m"]
    ),
    "compare confidence": lambda: robustness.compare(
        DRAWN,
        ARM,
        robustness.crossed(DRAWN, ARM).assign(spec=1.0, status="OK", m=1.0),
        {"m": "smaller"},
        confidence="a",
    ),
    "crossed": lambda: robustness.crossed(DRAWN, "arm"),
    "compared controllers": lambda: paper.compared_controllers("example_3"),
    "tracking_metrics start": lambda: robustness.tracking_metrics(start=NAN, band=0.1),
    "tracking_metrics band": lambda: robustness.tracking_metrics(start=1.0, band=-1),
    "tracking_metrics text": lambda: robustness.tracking_metrics(start="1", band=0.1),
}
RUNS = {
    "compile": lambda: nlctl.compile(3),
    "compile class": lambda: nlctl.compile(nlctl.DeadZone),
    "compile loops": lambda: nlctl.compile(loop(), algebraic_loops="Solve"),
    "compile params": lambda: nlctl.compile(loop(), params=[1]),
    "response system": lambda: nlctl.input_output_response(3, T),
    "response times": lambda: nlctl.input_output_response(loop(), "abc"),
    "response times nan": lambda: nlctl.input_output_response(loop(), [0, NAN]),
    "response inputs": lambda: nlctl.input_output_response(loop(), T, "a"),
    "response X0 nan": lambda: nlctl.input_output_response(example(), T, X0={"plant.x1": NAN}),
    "response X0 text": lambda: nlctl.input_output_response(example(), T, X0={"plant.x1": "a"}),
    "response X0 native nan": lambda: nlctl.input_output_response(
        example(), T, X0=np.full(40, NAN), engine="native"
    ),
    "response params nan": lambda: nlctl.input_output_response(
        example(), T, params={"law.beta": NAN}
    ),
    "response params list": lambda: nlctl.input_output_response(example(), T, params=["law.beta"]),
    "response rtol": lambda: nlctl.input_output_response(loop(), T, rtol=-1),
    "response rtol nan": lambda: nlctl.input_output_response(loop(), T, rtol=NAN, engine="native"),
    "response rtol text": lambda: nlctl.input_output_response(loop(), T, rtol="a"),
    "response method": lambda: nlctl.input_output_response(example(), T, method="euler"),
    "response engine": lambda: nlctl.input_output_response(loop(), T, engine="fast"),
    "response audit": lambda: nlctl.input_output_response(
        loop(), T, engine="native", audit="sometimes"
    ),
    "response step": lambda: nlctl.input_output_response(loop(), T, engine="native", step=-1),
    "response max_steps": lambda: nlctl.input_output_response(
        loop(), T, engine="native", max_steps=0
    ),
    "response squeeze": lambda: nlctl.input_output_response(loop(), T, squeeze="yes"),
    "ensemble empty": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": np.array([])}
    ),
    "ensemble empty state": lambda: nlctl.ensemble_response(
        nlctl.compile(sweep_examples.loop()), T, 0.0, {"lag.x": []}
    ),
    "ensemble lengths": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": [1, 2], "second.k": [1, 2, 3]}
    ),
    "ensemble nan": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": [1, NAN]}
    ),
    "ensemble nan state": lambda: nlctl.ensemble_response(
        nlctl.compile(sweep_examples.loop()), T, 0.0, {"lag.x": [1.0, NAN]}
    ),
    "ensemble text": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": ["a"]}
    ),
    "ensemble 2d": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": np.ones((2, 2))}
    ),
    "ensemble unknown": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.kk": [1]}
    ),
    "ensemble threads": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": [1]}, threads=0
    ),
    "ensemble threads text": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": [1]}, threads="a"
    ),
    "ensemble keep": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": [1]}, keep=("zz",)
    ),
    "ensemble metrics": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": [1]}, metrics=(3,)
    ),
    "ensemble metric signal": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()),
        T,
        1.0,
        params={"first.k": [1]},
        metrics=(Metric(key="a", signal="zz", unit="1", meaning="", function=peak),),
    ),
    "ensemble system": lambda: nlctl.ensemble_response(3, T, params={"a": [1]}),
    "ensemble method": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": [1]}, method="euler"
    ),
    "ensemble rtol": lambda: nlctl.ensemble_response(
        nlctl.compile(loop()), T, 1.0, params={"first.k": [1]}, rtol=0
    ),
    "interconnect list": lambda: nlctl.interconnect(["a"]),
    "interconnect none": lambda: nlctl.interconnect({}),
    "interconnect number": lambda: nlctl.interconnect({"a": 3}),
    "interconnect 3": lambda: nlctl.interconnect(3),
    "initial_state unknown": lambda: nlctl.initial_state(example(), {"plant.x9": 1}),
    "initial_state nan": lambda: nlctl.initial_state(example(), {"plant.x1": NAN}),
    "initial_state list": lambda: nlctl.initial_state(example(), [1]),
    "initial_state system": lambda: nlctl.initial_state(3),
    "state_names": lambda: nlctl.state_names(3),
    "parameters": lambda: nlctl.parameters(3),
    "block class": lambda: nlctl.block(nlctl.DeadZone, "a"),
    "block number": lambda: nlctl.block(3, "a"),
    "block name": lambda: nlctl.block(nlctl.DeadZone(), 3),
    "block dt": lambda: nlctl.block(nlctl.DeadZone(), "a", dt="x"),
    "block dt neg": lambda: nlctl.block(nlctl.DeadZone(), "a", dt=-1),
    "draw": lambda: nlctl.draw(3),
    "adaptive_neural order": lambda: nlctl.adaptive_neural("two"),
    "adaptive_neural law": lambda: nlctl.adaptive_neural(2, law=3),
    "cascade": lambda: nlctl.actuators.cascade({}),
    "Fault kind": lambda: nlctl.Fault("v", "stuckk", at=1.0),
    "Fault signal": lambda: nlctl.Fault(3, "bias", 1.0, at=1.0),
    "Fault value": lambda: nlctl.Fault("v", "bias", "x", at=1.0),
    "Fault nan": lambda: nlctl.Fault("v", "bias", NAN, at=1.0),
    "Fault at": lambda: nlctl.Fault("v", "bias", 1.0, at="x"),
    "Fault when": lambda: nlctl.Fault("v", "bias", 1.0, when=3),
    "with_faults none": lambda: nlctl.with_faults(None),
    "with_faults block": lambda: nlctl.with_faults(nlctl.block(nlctl.DeadZone(), "a")),
    "with_faults text": lambda: nlctl.with_faults(nlctl.paper.example_1(), "v"),
    "cascade list": lambda: nlctl.actuators.cascade([nlctl.DeadZone()]),
    "cascade number": lambda: nlctl.actuators.cascade({"a": 3}),
    "param record": lambda: nlctl.record(3),
    "equation": lambda: nlctl.equation(3),
    "PureFeedback f": lambda: nlctl.PureFeedback(order=2, f=3),
    "PureFeedback initial": lambda: nlctl.PureFeedback(
        order=2, f=lambda x, v: v, initial={"x9": 1}
    ),
    "PureFeedback initial nan": lambda: nlctl.block(
        nlctl.PureFeedback(order=2, f=lambda x, v: v, initial={"x1": NAN}), "p"
    ),
    "diagonal_centres": lambda: nlctl.controllers.diagonal_centres(0, -1, 1),
    "grid_centres": lambda: nlctl.controllers.grid_centres([3, -1]),
    "latin_hypercube_centres": lambda: nlctl.controllers.latin_hypercube_centres(0, 2, seed=1),
    "replaced": lambda: nlctl.controllers.replaced(3),
    "named example": lambda: nlctl.paper.named_example("example-3"),
    "linearize": lambda: nlctl.compile(example()).linearize(np.full(31, NAN)),
}


def certified():
    return nlctl.paper.example_1(
        controller=nlctl.adaptive_neural(2, law=nlctl.controllers.KnownSignLaw()),
    )


LYAPUNOV = {
    "certify iterations": lambda: lyapunov.certify(certified(), max_iterations=0),
    "certify iterations float": lambda: lyapunov.certify(certified(), max_iterations=1.5),
    "certify loop": lambda: lyapunov.certify(3),
    "certify u_max": lambda: lyapunov.certify(certified(), u_max=NAN),
    "certify u_max neg": lambda: lyapunov.certify(certified(), u_max=-1),
    "certify tol": lambda: lyapunov.certify(certified(), tol=0.0),
    "certify W": lambda: lyapunov.certify(certified(), W=(1.0,)),
    "certify k": lambda: lyapunov.certify(certified(), k=(1.0,)),
    "certify k number": lambda: lyapunov.certify(certified(), k=1.0),
    "certify k order": lambda: lyapunov.certify(certified(), k=(2.0, 1.0)),
    "certify k nan": lambda: lyapunov.certify(certified(), k=(NAN, 1.0)),
    "slow drift response": lambda: lyapunov.slow_drift(None),
    "slow drift window": lambda: lyapunov.slow_drift(None, window=NAN),
    "examine loop": lambda: lyapunov.examine(None),
    "examine run": lambda: lyapunov.examine(example(), -1),
    "examine run nan": lambda: lyapunov.examine(example(), NAN),
    "examine run text": lambda: lyapunov.examine(example(), "20"),
    "examine step": lambda: lyapunov.examine(example(), 1.0, step=0),
    "examine step nan": lambda: lyapunov.examine(example(), 1.0, step=NAN),
    "examine max_steps": lambda: lyapunov.examine(example(), 1.0, max_steps=0),
    "examine W": lambda: lyapunov.examine(example(), 1.0, W="Tightest"),
    "examine k": lambda: lyapunov.examine(example(), 1.0, k=3),
    "examine start": lambda: lyapunov.examine(example(), 1.0, start={"plant.x1": NAN}),
    "examine start empty": lambda: lyapunov.examine(example(), 1.0, start={"plant.x1": []}),
    "ledger loop": lambda: lyapunov.ledger(3),
    "ledger setting": lambda: lyapunov.ledger(example(), 1.0, stepp=0.1),
    "sector plant": lambda: lyapunov.sector(None, SQUARE),
    "sector box": lambda: lyapunov.sector(nlctl.plants.ForcedDuffing(), None),
    "sector tol": lambda: lyapunov.sector(nlctl.plants.ForcedDuffing(), SQUARE, tol=NAN),
    "decompose actuator": lambda: lyapunov.decompose(None),
    "decompose k": lambda: lyapunov.decompose(nlctl.DeadZone(), k=(NAN, 1)),
    "decompose k order": lambda: lyapunov.decompose(nlctl.DeadZone(), k=(2, 1)),
    "decompose u_max": lambda: lyapunov.decompose(nlctl.DeadZone(), u_max=0),
    "decompose tol": lambda: lyapunov.decompose(nlctl.DeadZone(), tol=NAN),
    "clipped_split": lambda: lyapunov.clipped_split(NAN, 1.0),
    "tighten bound": lambda: lyapunov.tighten(example(), u_limit=10.0, bound="C0"),
    "tighten u_limit": lambda: lyapunov.tighten(example(), u_limit=NAN),
    "tighten evaluations": lambda: lyapunov.tighten(example(), u_limit=10.0, evaluations=0),
    "tighten horizon": lambda: lyapunov.tighten(example(), u_limit=10.0, horizon=0),
    "design u_limit": lambda: lyapunov.design(certified(), u_limit=-1),
    "design evaluations": lambda: lyapunov.design(certified(), u_limit=10.0, evaluations=0),
    "design horizon": lambda: lyapunov.design(certified(), u_limit=10.0, horizon=NAN),
    "drift": lambda: lyapunov.drift(None),
    "safe_horizon l": lambda: lyapunov.safe_horizon(1.0, 0.0, l_min=0.0, l_max=1.0),
    "safe_horizon nan": lambda: lyapunov.safe_horizon(NAN, 1.0, l_min=0.1, l_max=1.0),
    "visited_box none": lambda: lyapunov.visited_box(),
    "visited_box wrong": lambda: lyapunov.visited_box(3),
    "box order": lambda: Box(names=("x",), low=(1.0,), high=(0.0,)),
    "box nan": lambda: Box(names=("x",), low=(NAN,), high=(0.0,)),
    "box lengths": lambda: Box(names=("x",), low=(0.0, 1.0), high=(2.0,)),
    "enclose box": lambda: lyapunov.enclose(lambda x: x[0], None),
    "enclose tol": lambda: lyapunov.enclose(lambda x: x[0], SQUARE, tol=-1),
    "enclose boxes": lambda: lyapunov.enclose(lambda x: x[0], SQUARE, max_boxes=0),
    "enclose function": lambda: lyapunov.enclose(3, SQUARE),
    "prove bounds": lambda: lyapunov.prove(lambda x: x[0], SQUARE, low=1.0, high=0.0),
    "prove nan": lambda: lyapunov.prove(lambda x: x[0], SQUARE, high=NAN),
    "prove_decrease level": lambda: lyapunov.prove_decrease(
        lambda x: x[0] ** 2, lambda x: x, SQUARE, level=NAN, floor=0.0
    ),
    "nussbaum_property end": lambda: lyapunov.nussbaum_property(end=NAN),
    "nussbaum_property end neg": lambda: lyapunov.nussbaum_property(end=-1.0),
    "constants box": lambda: lyapunov.constants(example(), None),
    "disturbance times": lambda: lyapunov.disturbance(
        nlctl.plants.ForcedDuffing(), SQUARE, (1.0, 0.0)
    ),
    "disturbance number": lambda: lyapunov.disturbance(nlctl.plants.ForcedDuffing(), SQUARE, 1.0),
    "approximation_error": lambda: lyapunov.approximation_error(
        nlctl.plants.ForcedDuffing(), nlctl.controllers.GaussianBasis(), [NAN], SQUARE
    ),
    "burst_peak": lambda: lyapunov.burst_peak(None, 1.0),
    "aftermath zeta": lambda: lyapunov.aftermath(NAN),
    "aftermath kG": lambda: lyapunov.aftermath(3.0, kG=(2.0, 1.0)),
    "aftermath kG number": lambda: lyapunov.aftermath(3.0, kG=1.0),
    "read_parts": lambda: lyapunov.read_parts(3),
    "read_parts plain": lambda: lyapunov.read_parts(loop()),
    "signals_of": lambda: lyapunov.signals_of(3),
    "conservatism": lambda: lyapunov.conservatism(3),
}
GROUPS = {
    "statistics": STATISTICS,
    "designs": DESIGNS,
    "specs": SPECS,
    "experiments": EXPERIMENTS,
    "searches": SEARCHES,
    "runs": RUNS,
    "lyapunov": LYAPUNOV,
}
