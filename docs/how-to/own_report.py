r"""
Make a report of one's own
==========================

``loop_report`` composes a page from what you have of a loop: a response, a ledger, a study, your own sections.
It is the template of all reports of nlctl: one file, no network, and whatever you write is text, never markup.
``nlctl report my/loop.py:make`` makes such a page at once; this one has more to say.
It is about an inverted pendulum of python-control's kind, held upright by state feedback.
"""

import tempfile
from pathlib import Path

import control as ct
import numpy as np

import nlctl
from nlctl.analysis.loop_report import loop_report
from nlctl.analysis.report import Claim, Paragraph, Section, Table, write_report


def pendulum(t, x, u, params):
    return x[1], params["g"] / params["l"] * np.sin(x[0]) + u[0]


plant = ct.nlsys(
    pendulum,
    states=["angle", "rate"],
    inputs=["torque"],
    params={"g": 9.81, "l": 1.0},
    name="plant",
)
gains = ct.place([[0, 1], [9.81, 0]], [[0], [1]], [-2, -3])
law = ct.ss([], [], [], -gains, inputs=["angle", "rate"], outputs=["torque"], name="law")
loop = ct.interconnect([plant, law], inputs=[], outputs=["angle", "torque"], name="pendulum")
t = np.linspace(0, 5, 501)
response = nlctl.input_output_response(loop, t, 0, [0.4, 0.0])

# %%
# Ten lines make the page. ``question`` and ``verdict`` come first on it, then the claims with their evidence.
settled = float(np.abs(response.outputs[0, -1]))
tuning = Table(
    caption="The gains.",
    columns=("of", "gain"),
    rows=[("angle", gains[0, 0]), ("rate", gains[0, 1])],
)
content = loop_report(
    loop,
    title="An inverted pendulum",
    response=response,
    question="Does it stand within 5 s?",
    verdict=f"From 0.4 rad, {settled:.1e} rad are left.",
    claims=[
        Claim(
            text="|angle| at 5 s",
            measured=f"{settled:.1e}",
            limit="1e-3",
            holds=settled < 1e-3,
            evidence="run",
        )
    ],
    sections=[
        Section(
            key="tuning",
            title="Tuning",
            items=[Paragraph(text="By pole placement at -2 and -3."), tuning],
        )
    ],
    author="N. N.",
    revision="A",
)
with tempfile.TemporaryDirectory() as folder:
    page = write_report(content, folder)
    print(
        f"{page.name}, {page.stat().st_size / 1000:.0f} kB, and {sorted(p.name for p in Path(folder).iterdir())}"
    )

# %%
# ``write_pdf(page, "report.pdf")`` prints it through an installed Chromium;
# ``nlctl.analysis.report.framed(content)`` shows it in a notebook.
#
# The closed loop is linear where the angle is small: there its slowest mode is :math:`e^{-2t}`.
late = np.abs(response.outputs[0, t >= 4])
rate = -np.polyfit(t[t >= 4], np.log(late), 1)[0]
print(f"decays with {rate:.3f} 1/s")
assert abs(rate - 2) < 0.05

# %%
# What is of another loop is refused. A response's outputs are compared with the loop's own, and spans of it are simulated
# again; a ledger and a study have a record of the loop that they are of:
try:
    loop_report(nlctl.paper.example_1(), title="Another loop", response=response)
except nlctl.errors.DiagramError as error:
    print(error)

# %%
# What more fits in: ``ledger=nlctl.analysis.lyapunov.ledger(loop)``, ``study=nlctl.analysis.studies.load_result("reports/arm")``,
# and figures of your own as ``nlctl.analysis.report.Figure`` with a caption and a description for those who cannot see it.
