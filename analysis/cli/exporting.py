"""``nlctl export``: a controller, all equations of a loop, or an FMU, for other machines."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from nlctl.errors import ParameterError
from nlctl.export import TARGETS, c_files, export_controller, export_equations, fmu, object_code
from nlctl.host.files import replace_file
from nlctl.names import unknown

from .loops import assignments, named_loop


def write_export(
    loop: str,
    block: str | None,
    target: str,
    *,
    dt: float | None,
    method: str | None,
    settings: Sequence[str],
    name: str | None,
    out: Path,
) -> list[Path]:
    """Write what a loop's name stands for; return the files."""
    # All content is made before the first file is written.
    if target != "c" and target not in TARGETS:
        raise unknown("target", target, ["c", *TARGETS], "of export")
    content: dict[str, str | bytes] = {}
    diagram = named_loop(loop)
    params, start = assignments(diagram, settings)
    if block is None:
        if dt is not None or method is not None or target != "c":
            raise ParameterError(
                "export of a whole loop is C in continuous time: name a --block for object code, "
                "--dt and --method"
            )
        equations = export_equations(diagram, params=params, initial_state=start, name=name)
        content |= c_files(equations)
    else:
        controller = export_controller(
            diagram, block, dt=dt, method=method, params=params, initial_state=start, name=name
        )
        content |= c_files(controller)
        if target != "c":
            del content[f"{controller.name}.c"]
            content[f"{controller.name}.o"] = object_code(controller, target)
    out.mkdir(parents=True, exist_ok=True)
    return [_written(out / file, text) for file, text in content.items()]


def write_fmu(
    loop: str,
    others: Mapping[str, object],
    target: str,
    *,
    settings: Sequence[str],
    name: str | None,
    version: int,
    stop_time: float,
    out: Path,
) -> Path:
    """Write what a loop's name stands for as an FMU; return the file."""
    # `others` are options that are of controllers alone.
    given = [option for option, value in others.items() if value is not None]
    if given or target != "c":
        raise ParameterError(
            f"--fmu is of a whole loop: leave out {' and '.join(given or ['--target'])}"
        )
    diagram = named_loop(loop)
    params, start = assignments(diagram, settings)
    if out.suffix != ".fmu":
        out = out / f"{name or diagram.name}.fmu"
    out.parent.mkdir(parents=True, exist_ok=True)
    return fmu(
        diagram, out, version=version, params=params, initial_state=start, name=name,
        stop_time=stop_time,
    )  # fmt: skip


def _written(path: Path, content: str | bytes) -> Path:
    """Write a file in one step."""
    data = content.encode() if isinstance(content, str) else content
    return replace_file(path, lambda file: file.write(data))
