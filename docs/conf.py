"""Sphinx's settings: offline, executed pages, formulas as MathML.

``pip install ".[docs]" && sphinx-build -W -n docs build/site``, from the root of the repository.
"""

import sys
import warnings
from pathlib import Path

import matplotlib

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]
matplotlib.use("agg")

from linked import linked_types  # noqa: E402

from nlctl._version import __version__  # noqa: E402

project = "nlctl"
author = "The nlctl developers"
copyright = author  # noqa: A001
version = release = __version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "numpydoc",
    "myst_parser",
    "sphinx_gallery.gen_gallery",
    "formulas",
    "docstrings",
    "public",
    "block_pages",
    "root_files",
    "linked",
    "live_panels",
]
root_doc = "index"
exclude_patterns = ["auto/**/*.py", "auto/**/*.ipynb", "gallery", "tutorials", "how-to/*.py"]
exclude_patterns += ["how-to/GALLERY_HEADER.rst", "data", "inventories"]

autodoc_typehints = "none"  # types stand in the docstrings
autosummary_generate = False
numpydoc_show_class_members = False
# numpydoc refers to each attribute of a docstring, and those are not pages of their own
nitpick_ignore_regex = [("py:obj", r"\w+")]
# inventories that are kept here: docs/inventories/make.py says what is in them
OTHERS = {
    "control": "https://python-control.readthedocs.io/en/0.10.2/",
    "numpy": "https://numpy.org/doc/stable/",
    "scipy": "https://docs.scipy.org/doc/scipy/",
}
intersphinx_mapping = {k: (url, f"inventories/{k}.inv") for k, url in OTHERS.items()}
intersphinx_cache_limit = -1
numpydoc_xref_param_type = True
numpydoc_xref_ignore = "all"  # but for these
numpydoc_xref_aliases = linked_types(HERE / "inventories")
myst_heading_anchors = 3
myst_enable_extensions = ["deflist", "dollarmath"]
suppress_warnings = ["config.cache"]  # functions among sphinx-gallery's settings

html_theme = "pydata_sphinx_theme"
html_title = f"nlctl {version}"
html_static_path = ["_static", "../analysis/report/fonts"]  # the reports' font for formulas
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_show_sourcelink = False
html_copy_source = False
html_sidebars = {"index": []}
html_theme_options = {
    "logo": {"text": "nlctl"},
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "header_links_before_dropdown": 7,
    "navigation_with_keys": False,
    "show_toc_level": 2,
}

sphinx_gallery_conf = {
    "examples_dirs": ["tutorials", "how-to", "gallery"],
    "gallery_dirs": ["auto/tutorials", "auto/how-to", "auto/gallery"],
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "only_warn_on_example_error": False,
    "write_computation_times": False,
    "show_signature": False,
    "download_all_examples": False,
    "remove_config_comments": True,
    "matplotlib_animations": False,
    "image_srcset": ["2x"],
    "nested_sections": False,
    "backreferences_dir": "auto/used",  # which scripts use a name: its page says so
    "doc_module": ("nlctl",),
    "reset_modules": (
        "matplotlib",
        "strict.warnings_are_errors",
        "strict.labels_fit",
        "live_panels.note_runs",
    ),
    "image_scrapers": ("matplotlib", "live_panels.panel_scraper"),
}
warnings.filterwarnings("ignore", message=".*non-interactive.*", category=UserWarning)
