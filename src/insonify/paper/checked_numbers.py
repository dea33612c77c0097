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
    """What it should be, in the same unit; None where it is only told."""
    tolerance: float | None = None
    """How far it may be off; None with an expected value: that is a lower bound."""
    source: str = ""
    """Where the expected value comes from."""

    @property
    def relation(self) -> str | None:
        """How the value should stand to the expected one: ">=" to a lower bound, "=" within the tolerance."""
        if self.expected is None:
            return None
        return ">=" if self.tolerance is None else "="

    @property
    def holds(self) -> bool | None:
        """Whether it is what it should be; None where nothing is expected."""
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
    told = {
        name: {"seed": scenario.seed, "sha256": hashlib.sha256(to_yaml(scenario).encode()).hexdigest()}
        for name, scenario in scenarios.items()
    }
    rows = [{**asdict(number), "relation": number.relation, "holds": number.holds} for number in numbers]
    content = {"figure": figure, "title": title, "version": version("insonify"), "scenarios": told, "numbers": rows}
    path.write_text(json.dumps(content, indent=1, default=float) + "\n", encoding="utf-8")
    return path
