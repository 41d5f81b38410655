"""Valid calls of public functions, to be made wrong one argument at a time."""

import dataclasses
import functools
import inspect
from pathlib import Path

import control as ct
import numpy as np
import pandas as pd
import studies_example
import sweep_examples
from small_systems import chain, function

import nlctl
from nlctl.analysis import figures, lyapunov, metrics, paper, report, robustness, studies
from nlctl.analysis.intervals.box import Box
from nlctl.analysis.loop_report import loop_report
from nlctl.analysis.robustness import Choice, Requirement, Space, Spec, Uncertain, always, in_band


def public_things():
    """What nlctl has at its top and in its rooms, each once."""
    top = [getattr(nlctl, name) for name in dir(nlctl)]
    rooms = [thing for thing in top if inspect.ismodule(thing)]
    inside = [getattr(room, name) for room in rooms for name in room.__all__]
    found = {id(thing): thing for thing in (*top, *inside)}.values()
    return sorted(found, key=lambda thing: getattr(thing, "__name__", ""))


T = np.linspace(0.0, 1.0, 11)
X = Uncertain(name="x", bounds=(-1.0, 1.0), nominal=0.0)
Y = Uncertain(name="y", bounds=(-1.0, 1.0), nominal=0.0)
SPACE = Space(quantities=(X, Y))
ARM = Choice(name="arm", options={"a": 1, "b": 2})
GOOD = function(lambda table: 1.0 - table["x"])
TABLE = pd.DataFrame({"x": [0.0, 0.5], "y": [0.0, 0.5]})
UPPER = in_band("y", upper=1.0)
ASK = Requirement(key="a", formula=always(UPPER), until=1.0)
SPEC = Spec(requirements=(ASK,))
TWO = {"one": np.arange(8.0), "other": np.ones(8)}
SIGNALS = {"y": np.sin(T)}
CUBE = Box(names=("x1", "x2", "x3", "v"), low=(-1.0,) * 4, high=(1.0,) * 4)
SQUARE = Box(names=("x1", "x2"), low=(-1.0, -1.0), high=(1.0, 1.0))
drawn = functools.cache(lambda: robustness.independent(SPACE, 8, 1))
prepared = functools.cache(lambda: robustness.prepare(sweep_examples.experiment()))
saltelli = functools.cache(lambda: robustness.saltelli(SPACE, 4, entropy=1))
walk = functools.cache(lambda: robustness.morris(SPACE, 4, entropy=1))
example = functools.cache(lambda: nlctl.paper.example_1())
proof_box = functools.cache(lambda: lyapunov.visited_box(short_run()))


@functools.cache
def lag():
    """A lag as nlctl's record, and one as a third-party block, connected."""
    plant = ct.nlsys(lambda t, x, u, p: [p["k"] * u[0] - x[0]], None, inputs="v", outputs="y",
                     states=1, params={"k": 2.0}, name="plant")  # fmt: skip
    return nlctl.interconnect({"law": nlctl.Saturation(), "plant": plant}, inputs=["u"])


@functools.cache
def ready():
    return nlctl.compile(lag())


@functools.cache
def short_run():
    return nlctl.input_output_response(example(), np.linspace(0, 0.2, 21))


@functools.cache
def crossed():
    table = robustness.crossed(drawn(), ARM)
    return table.assign(spec=1.0, status="OK", m=1.0)


