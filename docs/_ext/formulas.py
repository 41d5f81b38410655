"""Formulas of the site as MathML, by the converter of the reports: no script, no web font."""

from sphinx.util import logging

from nlctl.analysis.report.document import Equation
from nlctl.analysis.report.mathml import inline, mathml

logger = logging.getLogger(__name__)


def _checked(markup, latex, node):
    """Warn of what the converter could only show as its source; with -W the build fails."""
    if markup.startswith("<code>"):
        logger.warning("no MathML for the formula %r", latex, location=node)
    return str(markup)


def visit_inline(self, node):
    """Write a formula inside a line."""
    from docutils.nodes import SkipNode

    self.body.append(_checked(inline(node.astext()), node.astext(), node))
    raise SkipNode


def visit_block(self, node):
    """Write a formula that has a line of its own."""
    from docutils.nodes import SkipNode

    latex = node.astext()
    markup = _checked(mathml(Equation(latex=latex)), latex, node)
    self.body.append(
        f'<div class="formula" tabindex="0" role="group" aria-label="formula">{markup}</div>\n'
    )
    raise SkipNode


def setup(app):
    """Make it Sphinx's renderer of formulas."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    app.connect("config-inited", lambda app, config: _choose(config))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _choose(config):
    config.html_math_renderer = "mathml"
