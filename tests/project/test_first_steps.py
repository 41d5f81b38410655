"""What people meet first: the block contract, help texts, plots, refusals with reasons."""

import dataclasses
import inspect

import control as ct
import matplotlib as mpl
import numpy as np
import pytest

import nlctl
from nlctl.analysis.catalogue import block_records
from nlctl.errors import UsageError

TIMES = np.linspace(0, 0.1, 6)


def test_the_block_contract_is_public_and_documented():
    """`nlctl.Spec` names what a record may declare."""
    text = inspect.getdoc(nlctl.Spec)
    assert text is not None
    for name in ("inputs", "outputs", "states", "feedthrough", "output", "update"):
        assert name in text


def test_help_of_equation_is_nlctls_own():
    assert "numba" not in (inspect.getdoc(nlctl.equation) or "").splitlines()[0].lower()
    assert nlctl.equation.__module__.startswith("nlctl")


@pytest.mark.parametrize("kind", block_records().values(), ids=lambda kind: kind.__name__)
def test_every_record_documents_its_fields(kind):
    """A Parameters section names each field that can be given."""
    fields = [f.name for f in dataclasses.fields(kind) if f.init]
    text = inspect.getdoc(kind) or ""
    if fields:
        section = text.partition("Parameters\n----------")[2]
        assert [name for name in fields if name not in section] == []


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_a_closed_loop_without_inputs_plots(engine):
    """And says in a few lines what it is."""
    mpl.use("Agg")
    loop = nlctl.paper.example_1()
    response = nlctl.input_output_response(loop, TIMES, engine=engine)
    assert response.plot() is not None
    mpl.pyplot.close("all")
    assert repr(response).startswith(f"Response of '{loop.name}': 6 times from 0 to 0.1 s")
    assert len(repr(response).splitlines()) <= 6


def test_continuous_records_take_no_dt():
    """x' is not x[k+1]."""
    with pytest.raises(UsageError, match="dt"):
        nlctl.block(nlctl.plants.ForcedDuffing(), "plant", dt=0.1)


def test_a_controller_of_another_order_than_the_plant_is_refused():
    with pytest.raises(UsageError, match="order"):
        nlctl.interconnect(
            {
                "reference": nlctl.SumOfSines(order=3),
                "plant": nlctl.plants.Genesio(),
                "controller": nlctl.adaptive_neural(),
                "actuator": nlctl.DeadZone(),
            }
        )


def test_ensembles_and_parameters_take_diagrams_and_records():
    """A diagram is compiled, a record shows its table."""
    many = nlctl.ensemble_response(
        nlctl.paper.example_1(), TIMES, params={"actuator.b_r": [0.4, 0.5]}
    )
    assert len(repr(many)) < 2000
    assert "b_r" in " ".join(map(str, nlctl.parameters(nlctl.DeadZone()).index))


def test_linearization_of_what_is_compiled_is_its_own_method():
    """python-control looks at the type before it asks; the docstring says what to call."""
    decay = ct.nlsys(lambda t, x, u, p: [u[0] - 2.0 * x[0]], states=1, inputs=1, name="decay")
    assert nlctl.compile(decay).linearize([1.0]).A == [[-2.0]]
    assert "linearize" in (inspect.getdoc(nlctl.native.Compiled) or "")
