"""Ids of requirements: one each, and none that an analysis names and no requirement has."""

from __future__ import annotations

from collections.abc import Iterator

from nlctl.names import unknown

from ..file.errors import Problem
from ..file.schema import Study


def id_problems(study: Study, *, whole: bool) -> Iterator[Problem]:
    """Yield what is wrong with ids; `whole` says that no requirement of the file is missing."""
    owners: dict[str, str] = {}
    for key, rule in study.spec.items():
        if rule.id in owners:
            message = f"needs an id of its own, '{rule.id}' is that of '{owners[rule.id]}'"
            yield Problem(place=("spec", key, "id"), message=message)
        if rule.id:
            owners.setdefault(rule.id, key)
    for place, asked in enumerate(study.analysis):
        for name in dict.fromkeys(asked.id):
            if not name:
                message = "needs the id of a requirement, got an empty one"
            elif asked.id.count(name) > 1:
                message = f"needs each id once, got '{name}' again"
            elif whole and name not in owners:
                where = "(spec.NAME.id gives a requirement its id)"
                message = str(unknown("requirement id", name, owners, where))
            else:
                continue
            yield Problem(place=("analysis", place, "id"), message=message)
        if asked.id and not asked.claim:
            message = f"'{asked.kind}' claims nothing that could answer {', '.join(asked.id)}: "
            message += "say what it claims, such as by limit, or leave the id out"
            yield Problem(place=("analysis", place, "id"), message=message)
