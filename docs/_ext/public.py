"""Directives of the reference: public names, keys of study files, the command line."""

import importlib
import inspect
from pathlib import Path
from types import GenericAlias

import typer
from docutils.parsers.rst import directives
from sphinx.util.docutils import SphinxDirective

import nlctl
from nlctl.analysis.controller_guide import GUIDES, rows_of


def entry(module, name):
    """Return the directive that documents a public name, as lines of reStructuredText."""
    thing = getattr(importlib.import_module(module), name)
    full = f"{module}.{name}"
    if inspect.ismodule(thing):
        return [f".. automodule:: {full}"]
    if not callable(thing) or isinstance(thing, GenericAlias):
        return [f".. py:data:: {full}"]
    if not inspect.isclass(thing):
        return [f".. autofunction:: {full}"]
    if issubclass(thing, Exception):
        return [f".. autoexception:: {full}"]
    if hasattr(thing, "feedthrough"):  # its equations are in its docstring
        return [f".. autoclass:: {full}"]
    methods = [key for key, value in vars(thing).items() if _is_texts(thing, key, value)]
    return [f".. autoclass:: {full}", *([f"   :members: {', '.join(methods)}"] if methods else [])]


def _is_texts(thing, key, value):
    """Whether it is a method or property of this class, not the default of a field."""
    if key.startswith("_") or key in thing.__dict__.get("__dataclass_fields__", {}):
        return False
    plain = getattr(value, "__func__", value)  # of class and static methods
    if getattr(plain, "__module__", thing.__module__) != thing.__module__:
        return False
    return bool(getattr(plain, "__doc__", "")) and (
        inspect.isfunction(plain) or isinstance(value, property)
    )


class Public(SphinxDirective):
    """``.. public:: module`` and names: what each is, from its docstring."""

    required_arguments = 1
    has_content = True

    def run(self):
        (module,) = self.arguments
        lines = []
        for name in " ".join(self.content).split():
            lines += [*entry(module, name), ""]
        return self.parse_text_to_nodes("\n".join(lines))


class Inside(SphinxDirective):
    """``.. inside:: module``: what a package offers that `nlctl` does not.

    ``:without:`` has the names that another directive documents.
    """

    required_arguments = 1
    option_spec = {"without": directives.unchanged}

    def run(self):
        home = importlib.import_module(self.arguments[0])
        elsewhere = {*nlctl.__all__, *self.options.get("without", "").split()}
        names = [name for name in home.__all__ if name not in elsewhere]
        lines = []
        for name in names:
            lines += [*entry(self.arguments[0], name), ""]
        return self.parse_text_to_nodes("\n".join(lines))


class Controllers(SphinxDirective):
    """``.. controllers::``: which controller is for which plant, from its records."""

    def run(self):
        lines = [".. list-table::", "   :header-rows: 1", "   :widths: 24 40 18 8 10", ""]
        heads = ("controller", "what has to be known", "proved here", "states", "time")
        for row in [heads, *map(overview, GUIDES)]:
            lines += [f"   {'*' if k == 0 else ' '} - {cell}" for k, cell in enumerate(row)]
        lines.append("")
        for guide in GUIDES:
            lines += [guide.name, "-" * len(guide.name), ""]
            lines += [".. code-block:: python", "", f"   {guide.code}", ""]
            texts = {key: words for key, words in rows_of(guide).items() if key != "code"}
            lines += [f":{key}: {_text(words)}" for key, words in texts.items()]
            lines.append("")
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def overview(guide):
    """Return the cells of a controller in the table of all."""
    proof = f":doc:`{guide.proof} </explanation/certificates>`" if guide.proof else "–"
    costs = guide.costs
    time = "–" if costs.time is None else f"{costs.time:g}"
    return f"`{guide.name}`_", _text(guide.known), proof, str(costs.states), time


class Citation(SphinxDirective):
    """``.. citation::``: BibTeX of what ``CITATION.cff`` says, software first."""

    def run(self):
        import yaml

        path = Path(self.env.srcdir).parent / "CITATION.cff"
        self.env.note_dependency(str(path))
        cited = yaml.safe_load(path.read_text(encoding="utf-8"))
        entries = [bibtex(cited, f"nlctl-{cited['version']}")]
        entries += [bibtex(one, _key(one)) for one in cited["references"]]
        lines = [".. code-block:: bibtex", "", *_indented("\n\n".join(entries))]
        return self.parse_text_to_nodes("\n".join(lines))


