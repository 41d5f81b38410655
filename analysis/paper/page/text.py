"""What the paper prints: its equations in LaTeX, and its parameters next to the ones used.

Text only.  The numbers in use are filled in from the blocks themselves.
"""

from ...pages.study.loop import Published
from ...report.document import Equation, Paragraph
from ...studies.kinds.context import CLOPPER

CITATION = (
    "M. Lv, Y. Wang, S. Baldi, Z. Liu, C. Shi, C. Fu, X. Meng, Y. Qi: Adaptive Neural Control for "
    "Pure Feedback Nonlinear Systems with Uncertain Actuator Nonlinearity. Neural Information "
    "Processing (ICONIP 2017), LNCS 10639, pp. 201–211. doi 10.1007/978-3-319-70136-3_22."
)

QUESTION = (
    "are the paper's examples reproducible, and is its proof of boundedness for all time valid?"
)
LEAD = "Example 2, top: the output tracks the reference despite backlash."
LEAD_DRIFT = (
    r"Bottom, the same loop over hours: the argument \(\zeta\) of the Nussbaum gain drifts upwards."
)
LEAD_BURST = (
    "After {hours:.1f} h it reaches 3, where the gain changes to the wrong sign, and the input "
    "grows by orders of magnitude within milliseconds."
)

METHODS_TEXT = (
    "Plant, actuator, reference and controller are blocks of python-control, connected by their "
    "signals; each equation is written once, as in the paper, and compiled to machine code. The "
    "reference values are those of an independent computation, to the tolerances printed next to "
    "them.",
    "The proof is taken as a list of numbered statements. Those about all states of a box are "
    "proved by ball arithmetic on the same equations; those about a run are evaluated along it, "
    "with \\(\\dot V\\) as the gradient of V times the right-hand side, and are called checked. "
    "The studies draw independent samples; their probabilities have exact binomial bounds "
    "(Clopper, Pearson).",
)
OTHERS_CITED = (
    CLOPPER,
    "F. Johansson: Arb: efficient arbitrary-precision midpoint-radius interval arithmetic. IEEE "
    "Transactions on Computers 66 (2017), pp. 1281–1292. doi 10.1109/TC.2017.2690633.",
    "Ch. Tsitouras: Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying "
    "assumption. Computers & Mathematics with Applications 62 (2011), pp. 770–775. "
    "doi 10.1016/j.camwa.2011.06.002.",
)

SYMBOLS = (
    r"\(x\): state of the plant; \(y\), \(y_d\): its output and the reference, here also "
    r"\(x_d = (y_d, \dot y_d, \dots)\); \(e\): tracking error, \(e_1 = y - y_d\); \(r\): filtered "
    r"error; \(u\): control input; \(v\): what the actuator makes of it; \(d\): disturbance; "
    r"\(\psi\): Gaussian basis with centres \(\mu\) and widths \(\nu\); \(\hat W\): weights of the "
    r"network; \(\hat\delta\): estimate of the robust term; \(\zeta\): argument of the Nussbaum "
    r"gain \(N\), which finds the sign of the control direction. As signals: yd, e for \(e_1\), "
    r"zeta, delta_hat, and W_norm for the norm of \(\hat W\). The paper gives no units: \(y\), "
    r"\(u\) and \(v\) are pure numbers, time is in s."
)

PLANT_CLASS = Equation(
    latex=r"\dot x_i = x_{i+1},\quad \dot x_n = f(x, v(u)) + d(x, t),\quad y = x_1", number="(1)"
)

CONTROLLER = (
    Equation(
        latex=r"e = x - x_d,\quad r = \lambda_{n-1} e_1 + \dots + \lambda_1 e_{n-1} + e_n",
        number="(14)",
    ),
    Equation(latex=r"Y_d = -y_d^{(n)} + \lambda_{n-1} e_2 + \dots + \lambda_1 e_n", number="(18)"),
    Equation(
        latex=r"\psi_i(x) = \exp\left(-\frac{\|x - \mu_i\|^2}{\nu_i^2}\right),"
        r"\quad i = 1, \dots, l",
        number="(10)",
    ),
    Equation(
        latex=r"u = N(\zeta)\,\eta,\quad \eta = \beta r + \hat W^T \psi(x)"
        r" + \hat\delta \tanh(r / \tau) + Y_d,"
        r"\quad N(\zeta) = e^{\zeta^2} \cos(\pi\zeta / 2)",
        number="(23)",
    ),
    Equation(latex=r"\dot\zeta = r\,\eta", number="(24)"),
    Equation(
        latex=r"\dot{\hat W} = \Gamma\left(r\,\psi(x) - \sigma_1 \hat W\right),\quad "
        r"\dot{\hat\delta} = \gamma\left(r \tanh(r / \tau) - \sigma_2 \hat\delta\right)",
        number="(25)",
    ),
)

