"""Reports: sections as data, one template, one self-contained page."""

from .document import Claim, Equation, Figure, Paragraph, Report, Section, Table
from .render import render_html, render_json, write_report

__all__ = [
    "Claim",
    "Equation",
    "Figure",
    "Paragraph",
    "Report",
    "Section",
    "Table",
    "render_html",
    "render_json",
    "write_report",
]
