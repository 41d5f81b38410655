"""The command line for tests: in a process of its own, as a user runs it, or in this one."""

import contextlib
import io
import subprocess
import sys
from pathlib import Path
from unittest import mock

from nlctl.analysis.cli.main import main

NLCTL = [sys.executable, "-c", "from nlctl.analysis.cli.main import main; main()"]


def nlctl(*arguments, cwd=None, **options):
    """Run the command line in a process of its own."""
    command = [*NLCTL, *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, cwd=cwd, timeout=300, check=False, **options
    )


def nlctl_here(*arguments, cwd=None):
    """Run the command line in this process, which spares the seconds that imports take."""
    command = ["nlctl", *map(str, arguments)]
    out, err, code = io.StringIO(), io.StringIO(), 0
    with (
        contextlib.chdir(Path.cwd() if cwd is None else cwd),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        mock.patch.object(sys, "argv", command),
    ):
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    return subprocess.CompletedProcess(command, code, out.getvalue(), err.getvalue())
