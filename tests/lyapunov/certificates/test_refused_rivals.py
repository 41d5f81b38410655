"""What `certify` has no proof for it refuses, with the name of the law."""

import pytest

import nlctl
from nlctl.analysis.lyapunov import certify
from nlctl.analysis.paper.rivals import rival_controllers
from nlctl.errors import DiagramError

LAWS = {
    "paper": "NussbaumLaw",
    "PID": "PID",
    "super-twisting": "SuperTwistingLaw",
    "dynamic surface": "ModelReferenceLaw",
    "prescribed performance": "PrescribedPerformance",
    "funnel": "FunnelControl",
}


@pytest.mark.parametrize("label", LAWS)
@pytest.mark.parametrize("example", ["example_1", "example_2"])
def test_a_rival_without_a_proof_is_refused(example, label):
    loop = getattr(nlctl.paper, example)(controller=rival_controllers(example)[label])
    said = f"got {LAWS[label]} as 'controller.* and no ReferenceModel"
    with pytest.raises(DiagramError, match=said):
        certify(loop)


def test_l1_adaptive_control_is_refused():
    controller = nlctl.l1_adaptive(
        nlctl.controllers.StatePredictor(a=(3.0,), gain=3.0),
        basis=nlctl.controllers.AffineRegressor(order=1),
        weights=nlctl.controllers.ProjectedWeights(nodes=2, Gamma=1000.0, W_max=10.0),
        law=nlctl.controllers.FilteredLaw(omega=5.0, b=3.0, gain=3.0),
    )
    blocks = {
        "reference": nlctl.SumOfSines(order=0),
        "plant": nlctl.PureFeedback(order=1, f=lambda x, v: x[0] + v),
        "controller": controller,
        "actuator": nlctl.Gain(),
    }
    with pytest.raises(DiagramError, match="got FilteredLaw as"):
        certify(nlctl.interconnect(blocks, outputs=["x1"]))


def test_concurrent_learning_and_a_constrained_input_are_refused():
    """Their records have more signals, which the proof does not know."""
    common = {
        "reference": nlctl.SumOfSines(order=0),
        "plant": nlctl.plants.WingRock(),
        "actuator": nlctl.Gain(),
        "model": nlctl.controllers.ReferenceModel(a=(4.0, 2.0), b=4.0),
        "basis": nlctl.controllers.WingRockRegressor(),
    }
    stack = nlctl.sampled(nlctl.controllers.HistoryStack(gain=3.0), 0.05)
    concurrent = {
        "error": nlctl.controllers.ModelError(K=(4.0, 2.0), Q=(1.0, 1.0)),
        "weights": nlctl.controllers.ConcurrentWeights(nodes=6, Gamma=5.0),
        "stack": stack,
        "law": nlctl.controllers.ModelReferenceLaw(gain=3.0),
    }
    constrained = {
        "error": nlctl.controllers.ConstrainedError(K=(4.0, 2.0), Q=(1.0, 1.0)),
        "weights": nlctl.controllers.AdaptiveWeights(nodes=6),
        "law": nlctl.controllers.ConstrainedLaw(u_max=10.0),
    }
    for own, said in ((concurrent, "sampled|stack"), (constrained, "ConstrainedError")):
        with pytest.raises(DiagramError, match=said):
            certify(nlctl.interconnect({**common, **own}, outputs=["e"]))
