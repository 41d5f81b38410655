"""A study of a cheap loop, for the tests of study files."""

from pathlib import Path

LOOP = Path(__file__).with_name("lag.py").read_text(encoding="utf-8")

HEAD = """\
loop = "loop.py:loop"

[study]
title = "A lag"
seed = 3

[space]
"lag.rate" = { uniform = [0.5, 2.5] }
"lag.x(0)" = { bounds = [0.5, 1.5], nominal = 1.0 }

[spec]
decays = "always from 1 s on y <= 0.5"
small = { formula = "always |z| <= 4", meaning = "the range of the sensor" }

[time]
end = 2.0
step = 0.02

[metrics]
error = "y"
control = "z"
band = 0.1
"""

ROWS = """
[runs]
size = 200

[[analysis]]
kind = "probability"
limit = 0.5
"""


def write(folder: Path, *parts: str, name: str = "study.toml") -> Path:
    """Write a study and its loop into a folder; return the study's path."""
    (folder / "loop.py").write_text(LOOP, encoding="utf-8")
    path = folder / name
    path.write_text("\n".join(parts or (HEAD, ROWS)), encoding="utf-8")
    return path
