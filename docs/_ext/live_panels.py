"""Pages that are executed let their reader move the loop: sliders behind the picture, or why not.

What a script runs with ``nlctl.input_output_response`` is noted.  Behind its first picture stands the
first of these loops that a page can run, by the functions of ``nlctl report --live``.  Sliders are a
sensible few.  Each in one line, a script may name others, and a run where it makes none itself
(the panel then stands behind its first lines)::

    # sphinx_gallery_live = ["controller.law.beta=1:5", "plant.x1(0)"]
    # sphinx_gallery_live_run = "nlctl.input_output_response(loop, np.linspace(0, 20, 2001))"

Without the extra ``export`` there are no panels, and the build says so.
"""

import functools
import importlib.util
from html import escape
from pathlib import Path

from sphinx.util import logging

import nlctl
from nlctl.analysis.pages.live import live_item, live_program
from nlctl.analysis.report.page import live_figure, live_files
from nlctl.analysis.response_of_loop import own_parameters
from nlctl.errors import DivergedError, UsageError

logger = logging.getLogger(__name__)
DARK = 'html[data-theme="dark"]'
PANEL = '<figure class="live"'  # in the text of pages that have one
MOST = 150_000  # characters that a page may be longer
MADE = importlib.util.find_spec("ziglang") is not None

run = nlctl.input_output_response
noted = []  # loops and their first runs, of the script that is executed
reasons = {}  # why a page has no panel; empty where it has one


@functools.wraps(run)
def and_note(loop, *args, **kwargs):
    """Run a loop, and note that."""
    response = run(loop, *args, **kwargs)
    if not any(loop is other for other, _ in noted):
        noted.append((loop, response))
    return response


def note_runs(gallery_conf, script):
    """Begin a script, with nothing noted."""
    noted.clear()
    if MADE:
        nlctl.input_output_response = and_note


def panel_scraper(block, block_vars, gallery_conf):
    """Return the lines that show a page's panel, behind its first picture, and no others."""
    page = Path(block_vars["target_file"])
    names, asked = block_vars["example_globals"], block_vars["file_conf"]
    is_place = len(block_vars["image_path_iterator"]) or "live_run" in asked
    if page in reasons or not (MADE and is_place):
        return ""
    if "live_run" in asked:
        noted.clear()
        eval(asked["live_run"], names)  # which is noted
    if not noted:
        return ""
    content, reasons[page] = panel(names, asked.get("live", []))
    path = page.parent / "live" / f"{page.stem}.html"
    path.parent.mkdir(exist_ok=True)
    path.write_text(content, encoding="utf-8")
    return f"\n.. raw:: html\n   :file: live/{path.name}\n\n"


def panel(names, wanted):
    """Return what moves the first loop that a page can run, or why there is none."""
    refused = []
    for loop, response in noted:
        called = next((name for name, value in names.items() if value is loop), "loop")
        try:
            return checked(live_figure(moved(loop, response, wanted, called))), ""
        except (UsageError, DivergedError) as error:
            refused.append(
                str(error).replace(f"'{loop.name}' cannot run on a page: it", "the loop")
            )
    return f'<p class="not-live">No sliders here: {escape(refused[0])}.</p>\n', refused[0]


def checked(figure):
    """Return a panel, unless it is too long."""
    if len(figure) > MOST:
        raise UsageError(
            f"the samples of its inputs make this page {len(figure) / 1000:.0f} kB longer, "
            f"{MOST / 1000:.0f} kB at most"
        )
    return figure


def moved(loop, response, wanted, called):
    """Return a loop as pages run it."""
    system = getattr(loop, "system", loop)  # of what was compiled
    given = own_parameters(system, response)
    program = live_program(system, response, given)
    return live_item(
        program, response, wanted, base=given, called=called, origin="as in the script"
    )


def write_files(app):
    """Write style and script once for the whole site."""
    if not MADE:
        logger.info("[live] no panels: Zig is not installed, pip install 'nlctl[export]'")
        return
    folder = Path(app.outdir) / "_static"
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in live_files(DARK).items():
        folder.joinpath(name).write_text(text, encoding="utf-8")


def add_files(app, pagename, templatename, context, doctree):
    """Let pages with a panel load them, and no others."""
    if PANEL in context.get("body", ""):
        app.add_css_file("live.css")
        app.add_js_file("live.js", loading_method="defer")


def count(app, error):
    """Say how many pages have a panel, and why some have none."""
    if reasons:
        made = sum(not reason for reason in reasons.values())
        logger.info("[live] pages: %d with sliders, %d that say why not", made, len(reasons) - made)
    for page, reason in reasons.items():
        if reason:
            logger.info("[live] %s: %s", page.stem, reason)


def setup(app):
    """Write the files before pages name them."""
    app.connect("builder-inited", write_files, priority=400)  # before scripts are executed
    app.connect("html-page-context", add_files)
    app.connect("build-finished", count)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
