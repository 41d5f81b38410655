"""Completion of the command line, as a shell asks for it: in processes of their own."""

import os
import shutil
import subprocess
import sys

import pytest

from nlctl.analysis.cli.main import app

COMMANDS = sorted(
    c.name or c.callback.__name__.rstrip("_") for c in app.registered_commands if c.callback
)
LAUNCHER = "#!{python}\nimport sys\nfrom nlctl.__main__ import main\nsys.exit(main())\n"
ASK = """
eval "$(_NLCTL_COMPLETE=source_bash nlctl)"
complete -p nlctl >&2
COMP_WORDS=({words}) COMP_CWORD={last}
_nlctl_completion nlctl
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@pytest.fixture(scope="module")
def shell(tmp_path_factory):
    """A folder with the script `nlctl` as an installer writes it, first on the path."""
    folder = tmp_path_factory.mktemp("bin")
    script = folder / "nlctl"
    script.write_text(LAUNCHER.format(python=sys.executable), encoding="utf-8")
    script.chmod(0o755)
    return os.environ | {"PATH": os.pathsep.join([str(folder), os.environ["PATH"]])}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="this machine has no bash")
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (("",), COMMANDS),
        (("re",), ["replay", "report"]),
        (("report", "--o"), ["--open", "--out"]),
        (("simulate", "example-1", "--eng"), ["--engine"]),
        (("nonsense",), [""]),
    ],
)
def test_bash_completes_commands_and_options(shell, words, offered):
    """What the shell puts behind the cursor, with the completion that nlctl itself prints."""
    quoted = " ".join(f"'{word}'" for word in ("nlctl", *words))
    told = subprocess.run(
        ["bash", "--norc", "-c", ASK.format(words=quoted, last=len(words))],
        capture_output=True, text=True, check=True, env=shell,
    )  # fmt: skip
    assert sorted(told.stdout.splitlines() or [""]) == sorted(offered)
    assert "-F _nlctl_completion nlctl" in told.stderr


def test_completion_imports_nothing_heavy(shell):
    """A key is answered at once: nothing that computes is imported for it."""
    asked = {"_NLCTL_COMPLETE": "complete_bash", "COMP_WORDS": "nlctl re", "COMP_CWORD": "1"}
    told = subprocess.run(
        ["nlctl"], capture_output=True, text=True, check=False,
        env=shell | asked | {"PYTHONPROFILEIMPORTTIME": "1"},
    )  # fmt: skip
    loaded = {line.rpartition("|")[2].strip() for line in told.stderr.splitlines()}
    assert told.stdout.split() == ["report", "replay"]
    assert "typer" in loaded  # so that the list is read as it is meant
    assert not loaded & {"numpy", "scipy", "numba", "control", "matplotlib", "pandas"}
