"""Parameters: declared once, normalised, checked at birth and again when an override arrives."""

import dataclasses
import inspect
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.errors import UnknownNameError
from nlctl.params import (
    ParameterError,
    declared_params,
    equation_arguments,
    param,
    record,
    with_overrides,
)

BOUNDS = {
    "above": (lambda v: v > 2.0, "> 2"),
    "below": (lambda v: v < 2.0, "< 2"),
    "at_least": (lambda v: v >= 2.0, ">= 2"),
    "at_most": (lambda v: v <= 2.0, "<= 2"),
}


def bounded(kind):
    """Return a record class with a number and a vector that have the bound `kind` at 2."""
    good = 2.5 if kind in ("above", "at_least") else 1.5

    @record
    class Sample:
        a: float = param(good, unit="m", meaning="a", **{kind: 2.0})
        v: tuple[float, ...] = param((good, good), unit="m", meaning="v", **{kind: 2.0})

    return Sample


@record
class Mixed:
    """One parameter of every kind."""

    x: float = param(1.0, unit="m", meaning="a number", above=0, at_most=10)
    vector: tuple[float, ...] = param((1.0, 2.0), unit="1", meaning="a vector", at_least=0)
    matrix: tuple[tuple[float, ...], ...] = param(
        ((1.0, 2.0), (3.0, 4.0), (5.0, 6.0)), unit="1", meaning="a matrix"
    )
    count: int = param(3, unit="1", meaning="an integer", at_least=1)
    flag: bool = param(False, unit="1", meaning="a switch")
    note: str = "no parameter"

    inputs = ("u",)
    outputs = ("y",)
    states = ()
    feedthrough = True

    @staticmethod
    def output(t, x, u, p):
        """Depends on every parameter."""
        (u1,) = u
        total = p.x + np.sum(p.vector) + np.sum(p.matrix) + p.count + (100 if p.flag else 0)
        return (total * u1,)


class TestBounds:
    @pytest.mark.slow
    @pytest.mark.parametrize("kind", BOUNDS)
    @given(value=st.one_of(st.just(2.0), st.floats(-1e6, 1e6)))
    def test_a_bound_holds_exactly_where_it_says(self, kind, value):
        """A value is taken exactly when it satisfies the bound, equality included or not."""
        holds, text = BOUNDS[kind]
        cls = bounded(kind)
        if holds(value):
            assert cls(a=value).a == value
            assert cls(v=(value, value)).v == (value, value)
        else:
            with pytest.raises(ParameterError, match=re.escape(f"needs a {text}, got")):
                cls(a=value)
            good = cls().v[0]
            with pytest.raises(ParameterError, match=re.escape(f"v[1] {text}, got")):
                cls(v=(good, value))

    @each_row("kind", BOUNDS)
    def test_bounds_are_told_as_text(self, kind):
        """The declared rule reads as in the error message."""
        assert declared_params(bounded(kind))["v"].bounds == BOUNDS[kind][1]

    def test_two_bounds_are_both_checked_and_told(self):
        """A lower and an upper bound together."""
        assert declared_params(Mixed)["x"].bounds == "> 0, <= 10"
        assert Mixed(x=10).x == 10.0
        for bad, rule in ((0, "> 0"), (10.5, "<= 10")):
            with pytest.raises(ParameterError, match=re.escape(f"Mixed needs x {rule}, got {bad}")):
                Mixed(x=bad)

    @each_row("bad", [np.nan, np.inf, -np.inf])
    @each_row(
        ("name", "where", "make"),
        [
            ("x", "x", lambda b: b),
            ("vector", "vector[1]", lambda b: (1.0, b)),
            ("matrix", "matrix[0, 1]", lambda b: ((1.0, b), (2.0, 3.0))),
            ("count", "count", lambda b: b),
        ],
    )
    def test_nan_and_infinity_are_refused_by_name(self, bad, name, where, make):
        """No bound is needed for a value that is not a finite number; the element is named."""
        with pytest.raises(ParameterError, match=rf"Mixed needs an? .*{re.escape(where)}.*{bad}"):
            Mixed(**{name: make(bad)})


