"""The plants of benchmarks/arch, imported as its scripts import them."""

import sys

from places import ROOT

sys.path.insert(0, str(ROOT / "benchmarks" / "arch"))

import afc  # noqa: E402
import at  # noqa: E402
import cc  # noqa: E402
import inputs  # noqa: E402
import nn  # noqa: E402
import rows  # noqa: E402
import sc  # noqa: E402

__all__ = ["afc", "at", "cc", "inputs", "nn", "rows", "sc"]
