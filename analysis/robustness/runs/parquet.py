"""Parquet, the files that tables of runs are kept in: pyarrow, which the extra `studies` brings."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pandas as pd

from nlctl.errors import UsageError


def parquet() -> ModuleType:
    """Return ``pyarrow.parquet``; say what to install where it is missing."""
    try:
        import pyarrow.parquet
    except ImportError:
        raise UsageError(
            "runs that are kept in a folder need pyarrow, for tables in Parquet: "
            'pip install "nlctl[studies]"'
        ) from None
    return pyarrow.parquet


def read_parquet(path: Path) -> pd.DataFrame:
    """Read a table that `DataFrame.to_parquet` has written, without threads."""
    # Those of pyarrow's datasets, which `read_table` begins, wait for ever where memory is too
    # short to begin others.
    with parquet().ParquetFile(path) as file:
        return file.read(use_threads=False).to_pandas(use_threads=False)
