"""Lv et al. 2017, with its proof and its studies."""

from dataclasses import replace

from ..paper.page.record import LV_2017
from ..paper.report import clear, compose

REPRODUCTION = replace(LV_2017, compose=compose, clear=clear)
