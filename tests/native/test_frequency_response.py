"""Frequency responses with delays: closed forms, simulated sines, python-control's plots."""

import control as ct
import numpy as np
import pytest

import nlctl

W = np.logspace(-2, 2, 300)
S = 1j * W


def delay(tau, u="e", y="v", **more):
    record = nlctl.TransportDelay(inputs=(u,), outputs=(y,), delay=tau, **more)
    return nlctl.block(record, f"wire_{y}")


def plant(u="v", y="y", **more):
    return ct.ss(-1, 1, 2, 0, inputs=u, outputs=y, name="plant", **more)


def error(back="y"):
    return ct.summing_junction(["r", f"-{back}"], "e", name="error")


def closed(*parts, outputs=("y",)):
    return nlctl.interconnect(list(parts), inputs=["r"], outputs=list(outputs))


def response(diagram, w=W, **given):
    return np.asarray(nlctl.frequency_response(diagram, w, **given).frdata)


@pytest.mark.parametrize("tau", [1e-3, 0.5, 7.0])
def test_a_loop_with_one_delay_is_its_closed_form(tau):
    """P e^(-s tau) / (1 + P e^(-s tau)), and the sensitivity."""
    L = 2 / (S + 1) * np.exp(-S * tau)
    found = response(closed(delay(tau), plant(), error(), outputs=("y", "e")))
    np.testing.assert_allclose(found[0, 0], L / (1 + L), rtol=0, atol=1e-12)
    np.testing.assert_allclose(found[1, 0], 1 / (1 + L), rtol=0, atol=1e-12)


def test_delays_in_series_in_parallel_and_in_the_feedback():
    there, back = delay(0.4), delay(0.3, "y", "late")
    P, forth = 2 / (S + 1), np.exp(-0.4 * S)
    L = P * np.exp(-0.7 * S)
    found = response(closed(there, plant(), back, error("late")))
    np.testing.assert_allclose(found[0, 0], P * forth / (1 + L), rtol=0, atol=1e-12)
    series = nlctl.interconnect(
        [delay(0.4, "u", "a"), delay(0.3, "a", "y")], inputs=["u"], outputs=["y"]
    )
    np.testing.assert_allclose(response(series)[0, 0], np.exp(-0.7 * S), rtol=0, atol=1e-12)
    both = nlctl.interconnect(
        [delay(0.4, "u", "a"), delay(0.3, "u", "b"), ct.summing_junction(["a", "b"], "y")],
        inputs=["u"], outputs=["y"],
    )  # fmt: skip
    expected = np.exp(-0.4 * S) + np.exp(-0.3 * S)
    np.testing.assert_allclose(response(both)[0, 0], expected, rtol=0, atol=1e-12)


def test_a_direct_loop_through_a_delay():
    """y = r - k y(t - tau): no state at all."""
    gain = ct.ss([], [], [], 0.5, inputs="v", outputs="y", name="gain")
    found = response(closed(delay(0.2), gain, error()))
    L = 0.5 * np.exp(-0.2 * S)
    np.testing.assert_allclose(found[0, 0], L / (1 + L), rtol=0, atol=1e-12)


def test_without_delays_it_is_python_controls():
    loop = closed(plant("e"), error())
    expected = ct.frequency_response(nlctl.linearize(loop, 0), W)
    np.testing.assert_allclose(response(loop), np.asarray(expected.frdata), rtol=0, atol=1e-13)


def test_pade_approximations_come_to_it():
    exact = response(closed(delay(0.5), plant(), error()), [1.0])[0, 0, 0]
    gaps = []
    for order in (1, 2, 4):
        lag = ct.ss(ct.tf(*ct.pade(0.5, order)), inputs="e", outputs="v", name="pade")
        gaps.append(abs(response(closed(lag, plant(), error()), [1.0])[0, 0, 0] - exact))
    assert gaps[0] > 10 * gaps[1] > 100 * gaps[2]


