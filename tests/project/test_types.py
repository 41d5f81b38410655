"""Types that a user's editor sees: no error of a strict type checker is ours."""

import json
import subprocess

import pytest
from extras import needed_program
from places import ROOT, SUPPORT

pytestmark = pytest.mark.ci


def test_a_users_script_has_no_error_in_a_strict_editor(tmp_path):
    """Of pyright, with nlctl laid out as a wheel has it: no type is unknown, no call is wrong."""
    pyright = needed_program(("pyright",))
    package = tmp_path / "installed" / "nlctl"
    package.mkdir(parents=True)
    for path in (*(ROOT / "nlctl").iterdir(), ROOT / "analysis"):
        (package / path.name).symlink_to(path)
    script = tmp_path / "user.py"
    script.write_text((SUPPORT / "typed_user.py").read_text(encoding="utf-8"), encoding="utf-8")
    settings = {"include": ["user.py"], "extraPaths": ["installed"], "typeCheckingMode": "strict"}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    command = [pyright, "--outputjson", "--project", str(tmp_path)]
    told = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=600)
    found = json.loads(told.stdout)
    assert found["summary"]["filesAnalyzed"] == 1
    assert [
        (d["range"]["start"]["line"] + 1, d["message"]) for d in found["generalDiagnostics"]
    ] == []
