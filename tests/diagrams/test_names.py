"""Qualified parameter names in ordinary python-control diagrams, nested and copied ones too."""

import copy
from dataclasses import dataclass

import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from small_systems import chain, gain, out

import nlctl
from nlctl.errors import AmbiguousNameError, ParameterError, UnknownNameError

MAKERS = [ct.interconnect, nlctl.interconnect]
makers = pytest.mark.parametrize("join", MAKERS, ids=["control", "nlctl"])


class TestTwoBlocksOfOneKind:
    B_R = {"inner": 0.5, "outer": 1.0}

    def dead_zones(self, make):
        """Put two dead zones side by side behind one input."""
        blocks = []
        for name, b_r in self.B_R.items():
            blocks.append(make(name, b_r))
            blocks[-1].update_names(outputs=[f"v_{name}"])
        return ct.interconnect(blocks, inputs=["u"], outputs=["v_inner", "v_outer"])

    def ours(self):
        flat = {"slope_r": 2.0, "ripple_r": 0.0}
        return self.dead_zones(lambda n, b: nlctl.block(nlctl.DeadZone(b_r=b, **flat), n))

    @given(u=st.floats(1.5, 9), inner=st.floats(0.1, 1), outer=st.floats(0.1, 1))
    def test_each_keeps_its_own_value_and_is_overridden_alone(self, u, inner, outer):
        """v = 2 (u - b_r) with the b_r of the block that is meant."""
        diagram = self.ours()
        for params, expected in (
            (None, self.B_R),
            ({"inner.b_r": inner}, self.B_R | {"inner": inner}),
            ({"outer.b_r": outer}, self.B_R | {"outer": outer}),
            ({"outer.b_r": outer, "inner.b_r": inner}, {"inner": inner, "outer": outer}),
            (None, self.B_R),  # nothing has leaked from one call into the next
        ):
            v = diagram.output(0.0, [], [u], params=params)
            np.testing.assert_allclose(v, [2 * (u - b) for b in expected.values()], rtol=1e-12)

    def test_contrast_python_control_alone_mixes_them_up(self):
        """With dict parameters of the same name the last default wins in both blocks."""
        diagram = self.dead_zones(
            lambda name, b_r: ct.nlsys(
                None,
                lambda t, x, u, p: [2 * max(u[0] - p["b_r"], 0.0)],
                inputs=["u"],
                outputs=["v"],
                name=name,
                params={"b_r": b_r},
            )
        )
        right = [2 * (3.0 - b) for b in self.B_R.values()]
        wrong = [2 * (3.0 - self.B_R["outer"])] * 2
        np.testing.assert_allclose(diagram.output(0.0, [], [3.0]), wrong)
        np.testing.assert_allclose(self.ours().output(0.0, [], [3.0]), right)


class TestWhereParamsAreTaken:
    def loop(self, k):
        """y' = -y + k (w - y), so y = k / (1 + k) (1 - exp(-(1 + k) t)) after a step of w."""
        plant = ct.tf(1, [1, 1], inputs="v", outputs="y", name="plant")
        error = ct.summing_junction(["w", "-y"], "e")
        law = gain("law", k, "e", "v")
        return ct.interconnect([plant, error, law], inputs=["w"], outputs=["y"], name="loop")

    @given(k=st.floats(0.1, 9))
    @settings(max_examples=10)
    def test_every_call_of_python_control_that_takes_params(self, k):
        """Responses, linearisation, operating points, dynamics: the same string everywhere."""
        loop, params, t = self.loop(1.0), {"law.k": k}, np.linspace(0, 2, 5)
        for given_params, gain_ in ((params, k), (None, 1.0)):
            response = ct.input_output_response(
                loop, t, 1.0, 0.0, params=given_params, solve_ivp_kwargs={"rtol": 1e-9}
            )
            exact = gain_ / (1 + gain_) * (1 - np.exp(-(1 + gain_) * t))
            np.testing.assert_allclose(response.outputs, exact, rtol=1e-5)
            A = ct.linearize(loop, 0.0, 0.0, params=given_params).A
            np.testing.assert_allclose(A, [[-(1 + gain_)]], rtol=1e-6)
            rest = ct.find_operating_point(
                loop, 0.1, 1.0, params=given_params, root_method="lm"
            )  # SciPy's default may call it no progress that its first step is exact
            np.testing.assert_allclose(rest.outputs, gain_ / (1 + gain_), rtol=1e-9)
            assert loop.dynamics(0, [0.5], [1.0], params=given_params) == pytest.approx(
                -0.5 + gain_ * 0.5
            )

    def test_arithmetic_of_systems(self):
        """Series, sums, signs, scaling and feedback keep the names of their blocks."""
        a, b = gain("a", 2.0), gain("b", 3.0)
        for system, expected in (
            (b * a, (6.0, 30.0)),
            (a + b, (5.0, 13.0)),
            (a - b, (-1.0, 7.0)),
            (-a, (-2.0, -10.0)),
            (a / 2, (1.0, 5.0)),
            (5 * a, (10.0, 50.0)),
            (ct.series(a, b), (6.0, 30.0)),
            ((b * a) * b, (18.0, 90.0)),
        ):
            assert (out(system), out(system, {"a.k": 10.0})) == expected
        loop = ct.feedback(ct.ss(-1.0, 1.0, 1.0, 0.0), a)
        poles = [ct.linearize(loop, 0, 0, params=p).poles()[0].real for p in (None, {"a.k": 10})]
        np.testing.assert_allclose(poles, [-3.0, -11.0], rtol=1e-6)

    def test_one_block_twice_is_one_block(self):
        """python-control puts the same object twice: one name, one value, used in both places."""
        a = gain("a", 2.0)
        with pytest.warns(UserWarning, match="duplicate object"):
            square = a * a
        assert (out(square), out(square, {"a.k": 5.0})) == (4.0, 25.0)