NLCTL = {
    nlctl.interconnect: lambda: {"blocks": {"a": nlctl.Gain()}, "inputs": ["u"], "outputs": ["v"],
                                 "name": "d"},
    nlctl.block: lambda: {"spec": nlctl.Lag(), "name": "lag", "dt": None},
    nlctl.actuators.cascade: lambda: {"stages": {"lag": nlctl.Lag(), "dead": nlctl.DeadZone()},
                            "name": "c"},
    nlctl.compile: lambda: {"system": chain(), "params": {"first.k": 1.0},
                            "algebraic_loops": "error"},
    nlctl.linearize: lambda: {"system": lag(), "x0": [0.1], "u0": [0.0], "t": 0.0,
                              "params": {"plant.k": 1.0}, "copy_names": True},
    nlctl.input_output_response: lambda: {
        "system": lag(), "timepts": T, "inputs": 1.0, "initial_state": [0.0],
        "params": {"plant.k": 1.0}, "engine": "auto", "method": "tsit5", "rtol": 1e-6,
        "atol": 1e-8, "evaluation_times": T, "squeeze": None, "transpose": False,
        "ignore_errors": False, "max_steps": 1000, "max_step": None, "audit": True},
    nlctl.ensemble_response: lambda: {
        "compiled": lag(), "timepts": T, "inputs": 1.0, "initial_state": {"plant.x[0]": 0.0},
        "params": {"plant.k": np.array([1.0, 2.0])}, "metrics": (), "keep": ["y"], "threads": 1,
        "rtol": 1e-6, "atol": 1e-8, "max_steps": 1000, "method": None},
    nlctl.initial_state: lambda: {"system": lag(), "values": {"plant.x[0]": 1.0}},
    nlctl.parameters: lambda: {"system": lag()},
    nlctl.state_names: lambda: {"system": lag()},
    nlctl.typeset: lambda: {"system": lag(), "values": True, "params": {"plant.k": 1.0}},
    nlctl.draw: lambda: {"diagram": lag(), "title": "a", "expand": False},
    nlctl.sampled: lambda: {"system": nlctl.Lag(), "dt": 0.1, "offset": 0.0, "delay": 0.01,
                            "jitter": None, "seed": 0, "input_quantum": None,
                            "output_quantum": None, "method": "euler", "waiting": None},
    nlctl.discretise: lambda: {"system": ct.ss(-1, 1, 1, 0), "dt": 0.1, "method": "euler"},
    nlctl.with_faults: lambda: {"diagram": lag()},
    nlctl.adaptive_neural: lambda: {"order": 2, "filtered_error": None, "basis": None,
                                    "weights": None, "robust": None, "law": None, "name": "c"},
    nlctl.mrac: lambda: {"model": nlctl.controllers.ReferenceModel(), "error": None,
                         "basis": None, "weights": None, "law": None, "name": "c"},
    nlctl.l1_adaptive: lambda: {"predictor": nlctl.controllers.StatePredictor(), "error": None,
                                "basis": None, "weights": None, "law": None, "name": "c"},
    nlctl.sliding_mode: lambda: {"filtered_error": None, "law": None, "name": "c"},
    nlctl.dynamic_surface_control: lambda: {
        "surface": nlctl.controllers.DynamicSurface(), "basis": None, "weights": None, "law": None,
        "name": "c"},
    nlctl.controllers.ablations: lambda: {"controller": nlctl.adaptive_neural(), "kappa": 10.0},
    nlctl.controllers.replaced: lambda: {"controller": nlctl.adaptive_neural(),
                                         "robust": nlctl.controllers.RobustTerm()},
    nlctl.controllers.diagonal_centres: lambda: {"count": 3, "inputs": 2, "low": -1.0, "high": 1.0},
    nlctl.controllers.grid_centres: lambda: {"counts": [2, 2], "low": -1.0, "high": 1.0},
    nlctl.controllers.latin_hypercube_centres: lambda: {"count": 3, "inputs": 2, "low": -1.0,
                                                        "high": 1.0, "seed": 1},
    nlctl.actuators.relay_grid: lambda: {"levels": [-1.0, 0.0, 1.0]},
    nlctl.param: lambda: {"default": 1.0, "unit": "1", "meaning": "gain", "above": 0.0,
                          "below": 2.0, "at_least": None, "at_most": None, "symbol": "k",
                          "may_be_empty": False},
    nlctl.record: lambda: {"cls": type("Own", (), {})},
    nlctl.paper.example_1: lambda: {"plant": None, "actuator": None, "controller": None,
                                    "reference": None, "sensor": None, "centres": None,
                                    "p1": None, "phase": None, "name": "e"},
    nlctl.paper.example_2: lambda: {"lambdas": None, "v0": None, "name": "e"},
    nlctl.paper.named_example: lambda: {"name": "example-1"},
    nlctl.native.uninterrupted: lambda: {"response": short_run()},
}  # fmt: skip
RECORDS = {
    kind: lambda kind=kind: {
        field.name: field.default
        for field in kind.__dataclass_fields__.values()
        if field.init and field.default is not dataclasses.MISSING
    }
    for kind in public_things()
    if isinstance(kind, type) and "nlctl" in str(
        [f.metadata for f in getattr(kind, "__dataclass_fields__", {}).values()])
}  # fmt: skip
DESIGNS = {
    robustness.independent: lambda: {"space": SPACE, "size": 4, "entropy": 1},
    robustness.latin_hypercube: lambda: {"space": SPACE, "size": 4, "entropy": 1},
    robustness.sobol: lambda: {"space": SPACE, "size": 4, "entropy": 1},
    robustness.saltelli: lambda: {"space": SPACE, "size": 4, "entropy": 1},
    robustness.grid: lambda: {"space": SPACE, "levels": 2, "entropy": 1},
    robustness.corners: lambda: {"space": SPACE, "entropy": 1},
    robustness.one_at_a_time: lambda: {"space": SPACE, "levels": 2, "entropy": 1},
    robustness.morris: lambda: {"space": SPACE, "trajectories": 4, "levels": 4, "entropy": 1},
    robustness.from_table: lambda: {"space": SPACE, "table": TABLE, "drawn_independently": True,
                                    "entropy": 1},
    robustness.rows: lambda: {"design": drawn(), "numbers": range(2)},
    robustness.row_seed: lambda: {"design": drawn(), "row": 1},
    robustness.seed_number: lambda: {"design": drawn(), "row": 1},
    robustness.nominal: lambda: {"space": SPACE},
    robustness.scaled: lambda: {"space": SPACE, "factor": 2.0},
    robustness.arguments: lambda: {"space": prepared().experiment.space, "table": pd.DataFrame(
        {"lag.rate": [1.0], "lag.gain": [1.0]})},
    robustness.resolved: lambda: {"space": prepared().experiment.space,
                                  "diagram": sweep_examples.loop()},
    robustness.diagrams: lambda: {"space": prepared().experiment.space,
                                  "build": sweep_examples.loop},
    robustness.crossed: lambda: {"design": drawn(), "choice": ARM},
    Uncertain: lambda: {"name": "x", "bounds": (0.0, 1.0), "nominal": 0.5},
    Choice: lambda: {"name": "a", "options": {"x": 1, "y": 2}, "weights": (0.5, 0.5),
                     "nominal": "x"},
    Space: lambda: {"quantities": (X,), "choices": (ARM,), "scale": 1.0},
    Requirement: lambda: {"key": "a", "formula": always(UPPER), "until": 1.0},
    Spec: lambda: {"requirements": (ASK,)},
    metrics.Metric: lambda: {"key": "a", "signal": "y", "unit": "1", "meaning": "m",
                             "function": metrics.peak},
    Box: lambda: {"names": ("x", "y"), "low": (0.0, 0.0), "high": (1.0, 1.0)},
    in_band: lambda: {"signal": "y", "lower": 0.0, "upper": 1.0, "scale": 1.0},
    always: lambda: {"part": UPPER, "start": 0.0, "end": 1.0},
    robustness.eventually: lambda: {"part": UPPER, "start": 0.0, "end": 1.0},
    robustness.margin: lambda: {"requirement": ASK, "t": T, "signals": SIGNALS, "breaks": [0.5]},
    robustness.margins: lambda: {"spec": SPEC, "t": T, "signals": SIGNALS, "breaks": [0.5]},
    robustness.unfinished_margin: lambda: {"time": 0.5, "until": 1.0},
    robustness.tracking_metrics: lambda: {"start": 1.0, "band": 0.1, "swing": 0.01, "error": "e",
                                          "control": "u", "actuated": "v", "weights": "W_norm",
                                          "gain": "zeta"},
}  # fmt: skip
STATISTICS = {
    robustness.clopper_pearson: lambda: {"violations": 1, "runs": 5, "confidence": 0.9,
                                         "side": "upper"},
    robustness.runs_needed: lambda: {"probability": 0.1, "confidence": 0.9, "violations": 0},
    robustness.violation_probability: lambda: {"design": drawn(), "margins": np.ones(8),
                                               "confidence": 0.9, "side": "upper"},
    robustness.confidence_sequence: lambda: {"design": drawn(), "margins": np.ones(8),
                                             "confidence": 0.9},
    robustness.sequence_bounds: lambda: {"violations": 1, "runs": 5, "confidence": 0.9},
    robustness.decide: lambda: {"design": drawn(), "margins": np.ones(8), "threshold": 0.1,
                                "confidence": 0.9},
    robustness.until_decided: lambda: {"design": drawn(), "threshold": 0.1, "confidence": 0.9},
    robustness.bound_verdict: lambda: {
        "statement": robustness.violation_probability(drawn(), np.ones(8)), "limit": 0.5},
    robustness.test_verdict: lambda: {"test": robustness.decide(drawn(), np.ones(8), 0.1)},
    robustness.differences: lambda: {"design": drawn(), "outcomes": TWO, "confidence": 0.9,
                                     "better": "smaller"},
    robustness.wins: lambda: {"design": drawn(), "outcomes": TWO, "better": "smaller"},
    robustness.mcnemar: lambda: {"design": drawn(), "margins": TWO},
    robustness.holm: lambda: {"p_values": np.array([0.1, 0.2])},
    robustness.censored: lambda: {"margins": np.ones(8)},
    robustness.elementary_effects: lambda: {"design": walk(), "values": np.arange(walk().size),
                                            "confidence": 0.9},
    robustness.sobol_indices: lambda: {"design": saltelli(), "values": np.arange(saltelli().size),
                                       "confidence": 0.9, "resamples": 9},
    robustness.regional: lambda: {"design": drawn(), "margins": [1, -1] * 4},
    robustness.compare: lambda: {"design": drawn(), "choice": ARM, "table": crossed(),
                                 "metrics": {"m": "smaller"}, "spec": "spec", "confidence": 0.9},
}  # fmt: skip
SEARCHES = {
    robustness.prepare: lambda: {"experiment": sweep_examples.experiment()},
    robustness.evaluate: lambda: {"prepared": prepared(), "table": pd.DataFrame(
        {"lag.rate": [1.0], "lag.gain": [1.0]}), "threads": 1, "progress": None},
    robustness.sweep: lambda: {
        "prepared": prepared(), "design": robustness.independent(prepared().experiment.space, 3, 1),
        "folder": None, "executor": None, "chunk": None, "resume": False, "threads": 1,
        "progress": None, "stop": None, "identity": None},
    robustness.load: lambda: {"folder": "nowhere", "design": None},
    robustness.worst_case: lambda: {"evaluate": GOOD, "space": SPACE, "runs": 5, "entropy": 1,
                                    "target": None},
    robustness.robustness_radius: lambda: {"evaluate": GOOD, "space": SPACE, "largest": 2.0,
                                           "limit": "", "runs": 5, "tolerance": 0.1, "draws": 5,
                                           "confidence": 0.9, "entropy": 1},
    robustness.degradation_curve: lambda: {"evaluate": GOOD, "space": SPACE, "factors": [1.0, 2.0],
                                           "runs": 5, "entropy": 1, "confidence": 0.9,
                                           "simultaneous": False},
    robustness.failure_map: lambda: {"evaluate": GOOD, "space": SPACE, "x": "x", "y": "y",
                                     "at": None, "cells": 2, "levels": 1, "most": 50},
    robustness.boundary: lambda: {"made": robustness.failure_map(GOOD, SPACE, "x", "y", cells=2,
                                                                 levels=1)},
    robustness.shrink: lambda: {"evaluate": GOOD, "space": SPACE, "row": {"x": 2.0, "y": 0.5},
                                "steps": 2, "most": 20},
    robustness.confirm: lambda: {"prepared": prepared(), "row": {"lag.rate": 1.0, "lag.gain": 1.0},
                                 "python_control": False},
    robustness.largest_scale: lambda: {"prepared": prepared(), "at_most": 2.0, "names": None},
}  # fmt: skip
METRICS = {
    function: lambda function=function: {
        name: {"t": T, "y": np.sin(T), "start": 0.0, "end": 0.5, "lower": 0.0, "upper": 1.0,
               "band": 0.1, "breaks": None, "share": 0.25, "above": 0.0}[name]
        for name in inspect.signature(function).parameters}
    for function in (
        metrics.absolute_integral, metrics.final, metrics.highest, metrics.integral,
        metrics.lowest, metrics.over, metrics.peak, metrics.reversals, metrics.rms,
        metrics.settling_time, metrics.spread, metrics.square_integral,
        metrics.time_weighted_integral, metrics.time_within, metrics.total_variation,
        metrics.ultimate_bound)
}  # fmt: skip
PARAGRAPH = report.Paragraph(text="a")
FIGURE = functools.cache(lambda: figures.margins_figure(np.ones(8)))


