"""What the report's part on the proof is made of: one loop, examined, and runs that are kept."""

import json
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import field, replace
from pathlib import Path
from threading import Event
from typing import cast

import control as ct
import numpy as np

from nlctl import native, paper
from nlctl.attributes import described_record
from nlctl.native import compile as compiled
from nlctl.response import input_output_response

from ..lyapunov.certificate.certify import certify
from ..lyapunov.certificate.known_sign import KnownSignCertificate
from ..lyapunov.conservatism import Conservatism, conservatism
from ..lyapunov.constants import premises
from ..lyapunov.examination import compile_examination_ahead as examine_ahead
from ..lyapunov.examination import examine
from ..lyapunov.inequalities import inequalities, terms
from ..lyapunov.ledger import Ledger, ledger
from ..lyapunov.lines import assumptions
from ..lyapunov.loop.signals import Margin, signals_of
from ..lyapunov.nussbaum.energy import finite_signal
from ..lyapunov.nussbaum.long_run import LONG_RUN_SIGNALS, LOOKS, LongRun, long_run
from ..lyapunov.nussbaum.slow_drift import SlowDrift
from ..metrics import peak
from .burst import Burst, through_the_burst
from .controllers import compared_controllers

RECORD = Path(__file__).with_name("example-2-burst.csv")
AGREE = 5.0  # s; bursts at two tolerances differ by less


def read_record(beginning: LongRun, path: Path = RECORD) -> LongRun:
    """Return the record as a run, with the lobe and the predictions of a run made today."""
    with path.open(encoding="utf-8") as file:
        about = json.loads(file.readline().removeprefix("# "))
        time, *rows = np.loadtxt(file, delimiter=",").T
    signals = dict(zip(LONG_RUN_SIGNALS, rows, strict=True))
    about["again"] = about["again"] and tuple(about["again"])
    about["last"] = tuple(about.get("last", ()))
    return replace(beginning, time=time, signals=signals, **about)


def continued(beginning: LongRun, record: LongRun) -> LongRun:
    """Return a run that continues the record where it ends."""
    end = beginning.time[-1]
    before = float(np.interp(end, record.time, record.signals["zeta"]))
    if not abs(before - beginning.signals["zeta"][-1]) < 1e-4:
        raise ValueError(
            f"the record of '{record.loop}' has zeta = {before:.5f} at {end:g} s, a run of today "
            f"{beginning.signals['zeta'][-1]:.5f}: make it again with "
            "'python campaign/burst_record.py', in a checkout"
        )
    later = record.time > end
    signals = {
        name: np.append(y, record.signals[name][later]) for name, y in beginning.signals.items()
    }
    return replace(record, time=np.append(beginning.time, record.time[later]), signals=signals)


SPLIT = {"example_1": (0.6, 1.3)}  # bounds of the dead zone's k that make eps_u* small
LOOK = min(LOOKS)  # s; from so much of a run the slow drift of zeta is predicted
FAR_HORIZONS = {  # key of a run far beyond 20 s: what it is, and its horizon (s)
    "2": ("Example 2 as published", 9_600.0),
    "1": ("Example 1 as printed, cos(w(t) t)", 1_000.0),
    "1-integral": ("Example 1 with the phase ∫ w dt", 1_000.0),
}


@described_record
class Evidence:
    """What was found about the proof of one loop."""

    ledger: Ledger
    conservatism: Conservatism
    slow_drift: SlowDrift  # Told from the first 200 s.
    # Of the same plant and actuator with the law that knows the sign of the gain.
    certificate: KnownSignCertificate
    certified_max_r: float  # max |r| of a run of that loop.
    t: np.ndarray = field(repr=False)  # (m,)
    curves: Mapping[str, np.ndarray] = field(repr=False)  # V and its bounds over `t`, by name.
    # Assumptions and numbered steps of the proof over `t`.
    assumptions: tuple[Margin, ...] = field(repr=False)
    margins: tuple[Margin, ...] = field(repr=False)


def evidence(loop: ct.InterconnectedSystem, horizon: float = 20.0) -> Evidence:
    """Examine the proof for one of the paper's examples."""
    study = examine(loop, horizon)
    run, constants = study.runs.first, study.constants
    given, s = premises(constants, run.gains), run.signals
    margins = inequalities(s, given)
    by_number = {m.equation: m.margin for m in margins}
    x = terms(s, given)
    tame = known_sign(loop)
    return Evidence(
        ledger=ledger(study),
        conservatism=conservatism(study),
        slow_drift=long_run(loop, LOOK, rtol=1e-7).predictions[0],
        certificate=cast(KnownSignCertificate, certify(tame, k=SPLIT.get(str(loop.name)))),
        certified_max_r=_max_r(tame, s.t),
        t=s.t,
        curves={
            "level (34), $C_0^2/2$": x.V + by_number["(34)"],
            "bound (32)": x.V + by_number["(32)"],
            "$V$": x.V,
            "$r^2/2$": x.r**2 / 2,
        },
        assumptions=tuple(
            m for m in assumptions(s, given, constants.box, np.inf) if m.equation != "A1 range"
        ),
        margins=margins,
    )


def compile_evidence_ahead(loop: ct.InterconnectedSystem) -> None:
    """Compile the diagrams that `evidence` runs besides the example itself."""
    examine_ahead(loop)
    native.compile_ahead(compiled(known_sign(loop)))


def _max_r(loop: ct.InterconnectedSystem, times: np.ndarray) -> float:
    response = input_output_response(compiled(loop), times)
    return peak(times, finite_signal(signals_of(response), "r"))


def known_sign(loop: ct.InterconnectedSystem) -> ct.InterconnectedSystem:
    """Return an example with the law that knows the sign of the gain, and gains that suit it."""
    name = str(loop.name)
    return paper.EXAMPLES[name](controller=compared_controllers(name)["certified"])


@described_record
class FarRuns:
    """The loops far beyond 20 s."""

    runs: Mapping[str, LongRun] = field(default_factory=dict)  # By key of `FAR_HORIZONS`.
    burst: Burst | None = None  # Example 2 beyond its run, if it bursts.


NO_FAR_RUNS = FarRuns()


@contextmanager
def far_runs_in_background(*, whole: bool = False) -> Iterator[Future[FarRuns]]:
    """Run `FAR_HORIZONS` in a thread while the body continues; an early exit ends the runs."""
    # Example 2 is run as far as its burst is predicted from, and continues the record of
    # `nlctl.analysis.paper.evidence`; with `whole` it is run to its burst, which takes
    # minutes.
    stop = Event()
    with ThreadPoolExecutor(1) as pool:
        try:
            yield pool.submit(_far_runs, stop, whole)
        finally:
            stop.set()


def _far_runs(stop: Event, whole: bool) -> FarRuns:
    loops = {
        "2": paper.example_2(),
        "1": paper.example_1(),
        "1-integral": paper.example_1(phase="integral"),
    }

    def progress(_: float) -> None:
        if stop.is_set():
            raise InterruptedError

    ends = {key: end for key, (_, end) in FAR_HORIZONS.items()}
    if not whole:
        ends["2"] = max(LOOKS)
    with ThreadPoolExecutor(2) as pool:
        tasks = {key: (loops[key], end) for key, end in ends.items()}
        waiting = {k: pool.submit(long_run, *task, progress=progress) for k, task in tasks.items()}
    runs = {key: run.result() for key, run in waiting.items()}
    if not whole:
        runs["2"] = continued(runs["2"], read_record(runs["2"]))
    return FarRuns(runs=runs, burst=through_the_burst(runs["2"]))
