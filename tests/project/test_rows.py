"""Tests that go through a table hide nothing."""

import pytest
from rows import each_row


@each_row(("given", "wanted"), [(1, 1), (2, 3), (4, 5), (6, 6)])
def compare(given, wanted):
    assert given == wanted


def test_every_row_that_fails_is_told():
    """With its values; those that hold are not."""
    with pytest.raises(ExceptionGroup, match="2 of 4 rows") as caught:
        compare()
    texts = [str(error) for error in caught.value.exceptions]
    assert [text.partition("}")[0] for text in texts] == [
        "{'given': 2, 'wanted': 3",
        "{'given': 4, 'wanted': 5",
    ]


def test_a_row_that_raises_nothing_where_it_should_is_told():
    """`pytest.raises` fails in its own way."""

    @each_row("text", ["1", "one"])
    def refused(text):
        with pytest.raises(ValueError, match="invalid literal"):
            int(text)

    with pytest.raises(ExceptionGroup, match="1 of 2 rows") as caught:
        refused()
    assert "{'text': '1'}" in str(caught.value.exceptions[0])


def test_an_empty_table_is_refused():
    """It would test nothing."""
    with pytest.raises(AssertionError, match="without rows"):
        each_row("a", [])
