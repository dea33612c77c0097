"""Numbers of a figure, compared with expected values and their sources."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from matplotlib.figure import Figure

from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml


@dataclass(frozen=True, slots=True)
class CheckedNumber:
    """Measured number with its expected value."""

    name: str
    value: float
    unit: str
    expected: float | None = None
    """Expected value, in the same unit; None where the number is only reported."""
    tolerance: float | None = None
    """Largest difference from the expected value; None: the expected value is a lower bound."""
    source: str = ""
    """Source of the expected value."""

    @property
    def relation(self) -> str | None:
        """Relation of the value to the expected one: ">=" for a lower bound, "=" within the tolerance."""
        if self.expected is None:
            return None
        return ">=" if self.tolerance is None else "="

    @property
    def holds(self) -> bool | None:
        """True where the value agrees with the expected one; None without an expected value."""
        if self.expected is None:
            return None
        if self.tolerance is None:
            return bool(self.value >= self.expected)
        return bool(abs(self.value - self.expected) <= self.tolerance)


Drawn = tuple[Figure, dict[str, Scenario], Iterable[CheckedNumber]]
"""A figure, its scenarios by name, and its numbers."""


def write_numbers(
    path: Path, figure: int, title: str, scenarios: dict[str, Scenario], numbers: Iterable[CheckedNumber]
) -> Path:
    """Write a figure's numbers as JSON.

    Args:
        path: File to write.
        figure: Number of the figure.
        title: Title of the figure.
        scenarios: Simulated scenarios, by name.
        numbers: Measured numbers.

    Returns:
        The path.
    """
    provenance = {
        name: {"seed": scenario.seed, "sha256": hashlib.sha256(to_yaml(scenario).encode()).hexdigest()}
        for name, scenario in scenarios.items()
    }
    rows = [{**asdict(number), "relation": number.relation, "holds": number.holds} for number in numbers]
    about = {"figure": figure, "title": title, "version": version("insonify")}
    content = {**about, "scenarios": provenance, "numbers": rows}
    path.write_text(json.dumps(content, indent=1, default=float) + "\n", encoding="utf-8")
    return path
