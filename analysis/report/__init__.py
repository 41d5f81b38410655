"""Reports: sections as data, one template, one self-contained page."""

from .browser import write_pdf
from .compare import compare_contents
from .document import Claim, Equation, Figure, Headline, History, Paragraph, Report, Section, Table
from .gallery import write_gallery
from .junit import junit
from .render import file_hashes, framed, render_html, render_json, write_report

__all__ = [
    "Claim",
    "Equation",
    "Figure",
    "Headline",
    "History",
    "Paragraph",
    "Report",
    "Section",
    "Table",
    "compare_contents",
    "file_hashes",
    "framed",
    "junit",
    "render_html",
    "render_json",
    "write_gallery",
    "write_pdf",
    "write_report",
]
