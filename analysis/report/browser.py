"""What an installed browser does for reports: show them, and print them to PDF."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import webbrowser
from pathlib import Path

from nlctl.errors import UsageError
from nlctl.host.files import replace_file

__all__ = ["find_browser", "open_page", "write_pdf"]

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
PATIENCE = 300  # s
FLAGS = (
    *("--headless", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)


def find_browser() -> str:
    """Return the path of an installed Chromium or Chrome.

    Raises
    ------
    UsageError
        If there is none, with what to install.
    """
    for name in BROWSERS:
        path = shutil.which(name)
        if path:
            return path
    raise UsageError(
        f"a PDF is printed by Chromium or Chrome, and none is installed (looked for "
        f"{', '.join(BROWSERS)}); install one, for example with 'apt-get install chromium', or "
        "print index.html from any browser"
    )


def write_pdf(page: str | os.PathLike[str], path: str | os.PathLike[str]) -> Path:
    """Print a page to PDF through an installed Chromium.

    Parameters
    ----------
    page : path
        An HTML file.
    path : path
        The PDF; an older one is replaced in one step.

    Raises
    ------
    UsageError
        If no browser is installed, or it prints nothing.
    """
    browser = find_browser()
    flags = [*FLAGS, "--no-sandbox"] if _is_root() else FLAGS
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        made = Path(folder, "page.pdf")
        command = [
            browser,
            *flags,
            f"--user-data-dir={folder}/profile",
            f"--print-to-pdf={made}",
            "--no-pdf-header-footer",
            Path(page).resolve().as_uri(),
        ]
        try:
            run = subprocess.run(
                command, capture_output=True, text=True, timeout=PATIENCE, check=False
            )
        except subprocess.TimeoutExpired:
            raise UsageError(
                f"'{browser}' printed no PDF of '{page}' within {PATIENCE} s"
            ) from None
        if not made.exists():
            reason = (run.stderr.strip().splitlines() or ["no message"])[-1]
            raise UsageError(f"'{browser}' printed no PDF of '{page}': {reason}")
        return replace_file(path, lambda file: file.write(made.read_bytes()))


def open_page(page: str | os.PathLike[str]) -> bool:
    """Show a page in the user's browser; return whether there is one."""
    return webbrowser.open(Path(page).resolve().as_uri())


def _is_root() -> bool:
    """Whether Chromium would refuse its sandbox."""
    return hasattr(os, "geteuid") and os.geteuid() == 0
