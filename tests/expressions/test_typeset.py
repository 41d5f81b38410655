"""Formulas are what is run: they are read back as numbers, and converted to MathML."""

import contextlib
import cProfile
import re
import sys

import control as ct
import numpy as np
import pytest
import user_functions
from hypothesis import given
from hypothesis import strategies as st
from latex_values import value as value_of
from latex_values import values
from test_derivatives import quiet

import nlctl
from nlctl.analysis.catalogue import block_records
from nlctl.analysis.report.document import Equation
from nlctl.analysis.report.mathml import mathml
from nlctl.errors import UsageError
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.functions import FUNCTIONS
from nlctl.expressions.graph import Graph
from nlctl.expressions.latex import LatexWriter, number_text, symbol
from nlctl.native.typesetting import DERIVATIVE, changing


def test_symbols():
    """Names become the symbols of the field."""
    table = {
        "x1": "x_{1}", "b_r": "b_{r}", "zeta": r"\zeta", "W_hat": r"\hat{W}",
        "delta_hat": r"\hat{\delta}", "W_hat[0]": r"\hat{W}_{1}", "sigma_1": r"\sigma_{1}",
        "p_mean": r"p_{\mathrm{mean}}", "yd2": "y_{d,2}", "lambdas": r"\lambda",
        "speed": r"\mathrm{speed}", "x_1[2]": "x_{1,3}", "Gamma": r"\Gamma",
    }  # fmt: skip
    assert {name: symbol(name) for name in table} == table


@pytest.mark.slow
def test_no_symbol_has_two_subscripts():
    """LaTeX refuses them: an index of a parameter stands behind those that its name has."""
    for name, cls in block_records().items():
        if name in ("PureFeedback", "FunctionReference", "Zero"):  # they need arguments
            continue
        spec = cls()
        if not hasattr(spec, "outputs"):
            continue
        discrete = {"dt": True} if getattr(spec, "discrete", False) else {}
        try:
            (shown,) = nlctl.typeset(nlctl.block(spec, "b", **discrete))
        except nlctl.errors.CompileError:  # a memory, which has no formula
            continue
        for line in (*shown.equations, *shown.where):
            assert not re.search(r"_\{(?:[^{}]|\{[^{}]*\})*\}_", line), (name, line)
            assert " _" not in line, (name, line)  # a placeholder is not a symbol


def test_a_profiler_changes_no_formula_and_goes_on():
    """Names of intermediate values are found by one, and Python cannot set cProfile's again."""
    loop = nlctl.paper.example_1()
    alone, profiler = nlctl.typeset(loop), cProfile.Profile()
    seen = []
    with profiler:
        assert nlctl.typeset(loop) == alone
        called_afterwards()
    assert called_afterwards.__code__ in [entry.code for entry in profiler.getstats()]
    sys.setprofile(lambda frame, event, value: seen.append(frame.f_code))
    try:
        assert nlctl.typeset(loop) == alone
        called_afterwards()
    finally:
        sys.setprofile(None)
    assert called_afterwards.__code__ in seen


def called_afterwards():
    """What a profiler sees if it is still at work."""


def test_numbers():
    """All digits, parts of pi, powers of ten; nothing that is only nearly a part of pi."""
    table = {
        0.1: "0.1", 2.0: "2", -3.5: "-3.5", 1e-6: "10^{-6}", 2.5e21: r"2.5 \cdot 10^{21}",
        np.pi / 2: r"\frac{\pi}{2}", -np.pi: r"-\pi", 3 * np.pi: r"3 \pi", 3.1415926: "3.1415926",
        np.inf: r"\infty", 0.0: "0",
    }  # fmt: skip
    assert {number: number_text(number) for number in table} == table


SIGNS = {"add": 2, "sub": 2, "mul": 2, "div": 2, "neg": 1}
# on paper sgn 0 is 0, and e^x has no largest value
OPERATIONS = [*SIGNS, *SIGNS, *SIGNS, *(FUNCTIONS.keys() - {"copysign", "logaddexp"})]
OPERATIONS.sort()


