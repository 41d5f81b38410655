"""Printing to PDF waits for a browser that works, however long, and not for one that hangs."""

import os
import subprocess
import sys
import time

import pytest

from nlctl.analysis.report import browser, write_pdf
from nlctl.errors import UsageError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")

BEGINNING = f"""#!{sys.executable} -S
import os, pathlib, subprocess, sys, time
out = next(a for a in sys.argv if a.startswith("--print-to-pdf=")).partition("=")[2]
"""
WORKS = "while time.process_time() < 1.5: pass\npathlib.Path(out).write_text('%PDF')\n"
CHILD = (
    "child = 'import time; time.sleep(600)'\n"
    "subprocess.Popen([sys.executable, '-S', '-c', child, __file__])\n"
)
LEAVES_A_CHILD = CHILD + "pathlib.Path(out).write_text('%PDF')\n"
HANGS = CHILD + "time.sleep(600)\n"
FAILS = "print('first', file=sys.stderr)\nsys.exit('no such font')\n"


@pytest.fixture
def page(tmp_path, monkeypatch):
    """A page, a second of patience, and a function that puts a program in the browser's place."""
    monkeypatch.setattr(browser, "BROWSER_TIMEOUT", 1.0)
    monkeypatch.setattr(browser, "BUSY", 0.02)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    (tmp_path / "index.html").write_text("<p>text", encoding="utf-8")

    def installed(program):
        path = tmp_path / "chromium"
        path.write_text(BEGINNING + program, encoding="utf-8")
        path.chmod(0o755)
        return tmp_path / "index.html"

    return installed


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("program", [WORKS, LEAVES_A_CHILD], ids=["works", "leaves a child"])
def test_a_print_may_take_longer_than_the_patience(page, tmp_path, program):
    """As long as it computes; and it has ended when it ends, whatever it has started."""
    start = time.monotonic()
    assert write_pdf(page(program), tmp_path / "page.pdf").read_text() == "%PDF"
    assert time.monotonic() - start < 300
    assert not left(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "reason"), [(HANGS, "no sign of work for 1.0 s"), (FAILS, "no such font")]
)
def test_a_browser_that_hangs_or_fails_is_told_with_the_reason(page, tmp_path, program, reason):
    """Nothing of it is left running, and an older PDF stays."""
    (tmp_path / "page.pdf").write_text("older", encoding="utf-8")
    with pytest.raises(UsageError, match=f"printed no PDF of .*: {reason}"):
        write_pdf(page(program), tmp_path / "page.pdf")
    assert (tmp_path / "page.pdf").read_text(encoding="utf-8") == "older"
    assert not left(tmp_path)


def left(folder):
    """Command lines of processes that the program in this folder has left behind."""
    every = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True)
    return [line for line in every.stdout.splitlines() if str(folder / "chromium") in line]
