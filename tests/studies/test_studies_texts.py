"""Folders and files of studies as texts."""

import pytest
from studies_example import HEAD, write

from nlctl.analysis.studies import load_result, read_study, replay, run, verify
from nlctl.errors import ParameterError


@pytest.mark.slow
def test_folders_and_files_may_be_texts(tmp_path, monkeypatch):
    """As in a notebook: relative to where one is."""
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path, HEAD, "[runs]\nsize = 3\n")
    made = run(read_study(path.name), "reports/three", threads=1)
    assert made.rows.table.shape[0] == 3
    again = load_result("reports/three")
    assert again.rows.table.equals(load_result(tmp_path / "reports" / "three").rows.table)
    assert verify("reports/three").problems == ()
    assert replay("reports/three", 2).differences == ()
    with pytest.raises(ParameterError, match="load_result needs folder to be text or of type Path"):
        load_result(3)
