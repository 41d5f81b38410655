"""How a study was done, what it does not show, and the sources."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.studies.result import Result

    from .loop import Published

__all__ = ["CLOPPER", "METHODS", "limits", "methods"]

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
DONZE = (
    "A. Donzé, O. Maler: Robust satisfaction of temporal logic over real-valued signals. FORMATS "
    "2010, LNCS 6246, 92–106. doi 10.1007/978-3-642-15297-9_9."
)
HANSEN = (
    "N. Hansen: The CMA evolution strategy: a tutorial. arXiv 1604.00772 (2016). "
    "doi 10.48550/arXiv.1604.00772."
)
AUGER = (
    "A. Auger, N. Hansen: A restart CMA evolution strategy with increasing population size. CEC "
    "2005, 1769–1776. doi 10.1109/CEC.2005.1554902."
)
ZELLER = (
    "A. Zeller, R. Hildebrandt: Simplifying and isolating failure-inducing input. IEEE Trans. "
    "Softw. Eng. 28 (2002) 183–200. doi 10.1109/32.988498."
)
MORRIS_1991 = (
    "M. Morris: Factorial sampling plans for preliminary computational experiments. Technometrics "
    "33 (1991) 161–174. doi 10.1080/00401706.1991.10484804."
)
SALTELLI = (
    "A. Saltelli, P. Annoni, I. Azzini, F. Campolongo, M. Ratto, S. Tarantola: Variance based "
    "sensitivity analysis of model output. Comput. Phys. Commun. 181 (2010) 259–270. "
    "doi 10.1016/j.cpc.2009.09.018."
)
SOBOL_2001 = (
    "I. Sobol': Global sensitivity indices for nonlinear mathematical models and their Monte Carlo "
    "estimates. Math. Comput. Simul. 55 (2001) 271–280. doi 10.1016/S0378-4754(00)00270-6."
)
SPEAR = (
    "R. Spear, G. Hornberger: Eutrophication in Peel Inlet, II: identification of critical "
    "uncertainties via generalized sensitivity analysis. Water Research 14 (1980) 43–49. "
    "doi 10.1016/0043-1354(80)90040-8."
)
MCNEMAR_1947 = (
    "Q. McNemar: Note on the sampling error of the difference between correlated proportions or "
    "percentages. Psychometrika 12 (1947) 153–157. doi 10.1007/BF02295996."
)
HOLM = (
    "S. Holm: A simple sequentially rejective multiple test procedure. Scand. J. Statist. 6 "
    "(1979) 65–70."
)
EFRON = (
    "B. Efron: Better bootstrap confidence intervals. J. Amer. Statist. Assoc. 82 (1987) 171–185. "
    "doi 10.1080/01621459.1987.10478410."
)

SEARCHED = (
    "a portfolio of corners of the box, uniform draws and CMA-ES with restarts and growing "
    "populations on the margin (Hansen 2016; Auger and Hansen 2005)"
)
METHODS = {  # kind of analysis: how it is done, and the sources
    "probability": (
        "The bounds of the probability of a violation are exact for independent draws (Clopper and "
        "Pearson 1934). The running estimate is drawn with a confidence sequence, valid at every "
        "number of runs (Robbins 1970; Howard et al. 2021).",
        (CLOPPER, ROBBINS, HOWARD),
    ),
    "sequential": (
        "The sequential test uses a confidence sequence, valid at every number of runs (Robbins "
        "1970; Howard et al. 2021).",
        (ROBBINS, HOWARD),
    ),
    "worst case": (
        f"The worst case was searched for by {SEARCHED}. A violation is run again at a hundredth "
        "of the tolerances with an explicit and a stiff integrator before it is called confirmed, "
        "and shrunk to few deviations (Zeller and Hildebrandt 2002).",
        (HANSEN, AUGER, ZELLER),
    ),
    "radius": (
        f"At each size of the radius the box was searched by {SEARCHED}, with the same random "
        "numbers; each violation is moved towards nominal along its ray.",
        (HANSEN, AUGER, CLOPPER),
    ),
    "degradation": (
        "The intervals along the degradation curve are exact for independent draws (Clopper and "
        "Pearson 1934); all sizes use the same random numbers.",
        (CLOPPER,),
    ),
    "morris": (
        "Screening walks through the box, one quantity a step (Morris 1991).",
        (MORRIS_1991,),
    ),
    "sobol": (
        "Shares of the variance are estimated from two Sobol' samples and their mixtures (Sobol' "
        "2001; Saltelli et al. 2010).",
        (SOBOL_2001, SALTELLI),
    ),
    "regional": (
        "Regional sensitivity compares the values in failing and in passing runs (Spear and "
        "Hornberger 1980) by the test of Kolmogorov and Smirnov, choices by chi-square; p-values "
        "are adjusted for their number (Holm 1979).",
        (SPEAR, HOLM),
    ),
    "failure map": (
        "The failure map starts from a grid and divides cells where the margin changes its sign, "
        "or may do so between the corners.",
        (),
    ),
    "compare": (
        "Controllers are compared on the same samples: violations by McNemar's test, exact (1947), "
        "medians of paired differences by exact intervals and the sign test, means by bootstrap "
        "(Efron 1987); p-values are adjusted for the number of pairs (Holm 1979).",
        (MCNEMAR_1947, EFRON, HOLM, CLOPPER),
    ),
}


def methods(result: Result, published: Published | None = None) -> tuple[list[str], list[str]]:
    """Return how a study was done, as paragraphs, and the sources that they name."""
    study = result.study
    first = (
        f"Each run is a simulation of {study.time.end:g} s by nlctl's compiled code of the "
        f"python-control diagram (rtol {study.solver.rtol:g}, atol {study.solver.atol:g}), sampled "
        f"every {study.time.step:g} s. Margins follow the quantitative semantics of signal "
        "temporal logic (Donzé and Maler 2010), with the peaks between samples taken from "
        "parabolas."
    )
    if result.rows is not None and study.runs is not None:
        first += f" The main table has {result.rows.done} rows (design: {study.runs.design})."
    kinds = dict.fromkeys(f.kind for f in result.findings if f.is_answered)
    told = [METHODS[kind][0] for kind in kinds if kind in METHODS]
    sources = [text for kind in kinds if kind in METHODS for text in METHODS[kind][1]]
    loop = [published.citation] if published else []
    return [first, *told], list(dict.fromkeys([*loop, DONZE, *sources]))


def limits(result: Result) -> list[str]:
    """Return what a study does not show, as paragraphs."""
    study = result.study
    count = len(result.quantities)
    varied, law = "one quantity was", "law given there, which is assumed"
    if count > 1:
        varied = f"the {count} quantities listed above were"
        law = "laws given there, which are assumed, and taken to be independent of each other"
    found = [
        f"Only {varied} varied, within the box given there unless an analysis says otherwise, and "
        f"by the {law}. What happens with other laws was not looked at.",
        f"Runs end at {study.time.end:g} s. Nothing follows for later times.",
        "All this was sampled, nothing is proved: a search that finds no violation does not show "
        "that there is none, and a bound of a probability is no bound of a single run.",
        f"Signals were sampled every {study.time.step:g} s, so that what is faster is not seen, "
        f"and integrated to rtol {study.solver.rtol:g}. The model is taken to be the real loop.",
    ]
    if len(result.claims) > 1:
        found.append(
            "Each bound and interval holds with its own confidence, unless it says otherwise; that "
            "all of them hold together is less likely."
        )
    return found