def _indented(text):
    return [f"   {line}" for line in text.splitlines()]


def _key(cited):
    return f"{cited['authors'][0]['family-names']}{cited['year']}".lower()


def bibtex(cited, key):
    """Return an entry of BibTeX for one of the Citation File Format."""
    people = [
        (one.get("name") and f"{{{one['name']}}}") or f"{one['family-names']}, {one['given-names']}"
        for one in cited["authors"]
    ]
    year = cited.get("year") or str(cited["date-released"])[:4]
    fields = {"author": " and ".join(people), "title": f"{{{cited['title']}}}", "year": year}
    for ours, theirs in (("version", "version"), ("doi", "doi"), ("collection-title", "booktitle")):
        if ours in cited:
            fields[theirs] = cited[ours]
    if "start" in cited:
        fields["pages"] = f"{cited['start']}--{cited['end']}"
    kind = "software" if cited.get("type") == "software" else "inproceedings"
    body = ",\n".join(f"  {name} = {{{value}}}" for name, value in fields.items())
    return f"@{kind}{{{key},\n{body}\n}}"


def described(schema, name):
    """Yield rows of one table of a study file: key, type, default, meaning."""
    for key, field in schema.get("properties", {}).items():
        kinds = field.get("anyOf", [field])
        kind = " or ".join(filter(None, map(_type, kinds)))
        default = "" if field.get("default") in (None, "", [], {}) else repr(field["default"])
        yield key, kind, default, field.get("description", "")


def _type(kind):
    if "const" in kind:
        return repr(kind["const"])
    if "enum" in kind:
        return ", ".join(map(repr, kind["enum"]))
    if "$ref" in kind:
        return kind["$ref"].rpartition("/")[2]
    return {"null": ""}.get(kind.get("type", "any"), kind.get("type", "any"))


class StudyKeys(SphinxDirective):
    """``.. study-keys::``: every table and key of a study file, from its schema."""

    def run(self):
        from nlctl.analysis.studies import Study

        schema = Study.model_json_schema()
        tables = {"A study": schema, **schema.get("$defs", {})}
        lines = []
        for name, table in tables.items():
            rows = list(described(table, name))
            if not rows:
                continue
            lines += [name, "-" * len(name), ""]
            lines += [_text(table.get("description", "").partition("\n\n")[0]), ""]
            lines += [".. list-table::", "   :header-rows: 1", ""]
            for row in [("key", "type", "default", "meaning"), *rows]:
                lines += [f"   * - {_text(row[0])}", *(f"     - {_text(x)}" for x in row[1:])]
            lines += [""]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def _text(words):
    for sign in "\\*|_`":
        words = words.replace(sign, "\\" + sign)
    return " ".join(words.split())


class CommandLine(SphinxDirective):
    """``.. command-line::``: every command and option, from the program's own help."""

    option_spec = {"program": directives.unchanged}

    def run(self):
        from nlctl.analysis.cli.main import app

        program = typer.main.get_command(app)
        context = typer.Context(program, info_name="nlctl")
        lines = []
        for name in program.list_commands(context):
            command = program.get_command(context, name)
            if command.hidden:
                continue
            inner = typer.Context(command, info_name=name, parent=context)
            usage = " ".join(command.collect_usage_pieces(inner))
            lines += [name, "-" * len(name), "", "::", "", f"    nlctl {name} {usage}", ""]
            lines += [_text(part) + "\n" for part in (command.help or "").split("\n\n")]
            for parameter in command.get_params(inner):
                record = parameter.get_help_record(inner)
                if record:
                    lines += [f"``{record[0].strip()}``", f"    {_text(record[1]) or '…'}", ""]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def setup(app):
    """Make the directives known."""
    app.add_directive("public", Public)
    app.add_directive("inside", Inside)
    app.add_directive("controllers", Controllers)
    app.add_directive("citation", Citation)
    app.add_directive("study-keys", StudyKeys)
    app.add_directive("command-line", CommandLine)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
