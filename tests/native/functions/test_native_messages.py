"""Messages and texts in functions: none is lost, and none is written in other digits."""

import logging

import control as ct
import numpy as np
import pytest

import nlctl

log = logging.getLogger("tests.native.messages")


def loop(update, **params):
    return ct.nlsys(
        update, None, states=1, inputs=0, outputs=1, params=params, name=update.__name__
    )


def end(compiled, **params):
    return nlctl.input_output_response(compiled, [0.0, 0.5, 1.0], 0.0, [0.5], params=params).states[
        0, -1
    ]


def says_when_asked(t, x, u, params):
    if params["verbose"]:
        print(x)
    return -x


def says_where_it_is_large(t, x, u, params):
    if x[0] > 100:
        print(x)
    return -x


def logged(t, x, u, params):
    log.info(f"{x[0]:.3f}")
    return -x


def sign_as_a_key(t, x, u, params):
    return [-{"1.0": 1.0}.get(f"{np.sign(x[0])}", 3.0) * x[0]]


def test_a_parameter_asks_for_messages(capsys):
    compiled = nlctl.compile(loop(says_when_asked, verbose=False))
    assert end(compiled) == pytest.approx(0.5 * np.exp(-1.0))
    assert not capsys.readouterr().out
    assert end(compiled, verbose=True) == pytest.approx(0.5 * np.exp(-1.0), rel=1e-5)
    assert "[0.5]" in capsys.readouterr().out


@pytest.mark.filterwarnings("ignore::nlctl.errors.EngineWarning")
def test_a_message_that_a_state_decides_is_written_by_python(capsys):
    compiled = nlctl.compile(loop(says_where_it_is_large))
    (call,) = compiled.equations.calls.values()
    assert "it calls print() (" in call.reason
    far = nlctl.input_output_response(compiled, [0.0, 0.5], 0.0, [200.0])
    assert far.states[0, -1] == pytest.approx(200 * np.exp(-0.5), rel=1e-5)
    assert "[200.]" in capsys.readouterr().out


def test_each_run_makes_sure_that_a_level_is_still_off():
    compiled = nlctl.compile(loop(logged))
    assert end(compiled) == pytest.approx(0.5 * np.exp(-1.0))
    log.setLevel(logging.INFO)
    try:
        with pytest.raises(nlctl.errors.UsageError, match="level"):
            end(compiled)
    finally:
        log.setLevel(logging.NOTSET)


@pytest.mark.filterwarnings("ignore")
def test_texts_are_written_by_python():
    """numba has other digits: the key of 1.0 was none of the dict's."""
    assert end(nlctl.compile(loop(sign_as_a_key))) == pytest.approx(0.5 * np.exp(-1.0), rel=1e-5)


def written_texts():
    """Yield functions that write numbers into texts by which nothing is computed."""
    log = logging.getLogger("nlctl.tests.texts")

    def by_format(t, x, u, params):
        log.debug("x = {:.2f} at {time}".format(x[0], time=t))  # noqa: UP032
        return -x

    def by_percent(t, x, u, params):
        log.debug("x = %g at %s" % (x[0], x))  # noqa: UP031
        return -x

    def by_str(t, x, u, params):
        log.debug("x = " + str(x[0]) + repr(t))
        return -x

    def of_constants(t, x, u, params):
        names = {"gain%d" % k: 1.0 + k for k in range(2)}  # noqa: UP031
        return -names["gain{}".format(1)] * x  # noqa: UP032

    def of_an_error(t, x, u, params):
        if x[0] > 1e9:
            raise ValueError("x = %g" % x[0])  # noqa: UP031
        return -x

    yield from (v for v in list(locals().values()) if hasattr(v, "__code__"))


@pytest.mark.parametrize("update", list(written_texts()), ids=lambda f: f.__name__)
def test_texts_of_numbers_that_nobody_reads_are_traced(update):
    system = ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="block")
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    times = np.linspace(0.0, 1.0, 5)
    run = nlctl.input_output_response(compiled, times, 0.0, [1.0, 2.0])
    rate = 2.0 if update.__name__ == "of_constants" else 1.0
    np.testing.assert_allclose(run.states[0], np.exp(-rate * times), atol=1e-5)


def test_a_text_that_is_read_or_cannot_be_written_is_not_traced():
    def read(t, x, u, params):
        return -x * len("%g" % x[0])  # noqa: UP031

    def compared(t, x, u, params):
        return -x if str(x[0]) != "nan" else x

    def faulty(t, x, u, params):
        text = "%s %s" % (x[0],)  # noqa: UP031, F507
        return -x if text is not None else x

    for update in (read, compared, faulty):
        system = ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="block")
        assert nlctl.compile(system).equations.calls