def drawn_expression(graph, rng):
    """An expression of up to five operations."""
    nodes = [*(graph.leaf("x", i, None) for i in range(3)), graph.const(-0.5), graph.const(3.0)]
    for op in rng.choice(OPERATIONS, rng.integers(1, 6)):
        count = SIGNS[op] if op in SIGNS else FUNCTIONS[op].count
        nodes.append(graph.op(str(op), *(nodes[k] for k in rng.integers(-4, 0, count))))
    return nodes[-1]


@given(st.integers(0, 2**32 - 1))
def test_a_formula_is_read_as_what_is_computed(seed):
    """By a reader for whom a function without brackets has all that follows it."""
    rng = np.random.default_rng(seed)
    x = rng.integers(1, 90, 3) / 64  # sums of these are exact, in whatever order they are read
    symbols = {f"x_{{{i + 1}}}": number for i, number in enumerate(x)}
    writer = LatexWriter(leaf=lambda _, index: f"x_{{{index[0] + 1}}}")
    for draw in [drawn_expression, drawn_choice] * 25:
        expr = draw(Graph(), rng)
        text = writer.formula(expr)
        with np.errstate(all="ignore"):
            (computed,) = evaluate_expressions([expr], {"x": np.outer(x, [1.0, 1.0 + 1e-14])})
            read = value_of(text, symbols)
        number, moved = np.broadcast_to(computed, 2)
        hangs_on_rounding = not np.isclose(number, moved, rtol=1e-10, equal_nan=True)
        assert hangs_on_rounding or read == pytest.approx(number, 1e-9, 1e-9, nan_ok=True), text


RELATIONS, WORDS = ["lt", "le", "gt", "ge", "eq", "ne"], ["and", "or", "xor", "not"]


def drawn_choice(graph, rng):
    """A choice, made of up to eight choices, conditions, and sums and products of them."""
    numbers = [*(graph.leaf("x", i, None) for i in range(3)), graph.const(-0.5), graph.const(0.75)]
    conditions = [graph.op("lt", numbers[0], numbers[1])]
    for kind in rng.choice(4, rng.integers(2, 9)):
        pair = [numbers[k] for k in rng.integers(-4, 0, 2)]
        two = [conditions[k] for k in rng.integers(-min(3, len(conditions)), 0, 2)]
        if kind == 0:
            conditions.append(graph.op(str(rng.choice(RELATIONS)), *pair))
        elif kind == 1:
            word = str(rng.choice(WORDS))
            conditions.append(graph.op(word, *two[: 1 if word == "not" else 2]))
        elif kind == 2:
            numbers.append(graph.op(str(rng.choice(["add", "mul"])), *pair))
        else:
            numbers.append(graph.op("select", two[0], *pair))
    return graph.op("select", conditions[-1], numbers[-1], numbers[-2])


def scalars(system, t, x, u):
    """Return the values of the symbols of a block with few states, for `latex_values`."""
    known = {"t": t}
    known |= {symbol(name): v for name, v in zip(system.state_labels, x, strict=True)}
    known |= {symbol(name): v for name, v in zip(system.input_labels, u, strict=True)}
    for name, array in system.params.items():
        for place, v in np.ndenumerate(array) if np.asarray(array).dtype.kind in "fib" else ():
            index = ",".join(str(k + 1) for k in place)
            known[f"{symbol(name)}_{{{index}}}" if place else symbol(name)] = v
    return known


def judged(system, t, x, u):
    """Compare a block's formulas with python-control; return the number of equations."""
    (made,) = nlctl.typeset(system)
    try:
        dx, y = system.dynamics(t, x, u), system.output(t, x, u)
    except (ValueError, ArithmeticError, AssertionError):  # it has a formula all the same
        return 0
    found = values(made.equations, made.where, scalars(system, t, x, u))
    dots = [changing(symbol(label), DERIVATIVE) for label in system.state_labels]
    dx = np.broadcast_to(dx.astype(float), len(dots))  # None is NaN in all states of a run
    wanted = dict(zip(dots, dx, strict=True))
    wanted |= {symbol(n): v for n, v in zip(system.output_labels, y, strict=True)}
    for name, value in found.items():
        assert value == pytest.approx(wanted[name], rel=1e-12, abs=1e-12, nan_ok=True), (
            made.latex,
            name,
        )
    return len(found)


