"""Changes of what the file of a certificate holds."""

import copy
import json
from fractions import Fraction

from nlctl.analysis.recheck import main, seal_of


def scaled(path, factor):
    """Multiply one number, or both ends, of a content."""

    def change(made):
        *way, last = path
        for name in way:
            made = made[name]
        old = made[last]
        made[last] = (
            [str(Fraction(v) * factor) for v in old] if isinstance(old, list) else
            str(Fraction(old) * factor)
        )  # fmt: skip

    return change


def put(path, value):
    """Replace one entry of a content."""

    def change(made):
        *way, last = path
        for name in way:
            made = made[name]
        made[last] = value

    return change


def leaves_of(made, way=()):
    """Yield the ways to all entries of a content."""
    yield way
    if isinstance(made, dict | list):
        for key in made if isinstance(made, dict) else range(len(made)):
            yield from leaves_of(made[key], (*way, key))


def answers(content, rng, things, count, file, capsys):
    """Yield where a file has another thing, and what its check answers and says; sealed anew."""
    ways = [way for way in leaves_of(content) if way]
    for _ in range(count):
        made, way = copy.deepcopy(content), rng.choice(ways)
        put(way, rng.choice(things))(made)
        if seal_of(made) == seal_of(content):
            continue
        made["seal"] = made["seal"] if way == ("seal",) else seal_of(made)
        file.write_text(json.dumps(made))
        yield way, main([str(file)]), capsys.readouterr().out