CONTROLLER_PART = (
    Paragraph(text="The controller, with the paper's equation numbers:"),
    *CONTROLLER,
    Paragraph(text=SYMBOLS),
)

TITLES = {
    1: "Example 1: forced oscillator with a dead zone",
    2: "Example 2: Genesio system with backlash",
}

PUBLISHED = {  # by the name that studies call the loop
    f"example-{number}": Published(
        title=f"{title}; Lv et al. 2017",
        citation=CITATION,
        items=(Paragraph(text="The class of plants:"), PLANT_CLASS, *CONTROLLER_PART),
    )
    for number, title in TITLES.items()
}

# quantity, as printed, as used (filled from the blocks), why they differ or what is open
_SHARED = (
    (r"\(y_d\)", "0.5 (sin t + sin 0.5t)", "{reference.amplitudes[0]:g} (sin t + sin 0.5t)", ""),
    (
        "widths ν",
        "2",
        "{basis.widths[0]:g}",
        r"printed as \(v_i\), the letter of the actuator's output",
    ),
    ("Γ", "diag[0.5]", "{weights.Gamma:g} I", "(21) prints Γ = Γ⁻¹ for Γ = Γᵀ > 0"),
    ("initial Ŵ, δ̂, ζ", "0, 0, 1", "0, 0, {law.initial[zeta]:g}", "ζ = 1 is a zero of N: u(0) = 0"),
)

PRINTED = {
    1: (
        ("p₁", "−0.2", "{plant.p1:g}", "makes the term −p₁x₁ positive; p₁ = 0.2 is tried below"),
        ("p", "0.2 + 0.2 cos 5x₁", "{plant.p_mean:g} + {plant.p_ripple:g} cos 5x₁", ""),
        ("q", "5 + 0.1 cos t", "{plant.q_mean:g} + {plant.q_ripple:g} cos t", ""),
        (
            "w",
            "0.5 + 0.1 sin t",
            "{plant.w_mean:g} + {plant.w_ripple:g} sin t",
            "phase w(t) t as printed, a chirp; ∫w dt is tried below",
        ),
        ("x(0)", "(0.5, 0)", "({plant.initial[x1]:g}, 0)", ""),
        (
            "dead zone",
            "−0.3 … 0.5, both ends in two branches",
            "{actuator.b_l:g} … {actuator.b_r:g}",
            "harmless: all branches give 0 there",
        ),
        (
            "centres",
            "27, evenly in [−10, 10]²",
            "27 on the diagonal",
            "27 is not a square number; grids are tried below",
        ),
        ("λ₁", "1.5", "{filtered_error.lambdas[0]:g}", ""),
        (
            "σ₁, σ₂, γ, τ, β",
            "0.5, 0.5, 1.5, 0.2, 2.5",
            "{weights.sigma_1:g}, {robust.sigma_2:g}, {robust.gamma:g}, {robust.tau:g}, "
            "{law.beta:g}",
            "",
        ),
        *_SHARED,
    ),
    2: (
        ("a, b, c", "1.6, 3, 6", "{plant.a:g}, {plant.b:g}, {plant.c:g}", ""),
        ("x(0)", "(1, 0, 0)", "({plant.initial[x1]:g}, 0, 0)", ""),
        (
            "backlash φ(u)",
            "not defined",
            "v(t⁻), the play operator",
            "every other reading is ill-posed in a closed loop",
        ),
        (
            "v(0)",
            "not given",
            "{actuator.v0:g}",
            "any value in [−0.6, 0.72] is possible; both ends are tried below",
        ),
        (
            "centres",
            "“controller structure unchanged”: 27",
            "3×3×3 grid",
            "three states; the diagonal is tried below",
        ),
        (
            "λ₁, λ₂",
            "2, 1",
            "{filtered_error.lambdas[0]:g}, {filtered_error.lambdas[1]:g}",
            "by (14), r = e₁ + 2e₂ + e₃; the other order is tried below",
        ),
        (
            "σ₁, σ₂, γ, τ, β",
            "0.3, 0.3, 1.2, 0.5, 5",
            "{weights.sigma_1:g}, {robust.sigma_2:g}, {robust.gamma:g}, {robust.tau:g}, "
            "{law.beta:g}",
            "",
        ),
        *_SHARED,
    ),
}