@pytest.mark.weekly
def test_users_functions_read_back():
    """The formulas of the corpus, with two states, have the values of its functions."""
    rng, count, formulas = np.random.default_rng(3), 0, 0
    for entry in user_functions.ENTRIES:
        if entry.name == "negative_zero":
            continue  # on paper there is one zero
        with quiet():
            try:
                system = user_functions.system(entry.make(2), entry.name)
                lines = nlctl.typeset(system)[0]
            except UsageError:
                continue
            texts = [*lines.equations, *lines.where]
            if any("_{i}" in text or r"\sum" in text for text in texts):
                continue  # vectors: below
            for scale in (0.5, 3.0):
                x, u = (scale * rng.normal(size=n) for n in (system.nstates, system.ninputs))
                with contextlib.suppress(UnboundLocalError):  # Python has no value there
                    formulas += judged(system, float(rng.uniform(0, 3)), x, u)
        assert not any("<code" in mathml(Equation(latex=text)) for text in texts), texts
        count += 1
    assert count > 150
    assert formulas > 600


@pytest.mark.parted
@pytest.mark.parametrize("example", [nlctl.paper.example_1, nlctl.paper.example_2])
@pytest.mark.parametrize("values_shown", [False, True])
def test_both_examples_are_shown_as_formulas(example, values_shown):
    """Every block has equations, and every line of them is MathML."""
    blocks = nlctl.typeset(example(), values=values_shown)
    assert [b.block for b in blocks][:2] == ["reference", "plant"]
    for block in blocks:
        assert block.equations
        for text in (*block.equations, *block.where, *block.inputs):
            assert "<code" not in mathml(Equation(latex=text)), text


def test_a_changed_parameter_or_sign_is_another_formula():
    """Values are those of the run; a vector's equation has its index, a sum its bounds."""
    block = nlctl.block(nlctl.controllers.AdaptiveWeights(nodes=27), "weights")
    (plain,) = nlctl.typeset(block)
    index = r", \quad i = 1, \dots, 27"
    left, _, right = plain.equations[0].partition(" = ")
    assert left == r"\dot{\hat{W}}_{i}"
    assert right == r"\Gamma \left(r \psi_{i} - \sigma_{1} \hat{W}_{i}\right)" + index
    assert plain.equations[1] == r"W_{\psi} = \sum_{j=1}^{27} \hat{W}_{j} \psi_{j}"
    (first,) = nlctl.typeset(block, values=True)
    (second,) = nlctl.typeset(block, values=True, params={"weights.Gamma": 0.75})
    assert r"= 0.5 \left(" in first.equations[0]
    assert r"= 0.75 \left(" in second.equations[0]


