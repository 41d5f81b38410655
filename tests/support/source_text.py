"""Functions from text whose source can be read, as in a notebook."""

import itertools
import linecache

_NUMBERS = itertools.count()


def run(text, names=None):
    """Run Python text and return the names that it defines."""
    file = f"<text {next(_NUMBERS)}>"
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    names = {} if names is None else names
    exec(compile(text, file, "exec"), names)
    return names
