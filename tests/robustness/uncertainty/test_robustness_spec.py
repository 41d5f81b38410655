"""Formulas and margins: laws of the semantics, closed forms, and runs that did not end well."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.analysis.metrics import peak
from nlctl.analysis.robustness.stl.formula import (
    SampledSignals,
    always,
    eventually,
    horizon,
    in_band,
    margin_trace,
    signals_named,
)
from nlctl.analysis.robustness.stl.piecewise import Trace, higher, largest, with_vertices
from nlctl.analysis.robustness.stl.spec import (
    FAILED,
    Requirement,
    Spec,
    margin,
    margins,
    unfinished_margin,
)

T = np.linspace(0, 10, 1001)
SMALL = in_band("e", lower=-0.15, upper=0.15, scale=1.0)


def value(formula, t=T, until=None, **signals):
    """Return a formula's margin at the start of a response."""
    until = t[-1] if until is None else until
    return margin(Requirement(key="r", formula=formula, until=until), t, signals)


@st.composite
def zigzags(draw, duration=None):
    """Samples 0.2 to 1 s apart, 12 of them."""
    seed = draw(st.integers(0, 10**6))
    rng = np.random.default_rng(seed)
    t = np.concatenate([[0], np.cumsum(rng.uniform(0.2, 1.0, 11))])
    return Trace(t, rng.integers(-3, 4, 12) / 2 + rng.uniform(-0.1, 0.1, 12))


@given(zigzags(), st.floats(0, 1), st.floats(0, 1.5))
def test_sliding_maximum_is_that_of_a_dense_search(f, start, length):
    """Exact windows against the maximum over 2,000 points per window, at times in between."""
    end = start + length
    high = f.t[-1] - end
    windows = largest(f, 0.0, high, start, end)
    at = np.random.default_rng(1).uniform(0, high, 40)
    dense = at[:, None] + np.linspace(start, end, 2001)
    assert np.all(np.diff(windows.t) > 0)
    np.testing.assert_allclose(windows.at(at), f.at(dense).max(axis=1), atol=0.05)
    assert np.all(windows.at(at) >= f.at(dense).max(axis=1) - 1e-12)
    inside = f.at(np.clip(f.t[None, :], (at + start)[:, None], (at + end)[:, None])).max(axis=1)
    np.testing.assert_allclose(windows.at(at), inside, atol=1e-12)  # ends or points: exact


@given(zigzags(), zigzags(), st.floats(0, 4))
def test_the_higher_of_two_is_the_maximum_everywhere(f, g, at):
    """Also between the points of both: crossings are points of the result."""
    f, g = f.between(0, 4), g.between(0, 4)
    assert higher(f, g).at(at) == pytest.approx(max(f.at(at), g.at(at)), abs=1e-12)


@given(st.floats(0.2, 3), st.floats(0, 6))
def test_margin_of_a_sine_is_what_its_peak_leaves(a, phase):
    """always |e| <= 1 leaves 1 - a, with peaks between samples; as the metric says."""
    t = np.linspace(0, 10, 101)
    e = a * np.sin(2 * t + phase)
    got = value(always(in_band("e", lower=-1, upper=1)), t=t, e=e)
    assert got == pytest.approx(1 - a, abs=1e-3 * a)
    assert got <= 1 - peak(t, e) + 1e-12


def test_zero_crossings_between_samples_count():
    """Eventually |e| <= 0.15 holds with the whole band where a line passes through 0."""
    t, e = np.array([0.0, 1.0, 2.0]), np.array([3.0, 1.0, -1.0])
    assert value(eventually(SMALL), t=t, e=e) == pytest.approx(0.15, abs=1e-15)
    assert value(eventually(SMALL, 0, 1), t=t, e=e) == pytest.approx(-0.85)


@given(st.floats(0.01, 4.9), st.floats(0.05, 5))
def test_windows_end_between_samples(start, length):
    """On e = t / 10 the margins are those of the window's ends."""
    end = min(start + length, 10)
    ramp = in_band("e", upper=0.15, scale=1.0)
    assert value(always(ramp, start, end), e=T / 10) == pytest.approx(0.15 - end / 10)
    assert value(eventually(ramp, start, end), e=T / 10) == pytest.approx(0.15 - start / 10)


@given(st.integers(0, 1000), st.floats(0, 2), st.floats(0, 2), st.floats(0, 2), st.floats(0, 2))
def test_windows_in_windows_add_up(seed, a, b, c, d):
    """always [a, a+b] always [c, c+d] is always [a+c, a+b+c+d]; the same for eventually."""
    e = np.cumsum(np.random.default_rng(seed).normal(size=41)) / 4
    t = np.linspace(0, 10, 41)
    for window in (always, eventually):
        nested = window(window(SMALL, c, c + d), a, a + b)
        assert horizon(nested) == pytest.approx(a + b + c + d)
        plain = window(SMALL, a + c, a + b + c + d)
        assert value(nested, t=t, e=e) == pytest.approx(value(plain, t=t, e=e), abs=1e-12)