def test_diagrams_show_what_inputs_are_connected_to():
    """Gains, signs and sums of connections; linear blocks by their matrices."""
    plant = ct.ss([[0.0, 1.0], [-2.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], 0, name="plant")
    law = ct.nlsys(None, lambda t, x, u, p: [-p["k"] * u[0]], inputs=["e"], outputs=["u"],
                   params={"k": 3.0}, name="law")  # fmt: skip
    loop = ct.interconnect(
        [plant, law],
        connections=[["law.e", (0, 0, 1.5)], ["plant.u[0]", "-law.u"]],
        inplist=["plant.u[0]"], outlist=["plant.y[0]"], inputs=["w"], outputs=["y"],
    )  # fmt: skip
    one, two = nlctl.typeset(loop)
    assert one.equations[1] == r"\dot{x}_{2} = -2 x_{1} + u_{1}"
    assert one.inputs == ("u_{1} = -u + w",)
    assert two.inputs == ("e = 1.5 y_{1}",)
    assert two.equations == ("u = -k e",)
    signs = ct.summing_junction(["y", "-yd"], "error", name="difference")
    (difference,) = nlctl.typeset(signs)
    assert difference.equations == (r"\mathrm{error} = y - y_{d}",)  # no factor 1
    assert two.latex == "\\begin{aligned}\ne &= 1.5 y_{1} \\\\\nu &= -k e\n\\end{aligned}"


def test_local_names_are_kept():
    """What a function calls its intermediate results, its formula calls them, too."""

    def update(t, x, u, params):
        speed = x[1]
        drag = params["c"] * speed * abs(speed)
        return [speed, u[0] - drag]

    cart = ct.nlsys(update, states=2, inputs=1, params={"c": 0.3}, name="cart")
    (made,) = nlctl.typeset(cart)
    assert made.equations[1] == r"\dot{x}_{2} = u_{1} - \mathrm{drag}"
    assert made.where == (r"\mathrm{drag} = c x_{2} \left|x_{2}\right|",)


def test_a_gain_that_is_written_as_2_has_its_name():
    """An integer that says how many passes there are is in the equations as a number."""
    law = ct.nlsys(
        None, lambda t, x, u, p: sum(p["k"] * u[0] for _ in range(p["n"])),
        inputs=["e"], outputs=["u"], params={"k": 2, "n": 2}, name="law",
    )  # fmt: skip
    (made,) = nlctl.typeset(law)
    assert made.equations == ("u = k e + k e",)
    assert nlctl.typeset(law, values=True)[0].equations == ("u = 2 e + 2 e",)


def test_the_name_of_a_signal_is_that_signal():
    """A function calls what it has not yet limited by the name of its output."""

    def rate(t, x, u, p):
        v = p["k"] * u[0] + x[0]
        return [u[0] + min(max(v, -1.0), 1.0) - v]

    law = ct.nlsys(
        rate, lambda t, x, u, p: np.clip(p["k"] * u[0] + x[0], -1, 1), states=["x"], inputs=["e"],
        outputs=["v"], params={"k": 2}, name="law",
    )  # fmt: skip
    (made,) = nlctl.typeset(law)
    v = "k e + x"
    limited = rf"\min\left(\max\left({v}, -1\right), 1\right)"
    assert made.equations == (rf"\dot{{x}} = e + {limited} - k e - x", f"v = {limited}")
    assert made.where == ()


def test_a_delay_is_written_in_time():
    """y(t) = u(t - tau), with another name for what is called tau already."""
    for name, delay in (("v", r"\tau"), ("tau", r"\mathrm{delay}")):
        wire = nlctl.block(nlctl.TransportDelay(delay=0.5, outputs=(name,)), "wire")
        left = nlctl.expressions.latex.symbol(name)
        (made,) = nlctl.typeset(wire)
        assert made.equations == (rf"{left}\left(t\right) = u\left(t - {delay}\right)",)
        (made,) = nlctl.typeset(wire, values=True)
        assert made.equations == (rf"{left}\left(t\right) = u\left(t - 0.5\right)",)


def test_what_has_no_formula_is_refused():
    """An opaque function is named with its reason."""
    odd = ct.nlsys(
        lambda t, x, u, p: [-float(np.linalg.eigvals(np.diag(x)).real.max()) * x[0]],
        states=1,
        inputs=0,
        name="odd",
    )
    with pytest.raises(nlctl.errors.CompileError, match="block 'odd' has no formula"):
        nlctl.typeset(odd)
    lag = ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="lag")
    loop = ct.interconnect([odd, lag], inputs=["u"], outputs=["y", "x[0]"])
    without, known = nlctl.typeset(loop)
    assert (without.block, without.equations, known.missing) == ("odd", (), "")
    assert "eigenvalues" in without.missing
    assert known.equations == (r"\dot{x}_{1} = -x_{1} + u", "y = x_{1}")
    assert without.latex == "\\begin{aligned}\n\\text{no formula}\n\\end{aligned}"