def nonlinear():
    return ct.nlsys(
        lambda t, x, u, params: [x[1], -np.sin(x[0]) - x[1] + u[0]],
        lambda t, x, u, params: x[0], inputs=["v"], outputs=["y"], states=["angle", "rate"],
        name="pendulum",
    )  # fmt: skip


@pytest.mark.parametrize("w", [0.5, 2.0])
def test_small_simulated_sines_have_its_gain_and_phase(w):
    """Fitted to the last periods; what is not linear is below 1e-6 of an amplitude of 1e-4."""
    loop = closed(delay(0.3), nonlinear(), error())
    point = nlctl.find_operating_point(loop, [0.4, 0.0], 1.0)
    expected = response(loop, [w], at=point)[0, 0, 0]
    t = np.linspace(0, 60 + 4 * np.pi / w, 20001)
    small = 1e-4
    run = nlctl.input_output_response(
        loop, t, 1.0 + small * np.sin(w * t), point.states, rtol=1e-11, atol=1e-13
    )
    late = t > t[-1] - 4 * np.pi / w
    basis = np.stack([np.sin(w * t), np.cos(w * t), np.ones_like(t)], axis=1)[late]
    a, b, _ = np.linalg.lstsq(basis, run.outputs[late], rcond=None)[0]
    assert abs((a + 1j * b) / small - expected) < 1e-6


def test_it_is_taken_around_the_point_that_is_given():
    loop = closed(delay(0.3), nonlinear(), error())
    at_rest, tilted = response(loop, [1.0]), response(loop, [1.0], at={"angle": 1.0})
    L = [np.exp(-0.3j) / (-1 + 1j + slope) for slope in (1.0, np.cos(1.0))]
    expected = [each / (1 + each) for each in L]
    np.testing.assert_allclose([at_rest[0, 0, 0], tilted[0, 0, 0]], expected, rtol=1e-12)


def test_plots_and_margins_of_python_control_take_it():
    """|L| = 1 at w = sqrt(3), where its phase is -60 degrees less 0.5 sqrt(3) rad."""
    chain = nlctl.interconnect([delay(0.5), plant()], inputs=["e"], outputs=["y"])
    found = nlctl.frequency_response(chain)
    gain, phase, _, crossing = ct.margin(found)
    assert crossing == pytest.approx(np.sqrt(3), rel=1e-6)
    assert phase == pytest.approx(120 - np.rad2deg(0.5 * np.sqrt(3)), rel=1e-6)
    assert gain == pytest.approx(1.9034414, rel=1e-5)
    assert found.input_labels == ["e"]
    assert len(ct.bode_plot(found).axes) == 2
    assert ct.nyquist_plot(found).lines is not None


def test_a_pole_on_the_axis_is_infinite_there_and_nowhere_else():
    found = response(ct.ss(0, 1, 1, 0, name="integrator"), [0.0, 1.0])[0, 0]
    assert not np.isfinite(found[0])
    assert found[1] == pytest.approx(-1j)


def test_what_has_no_frequency_response_is_refused_by_name():
    hold = nlctl.sampled(ct.ss([], [], [], 1.0, 0.1, inputs="e", outputs="v", name="hold"))
    with pytest.raises(nlctl.errors.UsageError, match=r"frequency_response.*'hold'"):
        nlctl.frequency_response(closed(hold, plant(), error()), W)
    with pytest.raises(nlctl.errors.CompileError, match="'wire_v' varies"):
        nlctl.frequency_response(closed(delay(1.0, varying=np.sin), plant(), error()), W)
    with pytest.raises(nlctl.errors.ParameterError, match="continuous time"):
        nlctl.frequency_response(ct.ss(0.5, 1, 1, 0, 0.1), W)
    with pytest.raises(nlctl.errors.ParameterError, match="increasing omega"):
        nlctl.frequency_response(plant(), [2.0, 1.0])