class TestNested:
    def controllers(self, join, second="c2"):
        """Put two copies of one controller in series; both contain a block called law."""
        c1 = join([gain("law", 2.0, "u", "m")], inputs=["u"], outputs=["m"], name="c1")
        c2 = c1.copy(name=second)
        c2.update_names(inputs=["m"], outputs=["y"])
        return c1, c2

    @makers
    @given(one=st.floats(0.5, 9), two=st.floats(0.5, 9), u=st.floats(-3, 3))
    def test_two_copies_of_a_controller_never_collide(self, join, one, two, u):
        """c1.law.k and c2.law.k are two parameters, also when each differs from the default."""
        top = join(self.controllers(nlctl.interconnect), inputs=["u"], outputs=["y"], name="top")
        assert out(top, None, u) == 4.0 * u
        assert out(top, {"c1.law.k": one}, u) == pytest.approx(2 * one * u)
        assert out(top, {"c2.law.k": two}, u) == pytest.approx(2 * two * u)
        assert out(top, {"c1.law.k": one, "c2.law.k": two}, u) == pytest.approx(one * two * u)
        with pytest.raises(AmbiguousNameError, match=r"'law.k' could be c1.law.k or c2.law.k"):
            out(top, {"law.k": one})

    def test_a_block_shared_by_two_diagrams(self):
        """One block object in two named diagrams: each name is its own, or refused."""
        law = gain("law", 2.0)
        c1, c2 = (
            nlctl.interconnect([law], inputs=["u"], outputs=["y"], name=name)
            for name in ("c1", "c2")
        )
        c1.update_names(outputs=["m"])
        c2.update_names(inputs=["m"])
        try:
            top = nlctl.interconnect([c1, c2], inputs=["u"], outputs=["y"])
        except nlctl.errors.DiagramError:
            return
        assert out(top) == 4.0
        assert out(top, {"c1.law.k": 10.0}) == 20.0
        assert out(top, {"c2.law.k": 10.0}) == 20.0
        assert out(top, {"c2.law.k": 10.0, "c1.law.k": 3.0}) == 30.0

    @makers
    def test_a_nested_diagram_without_a_name(self, join):
        """python-control calls it sys[0]; its parameters are still found, short and full."""
        inner = chain(nlctl.interconnect)
        top = join([inner], inputs=["u"], outputs=["y"])
        for name in ("first.k", f"{inner.name}.first.k"):
            assert out(top, {name: 10.0}) == 30.0

    def test_a_block_without_a_name(self):
        """The same for a block: sys[0].k."""
        block = gain(None, 2.0)
        diagram = ct.interconnect([block], inputs=["u"], outputs=["y"])
        assert out(diagram, {f"{block.name}.k": 10.0}) == 10.0

    def test_equal_names_on_different_levels(self):
        """a.k of the diagram is not a.a.k of the diagram a inside it."""
        inner = nlctl.interconnect([gain("a", 2.0, "u", "m")], inputs=["u"], name="a")
        top = nlctl.interconnect([inner, gain("b", 3.0, "m", "y")], inputs=["u"], outputs=["y"])
        low = nlctl.interconnect([inner, gain("x", 3.0, "m", "y")], inputs=["u"], name="low")
        all_ = nlctl.interconnect(
            [low, gain("a", 5.0, "y", "z")], inputs=["u"], outputs=["z"], name="all"
        )
        assert out(top, {"a.a.k": 7.0}) == 21.0
        assert [out(all_, p) for p in ({"low.a.a.k": 7.0}, {"a.k": 7.0})] == [105.0, 42.0]
        assert out(all_, {"a.a.k": 7.0}) == 105.0


