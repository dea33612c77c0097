"""Lines that differ in numbers and names alone: some of them, and the number of the others."""

import re
from collections import Counter

MOST_ALIKE = 5
"""Lines of one kind that are printed [1]."""
_VARYING = re.compile(r"\([^()]*\)|\btarget \S+|\d+(?:\.\d+)*")
"""Labels, numbers and indices of a line."""


class AlikeLines:
    """Lines by kind: those of one kind differ in their labels, numbers and indices alone."""

    def __init__(self) -> None:
        """Begin without a line."""
        self._lines: set[str] = set()
        self._counts = Counter[str]()

    def add(self, line: str) -> bool:
        """Count a line; return True for a new one among the first `MOST_ALIKE` of its kind, which is to be printed."""
        if line in self._lines:
            return False
        self._lines.add(line)
        kind = _VARYING.sub("#", line)
        self._counts[kind] += 1
        return self._counts[kind] <= MOST_ALIKE

    def left_out(self) -> int:
        """Number of lines that were not shown though they were new."""
        return sum(max(count - MOST_ALIKE, 0) for count in self._counts.values())


def shortened(text: str) -> str:
    r"""A text of many lines with the first `MOST_ALIKE` of each kind, and the number of the others.

    Example:
        >>> print(shortened("\n".join(f"a.yaml:{k}: targets.{k}: unknown key" for k in range(1, 101))))
        a.yaml:1: targets.1: unknown key
        a.yaml:2: targets.2: unknown key
        a.yaml:3: targets.3: unknown key
        a.yaml:4: targets.4: unknown key
        a.yaml:5: targets.5: unknown key
        and 95 more lines like these
    """
    alike = AlikeLines()
    lines = [line for line in text.split("\n") if alike.add(line)]
    return "\n".join([*lines, *[f"and {alike.left_out()} more lines like these"] * bool(alike.left_out())])
