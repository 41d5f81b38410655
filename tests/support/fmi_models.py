"""Diagrams that become FMUs, and FMPy's runs of these."""

import control as ct
import numpy as np
from closed_form_runs import Ball
from extras import needed

import nlctl


def linear():
    """Two states, no event."""
    A, B, C = [[0, 1], [-4, -0.3]], [[0], [1]], [[1, 0]]
    return ct.ss(A, B, C, 0, name="linear", inputs="u", outputs="y"), {"linear.x[0]": 1.0}, 10.0


def bouncing():
    return nlctl.block(Ball(), "ball"), {}, 3.0


def sampled_pid():
    """An unstable plant that a computer holds every 50 ms, with two rates."""
    plant = ct.ss([[0, 1], [1, -0.2]], [[0], [1]], [[1, 0]], 0, inputs="u", outputs="y",
                  name="plant")  # fmt: skip
    pid = nlctl.block(nlctl.PID2(k_p=8.0, k_i=3.0, k_d=4.0), "law", inputs={"ref": "w"})
    law = nlctl.sampled(pid, 0.05, method="euler")
    slow = nlctl.sampled(ct.ss([], [], [], 0.5, 0.2, inputs="y", outputs="w", name="slow"))
    return (
        nlctl.interconnect({"plant": plant, "law": law, "slow": slow}, outputs=["y", "u"]),
        {"plant.x[0]": 1.0}, 5.0,
    )  # fmt: skip


def with_delay():
    """A computer whose outputs follow two and a half samples later."""
    plant = ct.ss([[0, 1], [-1, -0.5]], [[0], [1]], [[1, 0]], 0, inputs="u", outputs="y",
                  name="plant")  # fmt: skip
    law = ct.ss(1.0, 0.1, -0.3, -0.5, 0.1, inputs="y", outputs="u", name="law")
    loop = nlctl.interconnect(
        {"plant": plant, "law": nlctl.sampled(law, delay=0.25)}, outputs=["y", "u"]
    )
    return loop, {"plant.x[0]": 1.0}, 5.0


def with_backlash(actuator=nlctl.Backlash):
    plant = ct.ss([[0, 1], [-1, -0.5]], [[0], [1]], [[1, 0]], 0, inputs="v", outputs="y",
                  name="plant")  # fmt: skip
    drive = ct.nlsys(None, lambda t, x, u, p: 2.5 * np.sin(1.3 * t) - 0.5 * u[0], inputs=["y"],
                     outputs=["u"], name="drive")  # fmt: skip
    gap = nlctl.block(actuator(), "gap")
    return (
        nlctl.interconnect({"drive": drive, "gap": gap, "plant": plant}, outputs=["y", "v"]),
        {},
        20.0,
    )


def kicked():
    """Conditions of t alone, and dry friction."""

    def rates(t, x, u, params):
        return [x[1], -x[0] + (10.0 if 2 <= t < 2.3 else 0.0) - 0.3 * np.sign(x[1])]

    system = ct.nlsys(rates, lambda t, x, u, p: x[0], inputs=0, outputs=["y"], states=2,
                      name="kicked")  # fmt: skip
    return system, {"kicked.x[0]": 1.0}, 10.0


def with_relay():
    """A relay with hysteresis in a loop: a memory that jumps."""
    plant = ct.ss([[0, 1], [-2, -1]], [[0], [-1]], [[1, 0]], 0, inputs="v", outputs="u",
                  name="plant")  # fmt: skip
    relay = nlctl.block(nlctl.Relay(on=0.1, off=-0.1), "relay")
    return nlctl.interconnect({"relay": relay, "plant": plant}, outputs=["u", "v"]), {}, 10.0


MODELS = {
    "example 1": lambda: (nlctl.paper.example_1(), {}, 20.0),
    "example 2": lambda: (nlctl.paper.example_2(), {}, 20.0),
    "linear": linear,
    "bouncing ball": bouncing,
    "sampled PID": sampled_pid,
    "backlash": with_backlash,
    "kicked": kicked,
    "relay": with_relay,
    "delay of a computer": with_delay,
    "Preisach": lambda: with_backlash(nlctl.actuators.Preisach),
    "plays": lambda: with_backlash(nlctl.actuators.PrandtlIshlinskii),
}


def simulated(path, kind, end, *, points=200, tolerance=1e-11, **more):
    """Return FMPy's run of an FMU and the names of its outputs."""
    fmpy = needed("fmpy", "export")
    found = fmpy.read_model_description(str(path))
    outputs = [v.name for v in found.modelVariables if v.causality == "output"]
    run = fmpy.simulate_fmu(
        str(path), stop_time=end, fmi_type=kind, relative_tolerance=tolerance,
        output_interval=end / points, **{"record_events": False, **more},
    )  # fmt: skip
    return run, outputs


def check_bounces(ball, e):
    """A ball that falls from 1 m and keeps a part `e` of its speed bounces when it must."""
    run = nlctl.input_output_response(ball, [0.0, 1.5], 0, engine="python-control")
    exact = np.sqrt(2.0 / 9.81) * (1.0 + 2.0 * np.cumsum([0.0, e, e**2]))
    falls = run.events["time"][run.events["direction"] == "falling"].unique()
    assert all(np.abs(falls - t).min() < 1e-8 for t in exact[exact < 1.5])