class TestKinds:
    @each_row(
        ("name", "value", "told"),
        [
            ("x", [1.0, 2.0], "x to be a number, got shape (2,)"),
            ("x", [[1.0]], "x to be a number, got shape (1, 1)"),
            ("vector", [[1.0, 2.0]], "vector to be a vector, got shape (1, 2)"),
            ("vector", (), "at least one value in vector"),
            ("matrix", [1.0, 2.0], "matrix to be a matrix, got shape (2,)"),
            ("matrix", np.zeros((0, 2)), "at least one value in matrix"),
            ("matrix", np.zeros((3, 0)), "at least one value in matrix"),
            ("matrix", [[1.0, 2.0], [3.0]], "numbers for matrix"),
            ("count", 2.5, "an integer for count, got 2.5"),
            ("count", [2], "count to be a number"),
            ("count", 0, "count >= 1, got 0"),
            ("flag", 1, "flag to be True or False, got 1"),
            ("flag", "yes", "flag to be True or False, got 'yes'"),
            ("x", "much", "numbers for x, got 'much'"),
            ("x", "3", "numbers for x, got '3'"),
            ("vector", ("1", "2"), "numbers for vector"),
            ("x", 1j, "numbers for x, got 1j"),
            ("x", {}, "numbers for x, got {}"),
        ],
    )
    def test_a_value_of_the_wrong_kind_is_refused(self, name, value, told):
        """Shapes, text, fractions for integers: the message tells rule and value."""
        with pytest.raises(
            ParameterError, match=re.escape("Mixed needs ") + f".*{re.escape(told)}"
        ):
            Mixed(**{name: value})

    def test_none_is_no_number(self):
        """None is refused and named (it would turn into NaN)."""
        for name in ("x", "count", "flag", "vector"):
            with pytest.raises(ParameterError, match=f"Mixed needs .*{name}"):
                Mixed(**{name: None})

    def test_numbers_are_normalised(self):
        """Arrays and lists become nested tuples of floats, integers int, switches bool."""
        made = Mixed(
            x=np.int32(2),
            vector=np.array([1, 2], dtype=np.float32),
            matrix=[[1, 2], [3, 4]],
            count=4.0,
            flag=np.True_,
        )
        assert made == Mixed(
            x=2.0, vector=(1.0, 2.0), matrix=((1.0, 2.0), (3.0, 4.0)), count=4, flag=True
        )
        kinds = [type(getattr(made, name)) for name in declared_params(made)]
        assert kinds == [float, tuple, tuple, int, bool]
        assert {type(v) for row in made.matrix for v in row} == {float}

    def test_a_number_stands_for_a_vector_of_one(self):
        """A vector of one element may be given as the number."""
        assert Mixed(vector=3).vector == (3.0,)

    @given(st.lists(st.floats(0, 1e9), min_size=1, max_size=5))
    def test_equal_values_make_equal_records(self, values):
        """A record is a value: equality and hash do not depend on how numbers were passed."""
        one, two = Mixed(vector=values), Mixed(vector=np.array(values))
        assert one == two
        assert hash(one) == hash(two)
        assert one != Mixed(vector=[*values, 1.0])

    def test_records_are_frozen_and_keyword_only(self):
        """A record never changes, and its parameters are given by name."""
        with pytest.raises(dataclasses.FrozenInstanceError):
            Mixed().x = 2.0
        with pytest.raises(TypeError, match="positional"):
            Mixed(1.0)

    def test_a_misspelt_parameter_is_named_with_the_nearest(self):
        """It is Python's kind of error and nlctl's; signatures stay readable."""
        for kind in (TypeError, UnknownNameError):
            with pytest.raises(kind, match="unknown parameter 'vectr' of Mixed; nearest: 'vector'"):
                Mixed(vectr=[1.0])
        assert list(inspect.signature(Mixed).parameters) == [
            field.name for field in dataclasses.fields(Mixed)
        ]

    def test_a_given_array_may_change_later(self):
        """A record does not share memory with the array that it was made from."""
        array = np.array([1.0, 2.0])
        made = Mixed(vector=array)
        array[0] = 7.0
        assert made.vector == (1.0, 2.0)

    def test_check_of_the_record_sees_normalised_values(self):
        """A record's own rule comes after the bounds and gets tuples."""

        @record
        class Ordered:
            v: tuple[float, ...] = param((1.0, 2.0), unit="1", meaning="rising values")

            def check(self):
                if sorted(self.v) != list(self.v):
                    raise ParameterError(f"Ordered needs rising v, got {self.v}")

        assert Ordered(v=np.array([1, 3])).v == (1.0, 3.0)
        with pytest.raises(ParameterError, match=r"rising v, got \(3.0, 1.0\)"):
            Ordered(v=[3, 1])