def page():
    section = report.Section(key="a", title="b", items=(PARAGRAPH,))
    return report.Report(title="a", verdict="b", claims=(), sections=(section,), command="c")


PAGES = {
    report.Report: lambda: {
        "title": "a", "verdict": "b", "claims": (), "sections": (), "command": "c",
        "provenance": {"a": "b"}, "numbers": {"a": 1.0}, "methods": ("a",), "limits": ("a",)},
    report.Section: lambda: {"key": "a", "title": "b", "items": (PARAGRAPH,), "level": 2,
                             "folded": False},
    report.Table: lambda: {"caption": "a", "columns": ("x",), "rows": (("1",),), "status": "",
                           "folded": False},
    report.Claim: lambda: {"text": "a", "measured": "1", "limit": "2", "holds": True,
                           "evidence": "b", "margin": "", "status": "", "by": ""},
    report.Paragraph: lambda: {"text": "a", "code": ""},
    report.Figure: lambda: {"key": "a", "caption": "b", "description": "c", "figure": FIGURE()},
    report.Equation: lambda: {"latex": "x", "number": "1"},
    report.compare_contents: lambda: {"first": "nowhere", "second": "nowhere", "rtol": 0.0},
    report.file_hashes: lambda: {"paths": []},
    report.framed: lambda: {"report": page()},
    report.render_html: lambda: {"report": page(), "interactive": False, "pool": None},
    report.render_json: lambda: {"report": page()},
    report.write_report: lambda: {"report": page(), "folder": "page", "interactive": False,
                                  "force": True},
    loop_report: lambda: {"loop": lag(), "title": "a", "response": None, "signals": (),
                          "params": None, "sections": (), "claims": (), "question": "",
                          "author": "", "revision": ""},
    studies.from_toml: lambda: {"text": studies_example.HEAD + studies_example.ROWS, "kinds": None},
    studies.load_result: lambda: {"folder": Path("nowhere"), "trust": False},
    studies.origin_differences: lambda: {"first": Path("nowhere"), "second": Path("nowhere")},
    studies.run_differences: lambda: {"first": Path("nowhere"), "second": Path("nowhere")},
    studies.read_study: lambda: {"path": Path("nowhere"), "settings": (), "folder": None,
                                 "trust": False, "received": False},
    studies.replay: lambda: {"folder": Path("nowhere"), "row": 1, "part": "", "trust": False},
    studies.shipped: lambda: {"name": "example-1"},
    studies.verify: lambda: {"folder": Path("nowhere")},
    paper.compared_controllers: lambda: {"example": "example_1"},
    paper.sample_times: lambda: {"horizon": 20.0},
}  # fmt: skip
FIGURES = {
    figures.bounds: lambda: {"values": {"a": (1.0, "b")}},
    figures.fans: lambda: {"time": T, "signals": {"y": np.zeros((5, 11))}, "nominal": SIGNALS,
                           "worst": SIGNALS, "units": {"y": "1"}, "groups": ()},
    figures.fault_margins: lambda: {"margin": pd.Series([1.0, 2.0], index=["a", "b"])},
    figures.lyapunov_bound: lambda: {"t": T, "curves": {"V": T}},
    figures.margins_figure: lambda: {"values": np.ones(8)},
    figures.most_frequent: lambda: {"groups": ["a", "b"]},
    figures.quantile: lambda: {"samples": np.ones((5, 11)), "part": 0.5, "missing": 0.0},
    figures.search: lambda: {"lowest": np.ones(8), "searchers": ["a"] * 8},
    figures.windowed_maximum: lambda: {"time": T, "y": T, "window": 0.5},
    figures.degradation: lambda: {
        "curve": robustness.degradation_curve(GOOD, SPACE, [1.0], 5, entropy=1).table,
        "at": None, "limit": None},
    figures.screening: lambda: {
        "effects": robustness.elementary_effects(walk(), np.arange(float(walk().size)))},
}  # fmt: skip
PROOFS = {
    lyapunov.enclose: lambda: {"function": lambda x: x[0] * x[1], "box": SQUARE, "tol": 1e-2,
                               "max_boxes": 100},
    lyapunov.prove: lambda: {"function": lambda x: x[0] * x[1], "box": SQUARE, "low": -2.0,
                             "high": 2.0, "max_boxes": 100},
    lyapunov.prove_decrease: lambda: {
        "V": lambda x: x[0] * x[0] + x[1] * x[1], "gradient": None,
        "rhs": lambda x: (-x[0], -x[1]), "box": SQUARE, "level": 0.5, "floor": 0.1,
        "max_boxes": 1000},
    lyapunov.decompose: lambda: {"actuator": nlctl.DeadZone(), "k": None, "u_max": 10.0,
                                 "tol": 1e-2},
    lyapunov.clipped_split: lambda: {"k_1": 0.5, "k_2": 2.0},
    lyapunov.sharpest: lambda: {"split": lyapunov.decompose(nlctl.DeadZone(), u_max=10.0)},
    lyapunov.read_parts: lambda: {"loop": example(), "start": None, "params": None},
    lyapunov.safe_horizon: lambda: {"V_0": 1.0, "alpha_0": 1.0, "l_min": 0.5, "l_max": 2.0,
                                    "zeta_0": 1.0},
    lyapunov.drift: lambda: {"response": short_run()},
    lyapunov.nussbaum_property: lambda: {"end": 10.0},
    lyapunov.signals_of: lambda: {"response": short_run()},
    lyapunov.sector: lambda: {"plant": nlctl.plants.Genesio(), "box": CUBE, "tol": 1.0,
                              "max_boxes": 100},
    lyapunov.disturbance: lambda: {"plant": nlctl.plants.ForcedDuffing(), "box": SQUARE,
                                   "times": (0.0, 1.0), "tol": 1.0},
    lyapunov.slow_drift: lambda: {"response": short_run(), "loop": None, "window": 0.03, "skip": 1,
                                  "kG": 1.0},
    lyapunov.certify: lambda: {"loop": lag(), "params": None, "inputs": None, "starts": None,
                               "k": None, "W": None, "u_max": 20.0, "tol": 0.1,
                               "max_iterations": 2},
    lyapunov.constants: lambda: {"loop": lag(), "box": SQUARE, "W": None, "k": None,
                                 "times": (0.0, 1.0), "start": None, "params": None, "tol": 0.1},
    lyapunov.examine: lambda: {"loop": lag(), "run": 1.0, "box": None, "W": "tightest", "k": None,
                               "start": None, "params": None, "step": 0.1, "max_steps": 100},
    lyapunov.ledger: lambda: {"loop": lag(), "run": 1.0},
    lyapunov.conservatism: lambda: {"loop": lag(), "run": 1.0},
    lyapunov.design: lambda: {"loop": lag(), "u_limit": 1.0, "k": None, "u_max": 10.0,
                              "horizon": 1.0, "evaluations": 2, "max_steps": 100},
    lyapunov.tighten: lambda: {"loop": lag(), "u_limit": 1.0, "bound": "C_0", "horizon": 1.0,
                               "k": None, "evaluations": 2, "max_steps": 100},
}  # fmt: skip
METHODS = {
    Box.of: lambda: {"x1": (-1.0, 1.0), "x2": (0.0, 1.0)},
    SQUARE.times: lambda: {"name": "x3", "low": 0.0, "high": 1.0},
    ready().dynamics: lambda: {"t": 0.0, "x": (0.5,), "u": (1.0,), "params": None},
    ready().output: lambda: {"t": 0.0, "x": (0.5,), "u": (1.0,), "params": None},
    ready().parameter_vector: lambda: {"params": {"plant.k": 3.0}},
    ready().parameter_jacobian: lambda: {
        "parameters": ["plant.k"], "x0": (0.5,), "u0": (1.0,), "t": 0.0, "params": None},
    ready().linearize: lambda: {
        "x0": (0.5,), "u0": (1.0,), "t": 0.0, "params": None, "copy_names": True},
    nlctl.sampling.Sampled: lambda: {
        "inner": nlctl.block(nlctl.Lag(), "lag"),
        "sampling": nlctl.block(nlctl.sampling.Sampling(dt=0.1), "sampling"), "euler": True,
        "delays": False, "converters": ("", "")},
    lyapunov.aftermath: lambda: {"zeta": 2.0, "kG": (1.0, 1.0), "energy": 0.0, "drag": 0.0},
}  # fmt: skip

GROUPS = {
    "nlctl": NLCTL, "records": RECORDS, "designs": DESIGNS, "statistics": STATISTICS,
    "searches": SEARCHES, "metrics": METRICS, "pages": PAGES, "figures": FIGURES,
    "proofs": PROOFS, "methods": METHODS,
}  # fmt: skip
