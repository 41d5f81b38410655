"""Zig, which compiles and links for other machines: it comes from PyPI, in the extra ``export``."""

import importlib.util
import subprocess
import sys
from pathlib import Path

from ..errors import CompileError, UsageError


def check_zig(purpose: str) -> None:
    """Refuse, before anything is computed, where there is no Zig."""
    if importlib.util.find_spec("ziglang") is None:
        raise UsageError(
            f"{purpose} by ziglang, which is not installed: pip install 'nlctl[export]'"
        )


def zig(arguments: list[str], folder: str | Path, file: str, failed: str) -> bytes:
    """Return the file that a command of Zig's writes into a folder."""
    command = [sys.executable, "-m", "ziglang", *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    path = Path(folder) / file
    if done.returncode or not path.exists():
        raise CompileError(f"{failed}: {done.stderr.strip()}")
    return path.read_bytes()