class TestOverrides:
    def test_the_message_of_a_bad_override(self):
        """Culprit, rule, value and block in one line."""
        actuator = nlctl.block(nlctl.DeadZone(), "actuator")
        with pytest.raises(ParameterError) as error:
            actuator.output(0, [], [1.0], params={"actuator.b_r": -0.1})
        assert str(error.value) == "DeadZone needs b_r >= 0, got -0.1 (block 'actuator')"

    @given(row=st.integers(0, 2), column=st.integers(0, 1), value=st.floats(-9, 9))
    def test_one_element_of_a_matrix(self, row, column, value):
        """`matrix[i, j]` replaces that element and no other."""
        changed = with_overrides(Mixed(), {f"matrix[{row}, {column}]": value}, "b")
        expected = np.array(Mixed().matrix)
        expected[row, column] = value
        assert changed == Mixed(matrix=expected)

    def test_elements_go_on_top_of_a_whole_vector(self):
        """The whole vector first, its elements afterwards, whatever the order of the dict."""
        for overrides in (
            {"vector": (5, 6, 7), "vector[1]": 0.5},
            {"vector[1]": 0.5, "vector": (5, 6, 7)},
        ):
            assert with_overrides(Mixed(), overrides, "b").vector == (5.0, 0.5, 7.0)

    @each_row(
        "key",
        ["vector[2]", "vector[0, 0]", "vector[x]", "vector[]", "vector[0.5]", "matrix[1]", "x[0]"]
        + ["vector[0", "vector[0]]", "vector[0]x"],
    )
    def test_a_bad_index_is_refused(self, key):
        """An element that does not exist, or is not written as one, names parameter and block."""
        with pytest.raises(ParameterError, match=rf"Mixed has {key[0]}.*\(block 'b'\)"):
            with_overrides(Mixed(), {key: 1.0}, "b")

    @each_row("value", [np.nan, -1.0, (1.0, 2.0), "text"])
    def test_a_bad_element_is_refused(self, value):
        """An element obeys the bounds of its vector."""
        with pytest.raises(ParameterError, match=r"vector.*\(block 'b'\)"):
            with_overrides(Mixed(), {"vector[1]": value}, "b")

    @each_row(
        ("name", "bad"), [("count", 1.5), ("count", np.nan), ("flag", 1), ("x", "3"), ("x", None)]
    )
    def test_overrides_obey_the_kind(self, name, bad):
        """Integers and switches stay such when overridden."""
        with pytest.raises(ParameterError, match=rf"Mixed needs .*{name}.*\(block 'b'\)"):
            with_overrides(Mixed(), {name: bad}, "b")

    def test_the_record_itself_stays(self):
        """Overrides make another record."""
        spec = Mixed()
        with_overrides(spec, {"x": 2.0, "matrix[0, 0]": 7.0}, "b")
        assert spec == Mixed()


class TestEquationArguments:
    def test_it_is_a_named_tuple_of_numbers_and_read_only_arrays(self):
        """Equations see numbers and arrays that they cannot change; other fields stay out."""
        p = equation_arguments(Mixed())
        assert isinstance(p, tuple)
        assert p._fields == ("x", "vector", "matrix", "count", "flag")
        assert (p.x, p.count, p.flag) == (1.0, 3, False)
        np.testing.assert_array_equal(p.matrix, [[1, 2], [3, 4], [5, 6]])
        for array in (p.vector, p.matrix):
            assert array.dtype == float
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0.0

    def test_derived_numbers_come_along(self):
        """What follows from the parameters is computed once per run, not per call."""
        p = equation_arguments(nlctl.FilteredStep(order=1, omega=3.0))
        np.testing.assert_allclose(p.coefficients, [9.0, 6.0], rtol=1e-15)
        assert not p.coefficients.flags.writeable

    def test_derived_numbers_follow_an_override(self):
        """An override changes what is derived from it: yd' = -omega yd before the step."""
        system = nlctl.block(nlctl.FilteredStep(order=0), "yd")
        for omega in (0.5, 4.0):
            slope = system.dynamics(-1.0, [2.0], [], params={"yd.omega": omega})
            assert slope == pytest.approx([-2 * omega], rel=1e-15)

    def test_the_type_is_made_once(self):
        """Equal records have arguments of one type, which compiled code relies on."""
        one, two = equation_arguments(Mixed(x=2.0)), equation_arguments(Mixed())
        assert type(one) is type(two)
