"""The first order of a loop at a row of a study."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.arguments import of_type
from nlctl.errors import AuditError, DivergedError, UsageError
from nlctl.sensitivities import sensitivity_response

from ..runs.experiment import Prepared, by_diagram
from ..uncertainty.space import arguments, checked_row, ends
from .evaluation import as_table
from .first_order import FirstOrder


@as_annotated
def first_order(prepared: Prepared, row: Mapping[str, Any]) -> FirstOrder:
    """Simulate a row with the derivatives of all outputs by all quantities of its space.

    Parameters
    ----------
    prepared : Prepared
        The experiment, compiled: what `prepare` returns.
    row : mapping
        ``{name: value}``, a number or label for each name of the space.

    Returns
    -------
    FirstOrder
        What `worst_case` asks as ``derivatives=functools.partial(first_order, prepared)``.  Where
        there is no derivative its `reason` says why.

    Raises
    ------
    UnknownNameError, ParameterError
        If the row lacks a quantity, has another one, or a number is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> import nlctl
    >>> from nlctl.analysis.robustness import (
    ...     Experiment, Requirement, Space, Spec, Uncertain, always, first_order, in_band, prepare
    ... )
    >>> space = Space(quantities=(Uncertain(name="lag.T", bounds=(0.5, 1.5), nominal=1.0),))
    >>> low = Requirement(key="low", formula=always(in_band("v", upper=0.9)), until=1.0)
    >>> experiment = Experiment(
    ...     space=space, build=lambda: nlctl.actuators.cascade({"lag": nlctl.Lag()}),
    ...     spec=Spec(requirements=(low,)), timepts=np.linspace(0, 1, 101), inputs=1.0,
    ... )
    >>> made = first_order(prepare(experiment), {"lag.T": 1.0})
    >>> print(round(made.derivatives["v"][-1, 0], 6), round(-np.exp(-1), 6))  # -exp(-1/T)/T^2
    -0.367879 -0.367879
    """
    study = of_type("first_order", "prepared", prepared, Prepared, "prepare(experiment)").experiment
    row = checked_row(study.space, row)
    table = as_table(study.space, [row])
    ((loop, _),) = by_diagram(prepared, table)
    given = arguments(study.space, table)
    names = [quantity.name for quantity in study.space.quantities]
    try:
        run = sensitivity_response(
            loop, study.timepts, study.inputs,
            {name: float(values[0]) for name, values in given["initial_state"].items()} or None,
            with_respect_to=names, params={k: v[0] for k, v in given["params"].items()},
            rtol=study.rtol, atol=study.atol, max_steps=study.max_steps,
            method="auto" if study.method == "taylor" else study.method,  # one that can have them
        )  # fmt: skip
    except AuditError:
        raise
    except (UsageError, DivergedError) as error:
        return _none(prepared, str(error))
    low, high = ends(study.space).to_numpy()
    return FirstOrder(
        t=run.time,
        signals=dict(zip(run.signals, run.values, strict=True)),
        derivatives={
            signal: (run.derivatives[i] * (high - low)[:, None]).T
            for i, signal in enumerate(run.signals)
        },
        requirements=study.spec.requirements,
        reason=run.message or "",
    )


def _none(prepared: Prepared, reason: str) -> FirstOrder:
    return FirstOrder(
        t=np.empty(0), signals={}, derivatives={},
        requirements=prepared.experiment.spec.requirements, reason=reason,
    )  # fmt: skip
