"""Where things lie: the repository, and the folder of the tests' own modules."""

from pathlib import Path

SUPPORT = Path(__file__).parent
ROOT = SUPPORT.parents[1]
