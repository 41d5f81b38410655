"""Lv et al. 2017, with its proof and its studies."""

from __future__ import annotations

from ..paper.page.record import LV_2017
from ..paper.report import clear, compose
from ..reproductions.page import Reproduction

REPRODUCTION = Reproduction(paper=LV_2017, compose=compose, clear=clear)