class TestCopies:
    @pytest.mark.parametrize("duplicate", [lambda s: s.copy(name="new"), copy.deepcopy, copy.copy])
    def test_a_copied_block_is_addressed_by_its_own_name(self, duplicate):
        """The copy answers to its name, the original is as before."""
        old = gain("old", 2.0)
        new = duplicate(old)
        assert out(new, {f"{new.name}.k": 5.0}) == 5.0
        new.params = {"k": 7.0}
        assert (out(new), out(old)) == (7.0, 2.0)
        if new.name != "old":
            with pytest.raises(UnknownNameError, match=r"'old.k' of block 'new'"):
                out(new, {"old.k": 5.0})

    @makers
    @pytest.mark.parametrize("duplicate", [lambda s: s.copy(name="new"), copy.deepcopy])
    def test_a_copied_diagram_is_independent(self, join, duplicate):
        """Defaults and overrides of the copy do not reach the original, nor the reverse."""
        old = chain(join, name="old")
        new = duplicate(old)
        new.params.update({"first.k": 10.0})
        assert (out(new), out(old)) == (30.0, 6.0)
        old.params.update({"first.k": 1.0})
        assert (out(new), out(old), out(new, {"second.k": 1.0})) == (30.0, 3.0, 10.0)
        outer = nlctl.interconnect([new], inputs=["u"], outputs=["y"])
        name = f"{new.name}.first.k" if join is nlctl.interconnect else "first.k"
        assert (out(outer), out(outer, {name: 2.0})) == (30.0, 6.0)


@dataclass(frozen=True)
class Tree:
    """A random diagram: blocks y = k u + 1 in series, grouped at will."""

    name: str
    k: float
    join: object = None
    copied: bool = False
    parts: tuple = ()

    def build(self, wires):
        """Make the system; `wires` counts the signals along the chain."""
        made_as = "made" if self.copied else self.name
        if not self.parts:
            i = next(wires)
            system = gain(made_as, self.k, f"s{i}", f"s{i + 1}", c=1.0)
        else:
            parts = [part.build(wires) for part in self.parts]
            ends = {"inputs": parts[0].input_labels, "outputs": parts[-1].output_labels}
            system = self.join(parts, **ends, name=made_as)
        return system.copy(name=self.name) if self.copied else system

    def leaves(self, path=""):
        """Yield (qualified name, gain) of the blocks, in series order."""
        if not self.parts:
            yield f"{path}{self.name}.k", self.k
        for part in self.parts:
            named = part.parts and part.join is nlctl.interconnect
            yield from part.leaves(path + (f"{part.name}." if named else ""))


names = st.sampled_from(["a", "b", "ba"])  # one of them ends like another
gains = st.floats(-2, 2).map(lambda k: round(k, 3))


def group(parts):
    return st.builds(
        Tree,
        name=names,
        k=gains,
        join=st.sampled_from(MAKERS),
        copied=st.booleans(),
        parts=st.lists(parts, min_size=1, max_size=3, unique_by=lambda t: t.name).map(tuple),
    )


trees = group(
    st.recursive(st.builds(Tree, name=names, k=gains, copied=st.booleans()), group, max_leaves=6)
)


class TestRandomNesting:
    @staticmethod
    def series(values):
        y = 1.0
        for k in values:
            y = k * y + 1
        return y

    @pytest.mark.slow
    @given(trees)
    def test_every_block_keeps_its_own_default(self, tree):
        """However blocks are nested, copied and named: the diagram computes with their gains."""
        expected = self.series(k for _, k in tree.leaves())
        assert out(tree.build(iter(range(99)))) == pytest.approx(expected)

    @given(trees, st.data())
    @settings(max_examples=many(150))
    def test_a_name_overrides_the_one_block_that_it_means(self, tree, data):
        """A path, or the end of one path, reaches one block; other names are refused."""
        paths = [name for name, _ in tree.leaves()]
        pieces = data.draw(st.sampled_from(paths)).split(".")
        name = ".".join(pieces[data.draw(st.integers(0, len(pieces) - 2)) :])
        value = data.draw(gains)
        meant = [p for p in paths if p == name] or [p for p in paths if p.endswith("." + name)]
        system = tree.build(iter(range(99)))
        if len(meant) > 1:
            with pytest.raises(AmbiguousNameError):
                out(system, {name: value})
            return
        new = self.series(value if path == meant[0] else k for path, k in tree.leaves())
        assert out(system, {name: value}) == pytest.approx(new)
        assert out(system) == pytest.approx(self.series(k for _, k in tree.leaves()))
        with pytest.raises(ParameterError, match=r"Affine needs k < 1000, got 1000 \(block '"):
            out(system, {name: 1000.0})
        system.params.update({name: value})
        assert out(system) == pytest.approx(new)
