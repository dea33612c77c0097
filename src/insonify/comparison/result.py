"""Result of a comparison: each measure with its numbers, intervals and verdict in words."""

import json
import math
from dataclasses import dataclass
from typing import Any, Literal

from insonify.comparison.measure import Curve
from insonify.comparison.samples import Floats

Verdict = Literal["alike", "different", "not compared"]


@dataclass(frozen=True, slots=True)
class Value:
    """One number of both recordings.

    Example:
        >>> looks = Value("looks", "1", real=3.9, simulated=1.0, difference=2.9, low=2.6, high=3.2, probability=0.001)
        >>> looks.low > 0  # the interval excludes no difference
        True
    """

    name: str
    unit: str
    real: float
    """Value of the real recording, NaN of a distance between both."""
    simulated: float
    difference: float
    """Real less simulated, or the distance."""
    low: float
    """Lower end of the 95 % interval of the difference, NaN where one look gives none."""
    high: float
    """Upper end of that interval."""
    probability: float
    """Chance of it in two draws of one scene, adjusted for the numbers of the measure; NaN: not tested."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One measure of a comparison.

    Example:
        >>> looks = Value("looks", "1", real=3.9, simulated=1.0, difference=2.9, low=2.6, high=3.2, probability=0.001)
        >>> finding = Finding("texture", "different", "3.9 looks, not 1.0", probability=0.005, values=(looks,))
        >>> finding.verdict, finding.values[0].difference
        ('different', 2.9)
    """

    measure: str
    verdict: Verdict
    reason: str
    """Verdict in words."""
    probability: float
    """Chance of such a difference in two draws of one scene, adjusted for the number of measures."""
    values: tuple[Value, ...] = ()
    curves: tuple[Curve, ...] = ()


@dataclass(frozen=True, slots=True)
class Comparison:
    """Comparison of a real and a simulated recording, or of any two.

    Example:
        >>> findings = (
        ...     Finding("level against range", "alike", "within 0.4 dB", probability=0.6),
        ...     Finding("texture", "different", "3.9 looks, and 1.0 simulated", probability=0.005),
        ... )
        >>> slant_range, level = np.array([10.0, 20.0]), np.array([[90.0, 78.0]])
        >>> Comparison("line.xtf", "line.zarr", findings, (), slant_range, (level, level)).summary()
        '1 of 2 measures differ: texture'
    """

    real: str
    simulated: str
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]
    """Treatment of both recordings before they were compared."""
    slant_range: Floats
    """Common axis of range [m], shape (sample,)."""
    levels: tuple[Floats, Floats]
    """Level of the first or nadir beam of both [dB], shape (ping, sample), for pictures."""

    def __repr__(self) -> str:
        """Names, verdict on the whole, and the verdict on each measure."""
        lines = [f"Comparison of {self.real} and {self.simulated}: {self.summary()}"]
        width = max((len(finding.measure) for finding in self.findings), default=0)
        lines += [f"  {finding.measure:{width}}  {finding.verdict}: {finding.reason}" for finding in self.findings]
        return "\n".join(lines)

    @property
    def different(self) -> tuple[str, ...]:
        """Names of the measures that differ, at 5 % over all measures together."""
        return tuple(finding.measure for finding in self.findings if finding.verdict == "different")

    def finding(self, measure: str) -> Finding:
        """One measure by its name.

        Args:
            measure: Name of the measure.

        Raises:
            KeyError: There is no such measure.
        """
        for finding in self.findings:
            if finding.measure == measure:
                return finding
        raise KeyError(
            f"{measure!r} is no measure; there are {', '.join(finding.measure for finding in self.findings)}"
        )

    def summary(self) -> str:
        """Verdict on the whole, in one sentence."""
        tested = [finding for finding in self.findings if finding.verdict != "not compared"]
        if not tested:
            return "nothing could be compared"
        if not self.different:
            return f"no difference in {len(tested)} measures at the 5 % level"
        return f"{len(self.different)} of {len(tested)} measures differ: {', '.join(self.different)}"

    def to_dict(self) -> dict[str, Any]:
        """All of it as JSON has it; numbers that are not known are None."""
        return {
            "real": self.real, "simulated": self.simulated, "summary": self.summary(), "notes": list(self.notes),
            "findings": [
                {
                    "measure": finding.measure, "verdict": finding.verdict, "reason": finding.reason,
                    "probability": _number(finding.probability),
                    "values": [
                        {name: _number(getattr(value, name)) for name in Value.__slots__} for value in finding.values
                    ],
                }
                for finding in self.findings
            ],
        }  # fmt: skip

    def to_json(self) -> str:
        """All of it as JSON text."""
        return json.dumps(self.to_dict(), indent=1) + "\n"


def _number(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
