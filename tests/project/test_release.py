"""What a release needs: one number everywhere, the changelog's form, a recipe that fits."""

import re
import tomllib

from places import ROOT

import nlctl

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CHANGELOG = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
RECIPE = (ROOT / "conda" / "recipe.yaml").read_text(encoding="utf-8")
GROUPS = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
NAMED_OTHERWISE = {"matplotlib": "matplotlib-base"}  # by conda-forge


def test_one_version_everywhere():
    """Of the package, the citation, the recipe and the newest section of the changelog."""
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    version, date = re.search(r"^## \[(\d.*)\] - (\S+)$", CHANGELOG, re.MULTILINE).groups()
    assert version == nlctl.__version__
    assert f"\nversion: {version}\n" in citation
    assert f"\ndate-released: {date}\n" in citation
    assert f'\n  version: "{version}"\n' in RECIPE


def test_the_changelog_has_the_form_of_keep_a_changelog():
    """Versions from the newest, each with a date and groups of entries of one line."""
    titles = re.findall(r"^## (.*)$", CHANGELOG, re.MULTILINE)
    assert titles[0] == "[Unreleased]"
    dated = [
        re.fullmatch(r"\[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)", title) for title in titles[1:]
    ]
    assert all(dated)
    numbers = [tuple(map(int, found[1].split("."))) for found in dated]
    assert numbers == sorted(numbers, reverse=True)
    assert [found[2] for found in dated] == sorted((f[2] for f in dated), reverse=True)
    body = CHANGELOG.partition("## [Unreleased]")[2]
    assert set(re.findall(r"^### (.*)$", body, re.MULTILINE)) <= GROUPS
    entries = [line for line in body.splitlines() if line.startswith("- ")]
    assert entries
    assert not [line for line in body.splitlines() if line.startswith(" ")]  # one goes on below
    assert not [line for line in entries if len(line) > 180 or not line.endswith(".")]


def dependencies(names):
    """Package -> bounds, of requirements as pyproject.toml has them."""
    found = dict(re.fullmatch(r"([a-z0-9-]+)(.*)", name).groups() for name in names)
    return {NAMED_OTHERWISE.get(name, name): bounds for name, bounds in found.items()}


def test_the_recipe_has_what_the_wheel_needs():
    """With the extra `studies`, which is no part of its own at conda-forge."""
    part = RECIPE.partition("\n  run:\n")[2].partition("\n\n")[0]
    told = dict(line.strip("- ").split(" ", 1) for line in part.splitlines())
    wanted = dependencies([*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["studies"]])
    assert told == {"python": PROJECT["requires-python"], **wanted}


def test_the_oldest_dependencies_are_the_lower_bounds():
    """Those that `.ci/oldest` installs; the sdist has no `.ci`."""
    path = ROOT / ".ci" / "oldest.txt"
    if path.exists():
        lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
        extras = PROJECT["optional-dependencies"]
        own = [n for n in extras["test"] if not n.startswith("nlctl[")]
        wanted = dependencies([*PROJECT["dependencies"], *extras["studies"], *own])
        oldest = dict(line.split("==") for line in lines)
        wanted = {n.removesuffix("-base"): b.removeprefix(">=") for n, b in wanted.items()}
        assert {name: oldest.get(name) for name in wanted} == wanted


def test_classifiers_name_the_pythons_that_are_allowed():
    """From the first of ``requires-python`` to the last before its end."""
    low, high = map(int, re.findall(r"3\.(\d+)", PROJECT["requires-python"]))
    told = {c for c in PROJECT["classifiers"] if re.search(r"3\.\d+$", c)}
    assert told == {f"Programming Language :: Python :: 3.{n}" for n in range(low, high)}


def test_the_page_for_agents_is_one_page():
    """At most 60 lines, and the files that it names exist."""
    text = (ROOT / "AGENTS.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 60
    named = re.findall(r"`((?:tests|benchmarks|nlctl|analysis|campaign)/[\w/.]*)`", text)
    named += re.findall(r"\]\(([\w.]+)\)", text)
    assert len(named) > 5
    assert [name for name in named if not (ROOT / name).exists()] == []
