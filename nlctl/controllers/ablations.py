"""The paper's controller with a piece left out or replaced: what is each piece worth?"""

import control as ct

from ..annotations import as_annotated
from ..arguments import of_type
from ..equations import equation
from ..params import param, record
from .adaptive import Zero, adaptive_neural
from .nussbaum import control_base


@record
class FixedGainLaw:
    """Control law (23) with a constant instead of the Nussbaum function.

        u = -kappa eta,   eta = beta r + W_hat^T psi + delta_hat tanh(r/tau) + Y_d

    It assumes an input gain whose sign is known and positive, as that of the paper's plants; N of
    (23) then has to be negative.  It has the inputs of `NussbaumLaw` and no output ``zeta``.

    Examples
    --------
    >>> law = nlctl.block(nlctl.controllers.FixedGainLaw(beta=2.0, kappa=10.0), "law")
    >>> print(law.output(0, [], [0.5, 0.25, 0.0, 0.0]))  # -kappa (beta r + W_psi)
    [-12.5]
    """

    beta: float = param(2.5, unit="1", meaning="gain of the filtered error", above=0)
    kappa: float = param(10.0, unit="1", meaning="fixed gain, instead of -N(zeta)", above=0)

    inputs = ("r", "W_psi", "robust", "Y_d")
    outputs = ("u",)

    @equation
    def output(t, x, u, p):
        """Equation (23) with -kappa instead of N(zeta)."""
        return (-p.kappa * control_base(u, p),)


@as_annotated
def replaced(controller: ct.InterconnectedSystem, **pieces: object) -> ct.InterconnectedSystem:
    """Return a controller like this one, with other pieces in some places.

    Parameters
    ----------
    controller : control.InterconnectedSystem
        Made by `adaptive_neural`; it is not changed.
    **pieces : record or control.InputOutputSystem
        As for `adaptive_neural`: ``law=``, ``weights=``, ...

    Returns
    -------
    control.InterconnectedSystem
        With the same name, inputs and outputs.

    Raises
    ------
    ParameterError, DiagramError
        As in `adaptive_neural`.

    Examples
    --------
    >>> law = nlctl.controllers.FixedGainLaw(kappa=5.0)
    >>> fixed = replaced(nlctl.adaptive_neural(order=2), law=law)
    >>> float(nlctl.parameters(fixed)["value"]["law.kappa"])
    5.0
    """
    of_type("replaced", "controller", controller, ct.InterconnectedSystem, "adaptive_neural(2)")
    specs = {s.name: getattr(s, "spec", None) or s.copy(name=s.name) for s in controller.syslist}
    order = sum(label.startswith("x") for label in controller.input_labels)
    return adaptive_neural(order, **(specs | pieces), name=controller.name)


@as_annotated
def ablations(
    controller: ct.InterconnectedSystem, kappa: float = FixedGainLaw.kappa
) -> dict[str, ct.InterconnectedSystem]:
    """Return a controller without each of its pieces, by label.

    What remains keeps its gains.

    Parameters
    ----------
    controller : control.InterconnectedSystem
        Made by `adaptive_neural`.
    kappa : float, optional
        Gain of the variant without a Nussbaum function, see `FixedGainLaw`.

    Returns
    -------
    dict
        "no network": W_hat^T psi = 0; "no robust term": delta_hat tanh(r/tau) = 0; "neither":
        both; "fixed gain": u = -kappa eta.

    Examples
    --------
    >>> list(ablations(nlctl.adaptive_neural(order=2)))
    ['no network', 'no robust term', 'neither', 'fixed gain']
    """
    beta = controller.syslist[controller.syslist_index["law"]].spec.beta
    no_network = {"weights": Zero(outputs=("W_psi", "W_norm"))}
    no_robust = {"robust": Zero(outputs=("robust", "delta_hat"))}
    return {
        "no network": replaced(controller, **no_network),
        "no robust term": replaced(controller, **no_robust),
        "neither": replaced(controller, **no_network, **no_robust),
        "fixed gain": replaced(controller, law=FixedGainLaw(beta=beta, kappa=kappa)),
    }
