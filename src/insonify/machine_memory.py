"""Memory of this machine."""

import os
import re
from pathlib import Path

from insonify.caller_warning import warn_caller

MOST = 0.5
"""Part of the free memory from which a warning is given [1]."""


def installed_memory() -> float:
    """Memory of this machine [bytes]; infinite where the system does not report it."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (ValueError, OSError, AttributeError):
        return float("inf")


def available_memory() -> float:
    """Memory that is not in use [bytes]; all of it where the system does not report it."""
    try:
        match = re.search(r"^MemAvailable:\s*(\d+) kB", Path("/proc/meminfo").read_text(encoding="ascii"), re.MULTILINE)
    except OSError:
        match = None
    return installed_memory() if match is None else float(match[1]) * 1024


def warn_of_memory(size: float, holder: str, advice: str) -> None:
    """Warn before an array fills the memory: a system that runs out of it stops the program without a message.

    Args:
        size: Size of the array [bytes].
        holder: Holder of the array, as the warning names it.
        advice: Remedy.
    """
    if size > MOST * (free := available_memory()):
        warn_caller(f"{holder}: {size / 1e9:.3g} GB, and {free / 1e9:.3g} GB are free. {advice}.")
