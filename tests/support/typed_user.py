"""What a user writes in a strict editor: every name of nlctl in it has a type."""

from typing import Any

import numpy as np

import nlctl
from nlctl.analysis.lyapunov import certify, examine
from nlctl.analysis.metrics import rms
from nlctl.analysis.robustness import Requirement, Spec, always, in_band, margin
from nlctl.analysis.studies import load_result, read_study, run


@nlctl.equation
def pendulum(x: Any, v: Any) -> Any:
    x1, x2 = x
    return -9.81 * np.sin(x1) - 0.1 * x2 + (2 + np.cos(x1)) * v


@nlctl.record
class SoftSaturation:
    limit: float = nlctl.param(20.0, unit="N m", meaning="largest torque", above=0)
    inputs, outputs, states, feedthrough = ("u",), ("v",), (), True

    @staticmethod
    @nlctl.equation
    def output(t: float, x: Any, u: Any, p: Any) -> Any:
        return (p.limit * np.tanh(u[0] / p.limit),)


blocks = {
    "reference": nlctl.SumOfSines(order=2),
    "plant": nlctl.PureFeedback(order=2, f=pendulum, initial={"x1": 0.5}),
    "controller": nlctl.adaptive_neural(order=2),
    "actuator": SoftSaturation(limit=30.0),
}
loop = nlctl.interconnect(blocks, outputs=["e", "u"])
times = np.linspace(0, 20, 2001)
response = nlctl.input_output_response(loop, times, params={"actuator.limit": 25.0})
print(rms(response.time, response.outputs[0]), response.statistics, response.events.shape)
compiled = nlctl.compile(loop)
linear, members = compiled.linearize({"plant.x1": 0.5}), nlctl.ensemble_response(loop, times)
print(linear, members.signals, members.table.shape, nlctl.block(SoftSaturation(), "one"))
print(nlctl.parameters(loop).shape, nlctl.typeset(loop), nlctl.initial_state(loop))
print(certify(loop).holds, examine(loop), always(in_band("e", upper=0.2)), Spec, margin)
gains = {"law.beta": (1.0, 4.0)}
tracks = Requirement(key="tracks", formula=always(in_band("e", upper=0.2)), until=20)
slopes = nlctl.sensitivity_response(loop, times, with_respect_to="law.beta")
fitted = nlctl.fit(loop, times, {"e": response.outputs[0]}, {"law.beta": 1.0})
again = nlctl.Measurement(data={"e": response.outputs[0]}, timepts=times, name="again")
refitted = nlctl.fit(loop, data=[again, again.data], timepts=times, parameters={"law.beta": 1.0})
tuned = nlctl.tune(loop, gains, Spec(requirements=(tracks,)))
print(slopes["e", "law.beta"].shape, fitted["law.beta"], fitted.values, refitted, tuned)
law = nlctl.sampled(nlctl.PID2(), 0.01, method="euler")
print(law, nlctl.discretise(nlctl.block(nlctl.Lag(), "lag"), 0.01), nlctl.draw(loop))
print(nlctl.frequency_response(loop, [1.0]), nlctl.find_operating_point(loop), members.plot())
result = run(read_study("arm.toml"), "reports/arm")
print(result.verdict, load_result("reports/arm").rows)
