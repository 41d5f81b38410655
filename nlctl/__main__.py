"""``python -m nlctl`` and the console script: the command line of `analysis`, if that is ours."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path

from .errors import UsageError


def check_analysis() -> None:
    """Refuse a module called `analysis` that hides nlctl's own package.

    Raises
    ------
    UsageError
        With the file that hides it.
    """
    ours = Path(__file__).resolve().parents[1] / "analysis" / "__init__.py"
    loaded = sys.modules.get("analysis")
    spec = loaded.__spec__ if loaded is not None else importlib.util.find_spec("analysis")
    places = [] if spec is None else [spec.origin, *(spec.submodule_search_locations or ())]
    found = next(filter(None, places), None)
    if found is None:
        raise UsageError(f"nlctl's package 'analysis' is missing beside it, '{ours.parent}'")
    if Path(found).resolve() != ours:
        raise UsageError(
            f"'{found}' hides nlctl's package 'analysis' ('{ours.parent}'): rename it, or leave "
            "its folder out of PYTHONPATH"
        )


def main() -> None:
    """Run the command line, which stands on top of both packages."""
    try:
        check_analysis()
    except UsageError as error:
        print(f"nlctl: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    importlib.import_module("analysis.cli.main").main()


if __name__ == "__main__":
    main()
