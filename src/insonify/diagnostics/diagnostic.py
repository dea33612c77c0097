"""Diagnostics of a scenario file: problem, location in the file, and fix.

One line per fault: file and line, key, problem, allowed values, fix.
"""

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One fault of a scenario file and its fix; prints as one line."""

    file: str
    """Name of the file, as the author gave it."""
    line: int
    """Line of the faulty value, or of the group that lacks it, counted from 1; 0 for a file without lines."""
    field: str
    """Keys and list indices joined by dots: targets.0.position; empty for the file as a whole."""
    problem: str
    """Problem; begins with the value as it was typed, where there is one."""
    allowed: str = ""
    """The allowed range or choices, where they are known."""
    fix: str = ""
    """Value to write instead, where it can be guessed."""
    label: str = ""
    """Label in the file of the item that the field belongs to, such as a target's label."""

    def __str__(self) -> str:
        """The advice as it is printed, one line, like a compiler's."""
        location = f"{self.file}:{self.line}:" if self.line else f"{self.file}:"
        label = f" ({self.label})" if self.label else ""
        field = f" {self.field}{label}:" if self.field else ""
        allowed = f" ({self.allowed})" if self.allowed else ""
        fix = f" {self.fix}" if self.fix else ""
        text = f"{location}{field} {_ended(self.problem + allowed)}{_ended(fix)}"
        return " ".join(text.split())


class ScenarioError(ValueError):
    """A scenario that cannot be simulated, with every fault found in it."""

    def __init__(self, faults: Sequence[Diagnostic]) -> None:
        """Hold the faults in the order of the file's lines."""
        self.faults = tuple(sorted(faults, key=lambda fault: (fault.line, fault.field)))
        super().__init__("\n".join(str(fault) for fault in self.faults))

    def __reduce__(self) -> tuple[type["ScenarioError"], tuple[Sequence[Diagnostic]]]:
        """The faults, from which another process makes the error anew."""
        return type(self), (self.faults,)


def nearest_word(word: str, known: Iterable[str]) -> str | None:
    """The known word that was probably meant, or None where nothing is near."""
    spelt = {name.lower(): name for name in known}
    near = difflib.get_close_matches(word.lower(), spelt, n=1, cutoff=0.6)
    return spelt[near[0]] if near else None


def _ended(sentence: str) -> str:
    return sentence if not sentence or sentence.endswith((".", "?", "!")) else sentence + "."