@given(st.integers(0, 1000))
def test_de_morgan_and_duality(seed):
    """not (a and b) = not a or not b; not always a = eventually not a; not not a = a."""
    t = np.linspace(0, 10, 41)
    e, u = np.cumsum(np.random.default_rng(seed).normal(size=(2, 41)), axis=1) / 4
    a, b = SMALL, in_band("u", lower=-1, upper=0.5)

    def rho(formula):
        return value(formula, t=t, e=e, u=u)

    for one, other in [
        (~(a & b), ~a | ~b),
        (~always(a | b, 1, 3), eventually(~a & ~b, 1, 3)),
        (~~always(eventually(a, 0, 2), 0, 5), always(eventually(a, 0, 2), 0, 5)),
    ]:
        assert rho(one) == pytest.approx(rho(other), abs=1e-12)
    assert rho(a & b) == min(rho(a), rho(b))
    assert rho(a | b) == max(rho(a), rho(b))
    assert rho(~a) == -rho(a)


def test_a_recurring_event_needs_a_window_of_its_period():
    """sin t comes above 0.9 in every window of 2 pi; in windows of half of that it does not."""
    t = np.linspace(0, 40, 4001)
    up = in_band("e", lower=0.9, scale=1.0)
    assert value(always(eventually(up, 0, 6.3)), t=t, e=np.sin(t)) == pytest.approx(0.1, abs=1e-6)
    half = value(always(eventually(up, 0, np.pi)), t=t, e=np.sin(t))
    assert half == pytest.approx(-0.9, abs=1e-3)  # from pi to 2 pi the sine reaches 0


def test_settling_for_good_is_eventually_always():
    """e^-t stays below 0.5 from 1 s on; the best margin is the last one."""
    settled = eventually(always(in_band("e", upper=0.5, scale=1.0)))
    assert value(settled, e=np.exp(-T)) == pytest.approx(0.5 - np.exp(-10))
    assert value(settled, e=np.exp(T / 10)) == pytest.approx(0.5 - np.e)


@given(st.floats(-0.3, 0.3), st.integers(0, 1000))
def test_the_margin_is_a_distance(shift, seed):
    """Moving a signal by less than the margin does not break the requirement, times the scale."""
    e = np.cumsum(np.random.default_rng(seed).normal(size=T.size)) / 60
    formula = always(in_band("e", lower=-0.5, upper=0.5) | eventually(SMALL, 0, 1), 0, 8)
    rho, moved = value(formula, e=e), value(formula, e=e + shift)
    assert abs(moved - rho) <= abs(shift) / 0.5 + 1e-9


def test_margins_are_counted_in_multiples_of_the_bound():
    """0.2 of |u| <= 15 means 20 % left; a band at 0 counts in the signal's unit."""
    assert value(always(in_band("u", lower=-15, upper=15)), u=12 + 0 * T) == pytest.approx(0.2)
    assert value(always(in_band("u", upper=0)), u=-3 + 0 * T) == pytest.approx(3)
    assert value(always(in_band("u", lower=-1, upper=4)), u=-0.5 + 0 * T) == pytest.approx(0.125)


def test_until_is_where_open_windows_end():
    """What comes after does not matter, not even NaN."""
    e = np.where(T <= 5, 0.1, np.nan)
    assert value(always(SMALL), until=4.995, e=e) == pytest.approx(0.05)
    assert value(always(SMALL), until=4.0, e=T / 40) == pytest.approx(0.05)


@given(st.floats(0, 9.9), st.floats(0, 9.9))
def test_a_run_that_ended_early_fails_the_more_the_earlier(one, other):
    """Below every finished run, even with a formula that finished runs fail by far."""
    finished = value(always(SMALL), e=1e5 + 0 * T)
    hopeless = value(always(SMALL), e=1e300 + 0 * T)
    assert hopeless == -FAILED < finished < 0
    early, late = (
        value(always(SMALL), e=np.where(t >= T, 0.0, np.nan)) for t in sorted([one, other])
    )
    assert -2 * FAILED <= early <= late < -FAILED
    cut = T[one >= T]
    assert value(always(SMALL), t=cut, until=10, e=0 * cut) == unfinished_margin(cut[-1], 10)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    "formula",
    [
        always(SMALL),
        eventually(SMALL),
        ~always(SMALL),
        always(in_band("e", lower=-1)) | eventually(in_band("u", upper=1)),
        eventually(in_band("u", upper=1), 0, 1) | in_band("e", upper=1),
    ],
)
def test_no_requirement_holds_for_a_diverged_run(formula, bad):
    """Neither a negated one nor one that was met before: NaN and infinity count as failed."""
    assert value(formula, e=np.where(T > 5, bad, 0.0), u=0 * T) < -FAILED


@pytest.mark.parametrize(("time", "until"), [(np.nan, 10.0), (-1.0, 10.0), (0.0, 10.0), (1.0, 0.0)])
def test_unknown_ends_count_as_the_earliest(time, until):
    """NaN is no late end."""
    assert unfinished_margin(time, until) == -2 * FAILED


