"""What an installed browser does for reports: show them, and print them to PDF."""

import contextlib
import os
import shutil
import signal
import subprocess
import tempfile
import webbrowser
from pathlib import Path

from nlctl.annotations import as_annotated
from nlctl.errors import UsageError
from nlctl.host.files import replace_file

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER_TIMEOUT = 300  # s after which the browser is checked for activity
BUSY = 1.0  # s of CPU time in that time are a sign of life, also on a machine with other work
FLAGS = (
    *("--headless", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)


def find_browser() -> str:
    """Return the path of an installed Chromium or Chrome."""
    for name in BROWSERS:
        path = shutil.which(name)
        if path:
            return path
    raise UsageError(
        f"a PDF is printed by Chromium or Chrome, and none is installed (looked for "
        f"{', '.join(BROWSERS)}); install one, for example with 'apt-get install chromium', or "
        "print index.html from any browser"
    )


@as_annotated
def write_pdf(page: str | os.PathLike[str], path: str | os.PathLike[str]) -> Path:
    """Print a page to PDF through an installed Chromium.

    Parameters
    ----------
    page : path
        An HTML file.
    path : path
        The PDF; an older one is replaced in one step.

    Returns
    -------
    pathlib.Path
        Of the PDF.

    Raises
    ------
    UsageError
        If no browser is installed, it prints nothing, or it hangs.  How long a print takes is
        not limited as long as the browser computes.

    Examples
    --------
    It needs an installed Chromium; without one it says so:

    >>> import tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.report import Report, write_pdf, write_report
    >>> report = Report(title="Nothing", verdict="Nothing.", claims=[], sections=[], command="")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = write_report(report, folder)
    ...     pdf = write_pdf(page, Path(folder, "page.pdf"))  # doctest: +SKIP
    """
    browser = find_browser()
    is_root = hasattr(os, "geteuid") and os.geteuid() == 0  # to whom Chromium refuses its sandbox
    flags = [*FLAGS, "--no-sandbox"] if is_root else FLAGS
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        printed = Path(folder, "page.pdf")
        command = [
            browser,
            *flags,
            f"--user-data-dir={folder}/profile",
            f"--print-to-pdf={printed}",
            "--no-pdf-header-footer",
            Path(page).resolve().as_uri(),
        ]
        reason = _run_while_busy(command, Path(folder, "errors.txt"))
        if not printed.exists():
            raise UsageError(f"'{browser}' printed no PDF of '{page}': {reason}")
        return replace_file(path, lambda file: file.write(printed.read_bytes()))


def _run_while_busy(command: list[str], errors: Path) -> str:
    """Run a program until it ends or hangs; return the last line of its errors."""
    # They go to a file: a pipe would stay open as long as any process that it has started.
    with errors.open("wb") as file:
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=file, start_new_session=True
        )
    spent = 0.0
    try:
        while True:
            try:
                process.wait(BROWSER_TIMEOUT)
            except subprocess.TimeoutExpired:
                before, spent = spent, _cpu_time(process.pid)
                if spent - before < BUSY:
                    return f"no sign of work for {BROWSER_TIMEOUT} s"
            else:
                messages = errors.read_text(encoding="utf-8", errors="replace").strip().splitlines()
                return (messages or ["no message"])[-1]
    finally:
        if hasattr(os, "killpg"):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        process.wait()


def _cpu_time(session: int) -> float:
    """Return the CPU time (s) of all processes of a session; 0 where it cannot be had."""
    ticks = 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has just ended
            fields = path.read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
            if int(fields[3]) == session:
                ticks += sum(map(int, fields[11:15]))  # user, system, and of children that ended
    return ticks / os.sysconf("SC_CLK_TCK") if ticks else 0.0


def open_page(page: str | os.PathLike[str]) -> bool:
    """Show a page in the user's browser; return whether there is one."""
    return webbrowser.open(Path(page).resolve().as_uri())
