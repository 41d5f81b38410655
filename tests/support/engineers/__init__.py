"""Functions as engineers write them: everyday NumPy, SciPy and Python in equations of plants."""

import importlib

from engineers.entry import ENTRIES, Entry, system

__all__ = ["ENTRIES", "Entry", "system"]

for _theme in ("shapes", "reductions", "matrices", "choices", "tables", "elementary", "language",
               "objects", "models", "everyday", "toolbox", "habits", "plants",
               "guarded", "caught", "vehicles", "processes", "laws", "lookups",
               "packages", "iterations", "numbers_of_packages", "sums_and_searches",
               "chosen_things", "chosen_rows", "other_words", "aliases", "handed_on",
               "networks", "by_name", "searches", "robots"):  # fmt: skip
    importlib.import_module(f"engineers.{_theme}")
