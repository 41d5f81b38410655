"""The figure of "What happens between two steps": ``python docs/explanation/between_steps.py``."""

import sys
from pathlib import Path

import control as ct
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np

import nlctl

TIMES = np.linspace(0, 2.4, 1201)  # s
KEPT, GRAVITY = 0.7, 8.0


@nlctl.record
class Ball:
    """A ball above a floor that keeps 0.7 of its speed at each bounce."""

    inputs, outputs, states, feedthrough = (), ("h",), ("h", "v"), False
    initial = {"h": 1.0}
    update = nlctl.equation(lambda t, x, u, p: (x[1], -GRAVITY))
    output = nlctl.equation(lambda t, x, u, p: (x[0],))
    guard = nlctl.equation(lambda t, x, u, p: (x[0],))
    reset = nlctl.equation(lambda t, x, u, p: (0.0, -KEPT * x[1]))


def kinds_of_jump():
    """Return what each row shows: title, diagram, initial state, and a label for each output."""
    plant = ct.ss(0, 1, 1, 0, inputs="u", outputs="x", name="plant")
    law = nlctl.sampled(ct.ss([], [], [], -1.5, 0.5, inputs="x", outputs="u", name="law"))
    sampled = nlctl.interconnect({"plant": plant, "law": law}, outputs=["x", "u"])
    wave = ct.nlsys(None, lambda t, x, u, p: np.sin(5 * t), inputs=0, outputs=["u"], name="wave")
    gap = nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.4, c_l=-0.4)
    play = nlctl.interconnect({"wave": wave, "play": gap}, outputs=["u", "v"])
    return (
        ("at a clock", sampled, {"plant.x[0]": 1.0}, ("state x", "input u, sampled every 0.5 s")),
        ("at a crossing", nlctl.block(Ball(), "ball"), None, ("height of a ball (m)",)),
        ("after each accepted step", play, None, ("input u", "output v of a backlash")),
    )


def main(folder: Path) -> None:
    """Write the figure, and check what it shows against closed forms."""
    figure, rows = plt.subplots(3, 1, figsize=(7, 6.6), sharex=True, layout="constrained")
    shown = []
    for axes, (title, system, start, labels) in zip(rows, kinds_of_jump(), strict=True):
        run = nlctl.input_output_response(system, TIMES, 0, start, squeeze=False)
        steps = nlctl.input_output_response(  # at the ends of the steps of SciPy's integrator
            system, TIMES[[0, -1]], 0, start, engine="python-control",
            rtol=1e-6, atol=1e-8, evaluation_times=None,
        ).time  # fmt: skip
        for label, signal in zip(labels, run.outputs, strict=True):
            axes.plot(TIMES, signal, label=label)
        at = axes.get_xaxis_transform()
        axes.plot(steps, 0.03 + 0 * steps, "k|", transform=at, label="ends of steps")
        axes.set(title=f"A jump {title}", ylabel=labels[0] if len(labels) == 1 else "signals (1)")
        shown.append(run)
    for axes, top in zip(rows, (1.9, 1.4, 1.9), strict=True):
        axes.set_ylim(top=top)
        axes.legend(loc="upper right", ncols=3)
    rows[-1].set(xlabel="t (s)", xlim=(0, 2.4))
    check(*shown)
    with mpl.rc_context({"svg.hashsalt": "nlctl"}):
        figure.savefig(folder / "between-steps.svg", metadata={"Date": None})
    plt.close(figure)


def check(sampled, ball, play):
    """Hold each row against what is known of it."""
    k = np.arange(5)
    np.testing.assert_allclose(sampled.outputs[0, ::250], 0.25**k, atol=1e-9)
    first = np.sqrt(2 / GRAVITY)
    bounces = first * (1 + 2 * np.r_[0, np.cumsum(KEPT ** np.arange(1, 5))])
    np.testing.assert_allclose(ball.events["time"][:5], bounces, atol=1e-7)
    u, v = play.outputs
    assert abs(u - v).max() <= 0.4 + 1e-9
    assert abs(v[TIMES > 1].max() - 0.6) < 1e-5


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
