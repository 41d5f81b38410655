"""The proofs that there are, and bounds that hold for all time: which proof a loop is one for."""

from collections.abc import Mapping, Sequence
from typing import Any

import control as ct

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, number
from nlctl.diagrams import leaves
from nlctl.errors import DiagramError, ParameterError

from ...intervals.box import Box
from ..attraction.barrier import BARRIER
from ..attraction.region import ATTRACTION
from ..bounds.decomposition import check_gain
from ..loop.roles import declared, record_of
from ..model_reference.closing import MODEL_REFERENCE
from ..proofs.kind import ProofOptions, certified
from ..proofs.result import Certificate
from .known_sign import KNOWN_SIGN
from .sliding_mode import SLIDING_MODE

# the kinds of proof; a loop is proved by the first of those that it fits
PROOFS = (MODEL_REFERENCE, SLIDING_MODE, KNOWN_SIGN, ATTRACTION, BARRIER)


@as_annotated
def certify(
    loop: Any,
    *,
    params: Mapping[str, Any] | None = None,
    inputs: Mapping[str, float] | None = None,
    starts: Mapping[str, Any] | Box | None = None,
    k: tuple[float, float] | None = None,
    W: Sequence[float] | None = None,
    u_max: float = 250.0,
    tol: float = 1e-3,
    max_iterations: int = 60,
) -> Certificate:
    """Prove a bound of the tracking error for all time, or say why it cannot be proved.

    Which proof it is depends on the controller.  With `nlctl.controllers.KnownSignLaw`: |r| <= C_0
    by (31) with a known sign.  With a reference model, as `nlctl.mrac` makes one: V = E^T P E +
    lambda |W_hat - W|^2 / Gamma, for weights with sigma- or e-modification or projection, and
    without any if nothing disturbs.  With `nlctl.controllers.SlidingModeLaw`: |r| falls wherever K
    dominates.  The box is closed by a monotone iteration bound -> box -> disturbance -> bound from
    below, in ball arithmetic; every constant is proved on the box that is used.

    Parameters
    ----------
    loop : control.InterconnectedSystem
        A plant of class (1), an actuator with a split (2), a reference, and one of these
        controllers; of the blocks that `nlctl.paper.example_1` connects, with
        `nlctl.controllers.KnownSignLaw` instead of the Nussbaum law and a `nlctl.SumOfSines`
        reference.
    params : mapping, optional
        Overrides by qualified name, as in a run.
    inputs : mapping, optional
        Bound of |w| for every external input w of the diagram, by name.  It must be added to the
        plant's v, whatever its gain; it then belongs to eps_u.
    starts : mapping or Box, optional
        The initial states that the bounds shall hold for, at t = 0.  By state, or by the name of a
        vector of states (``"weights.W_hat"``): a number, or ``(low, high)``.  States that are not
        named start where the loop starts, so that by default this is one point.  With a
        reference model ``"V"`` bounds V(0): plant and weights may then start anywhere in that
        level set, unless they are named, too; the states of the model are always taken from the
        box.
    k : (k_1, k_2), optional
        Bounds that the actuator's k shall have, see `decompose`; a tight choice makes eps_u*
        small.
    W : sequence of l floats, optional
        Of model reference adaptive control: the weights that V is about, any choice; by default
        those by which the regressor spans the plant's equation, as far as it does.
    u_max : float, optional
        Half the range of u for which the actuator's split is proved; the bound of |u| must lie
        in the range.
    tol : float, optional
        Relative tolerance of the proved suprema.
    max_iterations : int, optional
        Rounds C -> box -> C after which the proof is given up.

    Returns
    -------
    Certificate
        The proved bounds with their constants and box, or why there are none: a
        `KnownSignCertificate`, `SlidingModeCertificate` or `ModelReferenceCertificate`.

    Raises
    ------
    DiagramError
        If the loop has other blocks, connections or equations than the proof is about, or an
        external input without a bound.
    UnknownNameError, AmbiguousNameError
        If `starts` names no state, or several.
    DecompositionError
        If the actuator has no split (2).
    ParameterError
        If `u_max`, `tol` or `max_iterations` is not positive, a bound of an input or an end of a
        start is refused,
        or `W` is of another size, or of a loop without a reference model.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import certify
    >>> law = nlctl.controllers.KnownSignLaw()
    >>> robust = nlctl.controllers.RobustTerm(sigma_2=1e-4, gamma=1e5)
    >>> weights = nlctl.controllers.AdaptiveWeights(Gamma=10.0)
    >>> controller = nlctl.adaptive_neural(2, law=law, weights=weights, robust=robust)
    >>> found = certify(nlctl.paper.example_1(controller=controller))
    >>> known = (2 * max(found.V_0, found.alpha_0 / found.alpha_1)) ** 0.5
    >>> print(found.holds, abs(found.C_0 - known) < 1e-9)
    True True

    Model reference adaptive control of x' = 2 x + v + 0.5 sin t with sigma-modification; the closed
    form of completed squares, with k = 1, P = 1/2, D = 1/2, sigma = 0.2, W = 2, is V <= 0.925:

    >>> plant = nlctl.PureFeedback(
    ...     order=1, f=lambda x, v: 2.0 * x[0] + v, d=lambda x, t: 0.5 * np.sin(t)
    ... )
    >>> weights = nlctl.controllers.AdaptiveWeights(nodes=2, Gamma=5.0, sigma_1=0.2)
    >>> controller = nlctl.mrac(nlctl.controllers.ReferenceModel(a=(1.0,), b=0.0), weights=weights)
    >>> blocks = {"reference": nlctl.SumOfSines(order=0), "actuator": nlctl.Gain()}
    >>> found = certify(nlctl.interconnect({**blocks, "plant": plant, "controller": controller}))
    >>> print(found.holds, round(found.V_max, 6))
    True 0.925

    From a box of starts, in which V(0) is larger:

    >>> found = certify(
    ...     nlctl.interconnect({**blocks, "plant": plant, "controller": controller}),
    ...     starts={"plant.x1": (-1.0, 1.0), "weights.W_hat": (0.0, 1.0)},
    ... )
    >>> print(found.status, round(found.V_max, 6), round(found.V_0, 6))
    proved 1.5 1.5
    """
    max_iterations = integer("certify", "max_iterations", max_iterations, at_least=1)
    for name, value in (("u_max", u_max), ("tol", tol)):
        number("certify", name, value, above=0)
    check_gain("certify", k)
    kind = next((kind for kind in PROOFS if kind.fits is not None and kind.fits(loop)), None)
    if W is not None and not (kind and kind.takes_W):
        raise ParameterError("certify takes W for loops with a reference model only")
    if kind is None:
        _refuse_others(loop)
        kind = KNOWN_SIGN  # which says what else the loop lacks
    return certified(kind, loop, ProofOptions(
        params=params, inputs=inputs, starts=starts, k=k, W=W, u_max=u_max, tol=tol,
        max_iterations=max_iterations,
    ))  # fmt: skip


def _refuse_others(loop: object) -> None:
    """Refuse a loop whose law is none that there is a proof for."""
    for place in leaves(loop) if isinstance(loop, ct.InterconnectedSystem) else ():
        spec = record_of(place)
        if "u" in declared(place, "outputs") and spec is not None:
            laws = ", ".join(kind.about for kind in PROOFS if kind.fits is not None)
            raise DiagramError(
                f"certify has proofs for {laws}, got {type(spec).__name__} as "
                f"'{place.path}' and no ReferenceModel: nlctl.mrac, nlctl.sliding_mode and "
                "nlctl.adaptive_neural(order, law=nlctl.controllers.KnownSignLaw()) make such loops"
            )
