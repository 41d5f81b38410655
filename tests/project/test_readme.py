"""The README fits a few screens, its code runs, and what it names and links to exists."""

import os
import re
import subprocess
import sys

import pytest
from places import ROOT

import nlctl

README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_it_is_short_and_its_links_lead_somewhere():
    """At most 150 lines; what is longer is on a page of the documentation."""
    assert len(README.splitlines()) <= 150
    links = re.findall(r"\]\(([^)#]+)[^)]*\)", README)
    assert len(links) > 20
    for link in links:
        assert link.startswith("https://") or (ROOT / link).exists(), link


@pytest.mark.slow
def test_the_loop_of_ones_own_runs_in_at_most_30_lines(tmp_path):
    """It prints the tracking error that its comment says; 200 members of it reach their end."""
    code, many = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    assert len(code.splitlines()) <= 30
    script = tmp_path / "loop.py"
    shown = 'assert len(many.table) == 200 and set(many.table["status"]) == {"OK"}\n'
    script.write_text(code + many + shown, encoding="utf-8")
    result = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=True, timeout=300,
        env=os.environ | {"MPLBACKEND": "agg"},
    )  # fmt: skip
    said = re.search(r"# ([\d.]+) after 10 s", code)
    assert said is not None
    digits = len(said[1].partition(".")[2])
    assert abs(float(result.stdout) - float(said[1])) <= 0.51 * 10**-digits


def test_commands_and_names_in_the_readme_exist():
    """Every `nlctl.<name>` is public."""
    for name in re.findall(r"nlctl\.([A-Za-z_]+)", re.sub(r"nlctl\.toml|`pip.*", "", README)):
        assert hasattr(nlctl, name), name
