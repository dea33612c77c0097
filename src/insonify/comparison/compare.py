"""Comparison of two recordings, measure by measure."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from insonify.comparison.frame import Frame, Side, common_frame
from insonify.comparison.measure import Measure, decibels
from insonify.comparison.registry import measures
from insonify.comparison.result import Comparison, Finding, Value, Verdict
from insonify.comparison.samples import Floats
from insonify.comparison.significance import (
    bootstrap_weights,
    by_stratum,
    exchanges,
    holm,
    interval,
    p_values,
)  # fmt: skip
from insonify.comparison.sources import Source, samples_of

LEVEL = 0.05
"""Chance at which two draws of one scene are called different in any measure."""
_CHUNK = 1 << 24  # features of exchanged recordings that are held at once


def compare(real: Source, simulated: Source, *, group: str | None = None, seed: int = 0) -> Comparison:
    """Compare two recordings, images or sets of detections.

    Each measure is tested by exchange of blocks of pings between both (of tiles of range where there are few pings),
    intervals are those of the Bayesian bootstrap over the same blocks, and the chance of any false difference over all
    measures is limited to 5 % by Holm's rule.

    Args:
        real: File of an instrument, a recording of ours (folder, URL, netCDF file or dataset), an image, or samples.
        simulated: The other one, of any of these kinds.
        group: Group of data of a file with several, such as "38 kHz", "water column" or "port".
        seed: Seed of exchange and bootstrap: the same seed gives the same numbers.

    Returns:
        Findings of all measures, with numbers, intervals and verdicts.

    Raises:
        StoreError: A source cannot be read, or both share no range.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> recording = insonify.simulate(scenario, pings=range(4))
        >>> weaker = insonify.simulate(scenario.with_("sonar.source_level_db", "214 dB"), pings=range(4))
        >>> insonify.compare(recording, weaker, group="starboard").finding("level against range").verdict
        'different'
    """
    second = samples_of(simulated, group)
    frame = common_frame(samples_of(real, group, second.frequency), second)
    weights = exchanges(frame, seed)
    findings = [_finding(kind, frame, weights, seed) for kind in measures()]
    adjusted = holm([finding.probability for finding in findings])
    judged = tuple(_judged(finding, chance) for finding, chance in zip(findings, adjusted, strict=True))
    levels = (_picture(frame.first), _picture(frame.second))
    return Comparison(
        frame.first.samples.name, frame.second.samples.name, judged, frame.notes, frame.slant_range, levels
    )


def _finding(kind: type[Measure], frame: Frame, weights: Floats, seed: int) -> Finding:
    """One measure, its probability not yet adjusted for the number of measures."""
    if reason := kind.unsuited(frame):
        return Finding(kind.name, "not compared", reason, float("nan"))
    measure = kind(frame)
    units = [measure.sums(side) for side in frame.sides]
    totals = [rows.sum(axis=0) for rows in units]
    real, simulated = (measure.estimate(total) for total in totals)
    observed = np.concatenate([real - simulated, measure.distance(*totals)])
    quantities = (*measure.quantities, *measure.distances)
    tested = np.array([quantity.tested for quantity in quantities])
    exchanged = np.concatenate(list(_exchanged(measure, frame, units, weights)))
    adjusted, chance = p_values(np.where(tested, observed, np.nan), exchanged, len(measure.distances))
    resampled = [bootstrap_weights(len(rows), seed + row) @ rows for row, rows in enumerate(units)]
    edges = interval(np.hstack([measure.estimate(resampled[0]) - measure.estimate(resampled[1]),
                                measure.distance(*resampled)]))  # fmt: skip
    one_sided = [np.pad(values, (0, len(measure.distances)), constant_values=np.nan) for values in (real, simulated)]
    rows = zip(quantities, one_sided[0], one_sided[1], observed, *edges, adjusted, strict=True)
    values = tuple(Value(q.name, q.unit, *(float(number) for number in numbers)) for q, *numbers in rows)
    remark, curves = measure.remark(*totals), measure.curves(*totals)
    if not np.isfinite(chance):
        few = "too few independent samples to separate two draws"
        return Finding(kind.name, "not compared", few, float("nan"), values, curves)
    return Finding(kind.name, "alike", remark, chance, values, curves)


def _exchanged(measure: Measure, frame: Frame, units: list[Floats], weights: Floats) -> Iterator[Floats]:
    """Differences and distances under random exchange of units, some exchanges at once."""
    rows = by_stratum(frame, *units)
    features = rows.shape[2]
    flat, total = rows.reshape(-1, features), rows.sum(axis=(0, 1))
    step = max(_CHUNK // max(features, 1), 1)
    for start in range(0, len(weights), step):
        first = weights[start : start + step].reshape(-1, len(flat)) @ flat
        second = total - first
        yield np.hstack([measure.estimate(first) - measure.estimate(second), measure.distance(first, second)])


def _judged(finding: Finding, chance: float) -> Finding:
    """The finding with its verdict at the adjusted probability."""
    if finding.verdict == "not compared":
        return finding
    verdict: Verdict = "different" if chance <= LEVEL else "alike"
    remark = f"; {finding.reason}" if finding.reason else ""
    return replace(finding, verdict=verdict, probability=chance, reason=f"{_words(finding, verdict)}{remark}")


def _words(finding: Finding, verdict: str) -> str:
    """Verdict in words: the number that is least probable of two draws of one scene."""
    tested = [value for value in finding.values if np.isfinite(value.probability)]
    if verdict == "alike":
        return "no more different than two draws of one scene"
    if not tested:
        return "different"
    most = min(tested, key=lambda value: (value.probability, -abs(value.difference)))
    unit = "" if most.unit == "1" else f" {most.unit}"
    if np.isfinite(most.real):
        return f"{most.name}: {most.real:.3g} against {most.simulated:.3g}{unit}"
    return f"{most.name} {most.difference:.3g}{unit}"


def _picture(side: Side) -> Floats:
    """Level of the beam nearest to the vertical, or of the first [dB], shape (ping, sample)."""
    return decibels(side.intensity[:, side.vertical_beam])
