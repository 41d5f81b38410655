"""Processes of tests: who began whom, and whether it still runs (Linux)."""

import time
from pathlib import Path


def stat(pid):
    """Return state and parent of a process; None where it is gone."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    except OSError:
        return None
    state, parent = text.rpartition(") ")[2].split()[:2]
    return state, int(parent)


def descendants(pid):
    """Return the numbers of all processes that a process, or one of these, has begun."""
    parents = {int(p.name): s[1] for p in Path("/proc").glob("[0-9]*") if (s := stat(p.name))}
    found, new = set(), {pid}
    while new:
        new = {child for child, parent in parents.items() if parent in new} - found
        found |= new
    return found


def alive(pids):
    """Return those of some processes that still run."""
    return {pid for pid in pids if (s := stat(pid)) and s[0] not in "ZX"}


def wait_until(is_true, seconds):
    """Return whether something becomes true within some time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if is_true():
            return True
        time.sleep(0.05)
    return False
