"""The plants of benchmarks/arch, imported as its scripts import them."""

import sys

from places import ROOT

sys.path.insert(0, str(ROOT / "benchmarks" / "arch"))

import afc
import at
import cc
import inputs
import nn
import published
import sc

__all__ = ["afc", "at", "cc", "inputs", "nn", "published", "sc"]
