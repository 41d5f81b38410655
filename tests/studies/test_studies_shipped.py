"""The study files that come with nlctl are found, valid, and of the paper's examples."""

import pytest
from places import ROOT

from nlctl.analysis.studies import read_study, shipped
from nlctl.errors import UnknownNameError

NAMES = sorted(path.stem for path in (ROOT / "reports").glob("*.toml"))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_study_is_valid(name):
    """Names, laws, formulas and analyses fit the loop."""
    file = read_study(shipped(name))
    assert file.study.analysis
    assert file.experiment.space.names


def test_the_nearest_name_is_told():
    """A study that does not exist."""
    with pytest.raises(UnknownNameError, match="example-1-quick"):
        shipped("example-1-quik")
