r"""What the integral of the Nussbaum function says of a burst: how high it gets, and where it ends.

Where N has the wrong sign (k G N > 0) the law (23), (24) feeds r.  Along every loop with it

.. math:: \frac{d}{d\zeta} \frac{r^2}{2} = k G N(\zeta) + \frac{c}{\eta}, \quad
   r' = k G N \eta + c, \quad \zeta' = r \eta,

as long as r eta > 0, so that zeta grows.  The lobe of the wrong sign gives r^2/2 its integral,
times k G; the next one, of the right sign, takes it away again, and zeta rests where nothing is
left.  As the lobes of a Nussbaum function of type B grow, that is early in the next lobe, whatever
k G is within its bounds; for a constant k G it is where the integral of N is 0, whatever its
value.
"""

import itertools

import numpy as np

from nlctl import functions
from nlctl.annotations import as_annotated
from nlctl.arguments import number
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.params import as_numbers

from .property import Antiderivative, GainFunction, Lobe, antiderivative, lobe_around, root


@described_record(made_by="aftermath")
class Aftermath:
    """Bounds of a burst through one lobe of the wrong sign, and of where zeta rests after it."""

    wrong: Lobe  # Lobe that feeds r, and the one after it, which stops it.
    right: Lobe
    # Bounds of max \|r\|; the upper one is infinite if zeta may cross the second lobe as well.
    peak: tuple[float, float]
    # Bounds of the zeta at which r^2/2 is spent; infinite as the upper one of `peak`.
    rest: tuple[float, float]

    def __str__(self) -> str:
        return (
            f"through ({self.wrong.low:.6g}, {self.wrong.high:.6g}): max |r| from "
            f"{self.peak[0]:.4g} to {self.peak[1]:.4g}, at rest at zeta from {self.rest[0]:.6g} to "
            f"{self.rest[1]:.6g}"
        )


@as_annotated
def aftermath(
    zeta: float,
    N: GainFunction = functions.nussbaum,
    *,
    kG: tuple[float, float] = (1.0, 1.0),
    energy: float = 0.0,
    drag: float = 0.0,
) -> Aftermath:
    """Bound a burst: the largest \\|r\\|, and the zeta at which it has ended.

    Parameters
    ----------
    zeta : float
        Where the burst begins, in a lobe in which N has the wrong sign (k G N > 0).
    N : callable, optional
        The Nussbaum function of the law.
    kG : (float, float), optional
        Bounds of actuator gain times input gain during the burst, > 0.
    energy : float, optional
        r^2/2 at the beginning.
    drag : float, optional
        Bound of \\|c / eta\\|: of what else drives r, over eta.

    Returns
    -------
    Aftermath
        It holds for every loop with the law (23), (24) while r eta > 0.

    Raises
    ------
    ParameterError
        If N does not have the wrong sign at zeta, or no lobe of the right sign follows.

    Examples
    --------
    Where k G is constant, zeta rests where the integral of N since the beginning is 0:

    >>> from nlctl.analysis.lyapunov import aftermath
    >>> found = aftermath(3.0, kG=(2.0, 2.0))
    >>> low, high = found.rest
    >>> print(round(low, 4), round(high, 4))
    5.1012 5.1012
    >>> I = nlctl.functions.nussbaum_integral
    >>> bool(abs(I(low) - I(3.0)) < 1e-6 * found.wrong.budget)
    True
    """
    ends = as_numbers(kG)
    if ends is None or ends.shape != (2,) or not 0 < ends[0] <= ends[1] < np.inf:
        raise ParameterError(f"aftermath needs kG = (low, high) > 0, got {kG!r}")
    low, high = float(ends[0]), float(ends[1])
    number("aftermath", "energy", energy, at_least=0)
    number("aftermath", "drag", drag, at_least=0)
    wrong = lobe_around(zeta, N)
    if not wrong.sign > 0:
        raise ParameterError(
            f"N is {float(N(zeta)):.4g} at zeta = {zeta:g}: a burst is fed where N > 0"
        )
    right, I = lobe_around(wrong.high, N), antiderivative(N)  # noqa: E741
    gained, length = float(I(np.array(wrong.high)) - I(np.array(zeta))), wrong.high - zeta
    least = energy + low * gained - drag * length
    most = energy + high * gained + drag * length
    first = _spent(right, I, least, high, -drag)
    last = _spent(right, I, most, low, drag)
    highest = most + _still_gained(right, N, low, drag) if np.isfinite(last) else np.inf
    return Aftermath(
        wrong=wrong,
        right=right,
        peak=(float(np.sqrt(2 * max(least, 0.0))), float(np.sqrt(2 * highest))),
        rest=(first, last),
    )


def _still_gained(lobe: Lobe, N: GainFunction, kG: float, drag: float) -> float:
    """Bound what the drag adds at the beginning of a lobe, before N outweighs it."""
    if drag == 0:
        return 0.0
    return drag * (root(lambda z: kG * float(N(z)) + drag, lobe.low, lobe.place) - lobe.low)


def _spent(lobe: Lobe, I: Antiderivative, energy: float, kG: float, drag: float) -> float:  # noqa: E741
    """Return where a lobe of the right sign has taken all energy; infinite if it does not."""
    if energy <= 0:
        return lobe.low
    start = float(I(np.array(lobe.low)))

    def left(z: float) -> float:
        return energy + kG * (float(I(np.array(z))) - start) + drag * (z - lobe.low)

    ends = np.linspace(lobe.low, lobe.high, 65)
    for a, b in itertools.pairwise(ends):
        if left(float(b)) <= 0:
            return root(left, float(a), float(b))
    return np.inf
