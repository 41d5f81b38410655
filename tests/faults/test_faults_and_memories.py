"""Faults that begin and end at given times in front of memories: what these were is kept."""

import control as ct
import numpy as np
import pytest
from dense_play import through_play

import nlctl

R, GAIN = 0.3, 0.3


def loop(onset, until, kind="gain", value=GAIN, **more):
    """A fault of a sine in front of a play, whose output is integrated."""
    wave = ct.nlsys(
        lambda t, x, u, p: [2.0 * x[1], -2.0 * x[0]], lambda t, x, u, p: [x[0]], inputs=0,
        outputs=["u"], states=2, name="wave",
    )  # fmt: skip
    blocks = {
        "wave": wave,
        "play": nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=R, c_l=-R),
        "sum": ct.ss(0, 1, 1, 0, inputs="v", outputs="z"),
    }
    diagram = nlctl.interconnect(blocks, outputs=["v", "z"])
    fault = nlctl.Fault("wave.u", kind, value, at=onset, until=until, name="f", **more)
    return nlctl.with_faults(diagram, fault)


@pytest.mark.parted
@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize(
    "choice", [*({"method": m} for m in ("tsit5", "rodas5p", "taylor", "auto"))], ids=str
)
@pytest.mark.parametrize("onset", [0.9, 1.0, 1.7])
def test_a_play_that_is_carried_when_a_fault_begins_keeps_what_it_was(onset, choice, rtol):
    """At samples right at the fault's times as well."""
    until = onset + 2.4
    timepts = np.array([0.0, 0.5, onset, onset + 1e-4, 2.2, 3.0, until, until + 0.1, 5.0])
    before = np.nextafter([onset, until], 0.0)
    dense = np.union1d(np.linspace(0.0, 5.0, 500_001), [*timepts, *before])
    wave = np.sin(2.0 * dense)
    faulty = (dense >= onset) & (dense < until)
    exact = through_play(np.where(faulty, GAIN * wave, wave), R)
    run = nlctl.input_output_response(
        loop(onset, until), timepts, 0, [0.0, 1.0, 0.0, 0.0], rtol=rtol, atol=rtol / 100, **choice
    )
    shown = exact[np.searchsorted(dense, timepts)]
    assert run.outputs[0] == pytest.approx(shown, abs=1e-8 + 100 * rtol)


def test_the_reference_shows_the_same():
    """python-control's own right-hand side."""
    timepts = np.array([0.0, 0.9, 1.7, 2.2, 4.1, 5.0])
    settings = {"rtol": 1e-8, "atol": 1e-10}
    runs = [
        nlctl.input_output_response(
            loop(1.7, 4.1), timepts, 0, [0.0, 1.0, 0.0, 0.0], engine=engine, **settings
        )
        for engine in ("native", "python-control")
    ]
    assert runs[0].outputs == pytest.approx(runs[1].outputs, abs=1e-6)
    for column in ("block", "which", "direction"):
        assert list(runs[0].events[column]) == list(runs[1].events[column])


def test_events_have_the_name_of_the_fault_also_where_something_else_switches():
    """A wave of t that switches when the fault does is no other event."""
    onset = 1.25
    square = ct.nlsys(
        None, lambda t, x, u, p: [1.0 if t < p["T"] else -1.0], inputs=0, outputs=["u"],
        params={"T": onset}, name="square",
    )  # fmt: skip
    diagram = nlctl.interconnect(
        {"square": square, "sum": ct.ss(0, 1, 1, 0, inputs="u", outputs="z")}, outputs=["z"]
    )
    diagram = nlctl.with_faults(
        diagram, nlctl.Fault("square.u", "bias", 3.0, at=onset, until=2.0, name="f")
    )
    for engine in ("native", "python-control"):
        run = nlctl.input_output_response(diagram, [0.0, onset, 2.0, 3.0], engine=engine)
        assert run.outputs[0] == pytest.approx([0.0, 1.25, 1.25 + 0.75 * 2.0, 1.75], abs=1e-7)
        events = run.events
        assert list(events["block"]) == ["f", "f"]
        assert list(events["which"]) == ["switching 1", "switching 2"]
        assert list(events["time"]) == pytest.approx([onset, 2.0], abs=1e-12)


def test_members_have_faults_at_times_of_their_own():
    """Of an ensemble: each its own switch, solved together, as a single run has it."""
    diagram, timepts = loop(1.7, 4.1), np.linspace(0.0, 5.0, 11)
    onsets = np.array([0.0, 0.35, 1.0, 1.5, 4.999, 5.0, 7.0])
    start = [0.0, 1.0, 0.0, 0.0]
    many = nlctl.ensemble_response(
        diagram, timepts, 0, start, params={"f.onset": onsets}, keep=["v"], method="tsit5"
    )
    for j, onset in enumerate(onsets):
        one = nlctl.input_output_response(
            diagram, timepts, 0, start, params={"f.onset": onset}, method="tsit5"
        )
        assert np.array_equal(many.signals["v"][j], one.outputs[0])
