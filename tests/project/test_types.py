"""Types that a user's editor sees: no error of a strict type checker is ours."""

import inspect
import json
import subprocess

import pytest
from extras import needed_program
from places import ROOT, SUPPORT

import nlctl
from nlctl.host.rooms import public_names

pytestmark = pytest.mark.ci


def strictly_checked(folder, text):
    """What pyright says of a script, with nlctl laid out as a wheel has it: line and message."""
    pyright = needed_program(("pyright",))
    package = folder / "installed" / "nlctl"
    package.mkdir(parents=True)
    for path in (*(ROOT / "nlctl").iterdir(), ROOT / "analysis"):
        (package / path.name).symlink_to(path)
    (folder / "user.py").write_text(text, encoding="utf-8")
    settings = {"include": ["user.py"], "extraPaths": ["installed"], "typeCheckingMode": "strict"}
    (folder / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    command = [pyright, "--outputjson", "--project", str(folder)]
    said = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=600)
    found = json.loads(said.stdout)
    assert found["summary"]["filesAnalyzed"] == 1
    return [(d["range"]["start"]["line"] + 1, d["message"]) for d in found["generalDiagnostics"]]


@pytest.mark.weekly
def test_a_users_script_has_no_error_in_a_strict_editor(tmp_path):
    """No type is unknown, no call is wrong."""
    assert strictly_checked(tmp_path, (SUPPORT / "typed_user.py").read_text(encoding="utf-8")) == []


def test_an_editor_sees_the_top_and_the_rooms_and_no_former_name(tmp_path):
    """Every public name is one of a module that a type checker knows."""
    names = [f"nlctl.{name}" for name in nlctl.__all__]
    rooms = [name for name in nlctl.__all__ if inspect.ismodule(getattr(nlctl, name))]
    names += [f"nlctl.{room}.{name}" for room in rooms for name in public_names(room)]
    former = "BoucWen"
    lines = ["import nlctl", *names, f"nlctl.{former}", ""]
    said = [message for _, message in strictly_checked(tmp_path, "\n".join(lines))]
    assert [message for message in said if "is not a known attribute" in message] == [
        f'"{former}" is not a known attribute of module "nlctl"'
    ]
