"""``nlctl new NAME``: a folder with a loop, a study of it and a test, which run as they are."""

import re
from pathlib import Path
from string import Template

from nlctl.errors import ParameterError
from nlctl.host.files import replace_file

_FILES = {"loop.py": "loop.py", "study.toml": "{name}.toml", "test_loop.py": "test_loop.py"}


def start_project(folder: Path) -> list[Path]:
    """Write the files; a folder that holds anything is refused."""
    name = folder.resolve().name
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name):
        raise ParameterError(
            f"new needs a name of letters, digits, '-' and '_', such as my-loop, got '{name}'"
        )
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ParameterError(f"'{folder}' exists already: give the name of a new folder")
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for source, target in _FILES.items():
        text = (Path(__file__).parent / "starter" / f"{source}.txt").read_text(encoding="utf-8")
        content = Template(text).substitute(name=name).encode()
        path = folder / target.format(name=name)
        paths.append(replace_file(path, lambda file, content=content: file.write(content)))
    return paths