def test_huge_finite_samples_fail():
    """Arithmetic that overflows is no success."""
    e = 1.7e308 * np.cos(20 * T)
    assert value(always(SMALL), e=e) == -FAILED
    assert value(always(in_band("e", lower=-1)), e=e) == -FAILED


def test_a_spec_holds_by_its_least_margin():
    """One number per requirement and their minimum; one diverged signal fails all it is in."""
    spec = Spec(
        requirements=(
            Requirement(key="settles", formula=always(SMALL, 5), until=10),
            Requirement(key="effort", formula=always(in_band("u", lower=-15, upper=15)), until=10),
        )
    )
    got = margins(spec, T, {"e": np.exp(-T), "u": 12 * np.exp(-T)})
    assert got == pytest.approx(
        {"settles": 0.15 - np.exp(-5), "effort": 0.2, "spec": 0.15 - np.exp(-5)}
    )
    worse = margins(spec, T, {"e": np.exp(-T), "u": np.where(T < 5, 0.0, np.nan)})
    assert worse["settles"] > 0 > -FAILED > worse["effort"] == worse["spec"]


def test_formulas_read_as_sentences():
    """For tables and reports."""
    both = always(SMALL, 10) & ~eventually(
        in_band("u", lower=3) | in_band("z", lower=0, upper=1), 1, 2
    )
    assert str(both) == (
        "(always from 10 s on |e| <= 0.15 and not eventually in [1, 2] s (u >= 3 or 0 <= z <= 1))"
    )
    assert signals_named(both) == ("e", "u", "z")
    assert str(always(in_band("u", upper=1))) == "always u <= 1"


def test_a_trace_is_the_margin_at_every_time():
    """Shifting the response by t is the trace at t."""
    e = np.sin(T) * np.exp(-T / 5)
    formula = always(SMALL, 0, 2)
    got = margin_trace(formula, SampledSignals(T, {"e": e}, 10.0), 0.0, 8.0)
    for k in (0, 137, 500):
        assert got.at(T[k]) == pytest.approx(value(formula, t=T[k:] - T[k], e=e[k:]), abs=1e-4)


def test_vertices_are_added_at_strict_extrema_only():
    """A square wave gets no overshoot, a sampled parabola its vertex."""
    t = np.arange(6.0)
    square = with_vertices(t, np.array([0, 0, 1, 1, 0, 0.0]))
    assert square.y.max() == 1
    parabola = with_vertices(t, -((t - 2.3) ** 2))
    assert (parabola.t[np.argmax(parabola.y)], parabola.y.max()) == pytest.approx((2.3, 0.0))


def test_a_requirement_is_a_metric_of_an_ensemble():
    """x' = -k x: the margin of |x| <= 0.5 after 1 s is 1 - 2 e^-k."""
    import control as ct

    lag = ct.nlsys(
        lambda t, x, u, params: [-params["k"] * x[0]],
        lambda t, x, u, params: x,
        inputs=0, outputs=["e"], states=["x"], name="lag", params={"k": 1.0},
    )  # fmt: skip
    band = in_band("e", lower=-0.5, upper=0.5)
    decays = Requirement(key="decays", formula=always(band, 1), until=2.0)
    k = np.array([0.5, 1.0, 2.0])
    table = nlctl.ensemble_response(
        nlctl.compile(lag), np.linspace(0, 2, 201), 0, {"x": 1.0}, params={"k": k}, metrics=[decays]
    ).table
    np.testing.assert_allclose(table["decays"], 1 - 2 * np.exp(-k), atol=1e-5)


@each_row(
    ("make", "error", "message"),
    [
        (lambda: in_band("e"), nlctl.errors.ParameterError, "one of them finite"),
        (lambda: in_band("e", lower=1, upper=0), nlctl.errors.ParameterError, "lower <= upper"),
        (lambda: in_band("e", upper=np.nan), nlctl.errors.ParameterError, "band of 'e'"),
        (lambda: in_band("e", upper=1, scale=0), nlctl.errors.ParameterError, "scale > 0"),
        (
            lambda: always(SMALL, 2, 1),
            nlctl.errors.ParameterError,
            "'always' needs 0 <= start <= end",
        ),
        (lambda: eventually(SMALL, -1), nlctl.errors.ParameterError, "'eventually' needs"),
        (
            lambda: Requirement(key="r", formula=always(SMALL, 12), until=10),
            nlctl.errors.ParameterError,
            "'r' needs a finite end .* at least 12 s",
        ),
        (
            lambda: Requirement(key="r", formula=SMALL, until=np.inf),
            nlctl.errors.ParameterError,
            "finite until",
        ),
        (lambda: Spec(requirements=()), nlctl.errors.ParameterError, "at least one requirement"),
        (
            lambda: value(SMALL, ee=T),
            nlctl.errors.UnknownNameError,
            "in requirement 'r'; nearest: 'ee'",
        ),
        (lambda: value(SMALL, t=T + 1, until=5, e=T), nlctl.errors.ParameterError, "starts at 1 s"),
    ],
)
def test_requirements_that_make_no_sense_are_refused(make, error, message):
    """With key, rule and value."""
    with pytest.raises(error, match=message):
        make()
