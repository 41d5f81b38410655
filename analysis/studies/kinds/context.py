"""What several kinds of analysis share: a response, and sources."""

from typing import Any

import numpy as np

from nlctl.errors import ParameterError
from nlctl.native import Status
from nlctl.wording import some_of

from ...robustness.runs.sweep import Sweep
from ...robustness.statistics.sensitivity import censored
from ..kind import Ground, column

CLOPPER = (
    "C. J. Clopper, E. S. Pearson: The use of confidence or fiducial limits illustrated in the "
    "case of the binomial. Biometrika 26 (1934), pp. 404–413. doi 10.1093/biomet/26.4.404."
)
ROBBINS = (
    "H. Robbins: Statistical methods related to the law of the iterated logarithm. Ann. Math. "
    "Statist. 41 (1970) 1397–1409. doi 10.1214/aoms/1177696786."
)
HOWARD = (
    "S. Howard, A. Ramdas, J. McAuliffe, J. Sekhon: Time-uniform, nonparametric, nonasymptotic "
    "confidence sequences. Ann. Statist. 49 (2021) 1055–1080. doi 10.1214/20-AOS1991."
)
HANSEN = (
    "N. Hansen: The CMA evolution strategy: a tutorial. arXiv 1604.00772 (2016). "
    "doi 10.48550/arXiv.1604.00772."
)
AUGER = (
    "A. Auger, N. Hansen: A restart CMA evolution strategy with increasing population size. CEC "
    "2005, 1769–1776. doi 10.1109/CEC.2005.1554902."
)
HOLM = (
    "S. Holm: A simple sequentially rejective multiple test procedure. Scand. J. Statist. 6 "
    "(1979) 65–70."
)
SEARCHED = (
    "a portfolio of corners of the box, uniform draws and CMA-ES with restarts and growing "
    "populations on the margin (Hansen 2016; Auger and Hansen 2005)"
)


def response(of: str, ground: Ground, done: Sweep) -> tuple[np.ndarray, str, dict[str, Any]]:
    """Return the column that a sensitivity is of, and how failed rows count: text and numbers."""
    values = column(done, of)
    if of in ("spec", *(r.key for r in ground.prepared.experiment.spec.requirements)):
        values, failed, least = censored(values)
        if not failed:
            return values, "", {}
        text = f" {failed} of them did not reach their end: each counts as a margin of {least:.4g}"
        text += ", no better than any of the others."
        return values, text, {"failed": failed, "counted_as": least}
    lacking = int(np.count_nonzero(~np.isfinite(values)))
    if lacking:
        failed = int(np.count_nonzero(column(done, "status") != Status.OK.name))
        lack = some_of(failed or lacking, done.done, "row", "has", "have")
        why = ", as runs did not reach their end" if failed else ""
        raise ParameterError(
            f"{lack} no finite '{of}'{why}: take a margin, such as "
            'of = "spec", which every row has, or a space without such rows'
        )
    return values, "", {}
