"""Warnings at the line of the program that called the library, however many functions of the library lie between."""

import sys
import warnings
from types import FrameType

_NOT_THE_CALLER = ("insonify", "pydantic", "pydantic_core", "contextlib", "functools", "concurrent", "threading")
"""Packages whose functions may lie between the caller and a warning."""


def warn_caller(message: str, category: type[Warning] = UserWarning) -> None:
    """Issue a warning at the caller's line.

    In a thread of the library, which no line of a program has called, it is issued where it arises. Python shows a
    text once for each line.

    Args:
        message: Text of the warning.
        category: Its class.
    """
    here = sys._getframe(1)
    frame: FrameType | None = here
    while frame is not None and _package(frame) in _NOT_THE_CALLER:
        frame = frame.f_back
    at = frame or here
    names = at.f_globals
    warnings.warn_explicit(
        message, category, at.f_code.co_filename, at.f_lineno, names.get("__name__", ""),
        names.setdefault("__warningregistry__", {}),
    )  # fmt: skip


def _package(frame: FrameType) -> str:
    """Name of the package that a function belongs to."""
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]
