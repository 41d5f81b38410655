"""Changes of what the file of a certificate holds."""

from fractions import Fraction


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
