"""Numbers of a figure, beside what they should be and who says so."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml


@dataclass(frozen=True, slots=True)
class CheckedNumber:
    """One measured number."""

    name: str
    value: float
    unit: str
    expected: float | None = None
    """Expected value, in the same unit; None where the value is only reported."""
    tolerance: float | None = None
    """Largest error; None with an expected value: that is a lower bound."""
    source: str = ""
    """Source of the expected value."""

    @property
    def relation(self) -> str | None:
        """Relation of the value to the expected one: ">=" to a lower bound, "=" within the tolerance."""
        if self.expected is None:
            return None
        return ">=" if self.tolerance is None else "="

    @property
    def holds(self) -> bool | None:
        """True where the value agrees with the expected one; None where nothing is expected."""
        if self.expected is None:
            return None
        if self.tolerance is None:
            return bool(self.value >= self.expected)
        return bool(abs(self.value - self.expected) <= self.tolerance)


def write_numbers(
    path: Path, figure: int, title: str, scenarios: dict[str, Scenario], numbers: Iterable[CheckedNumber]
) -> Path:
    """Write a figure's numbers as JSON.

    Args:
        path: File to write.
        figure: Number of the figure.
        title: What it shows.
        scenarios: What was simulated, by name.
        numbers: What came out.

    Returns:
        The path.
    """
    scenarios_used = {
        name: {"seed": scenario.seed, "sha256": hashlib.sha256(to_yaml(scenario).encode()).hexdigest()}
        for name, scenario in scenarios.items()
    }
    rows = [{**asdict(number), "relation": number.relation, "holds": number.holds} for number in numbers]
    content = {
        "figure": figure,
        "title": title,
        "version": version("insonify"),
        "scenarios": scenarios_used,
        "numbers": rows,
    }
    path.write_text(json.dumps(content, indent=1, default=float) + "\n", encoding="utf-8")
    return path
