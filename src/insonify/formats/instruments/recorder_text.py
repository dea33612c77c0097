"""Recorder of a real instrument as stages of a scenario, as far as its file states them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from insonify.formats.instruments.scenario_values import ScenarioValues, Stated
from insonify.formats.instruments.sound_metrics_aris import DECIBELS_PER_COUNT

Floats = NDArray[np.float64]

CURVE_POINTS = 12
"""Most rows of a curve of stated gains."""
HEADROOM = 45.0
"""Full scale below source level that is assumed, behind 40 log R [dB]."""


def source_level(values: ScenarioValues) -> Stated:
    """Source level as stated, or of the electric power and the transducer's gain: 170.8 dB + 10 log P + G.

    Source: Urick (1983), Principles of Underwater Sound, ch. 4: 170.8 dB + 10 log P + DI for the power P [W] radiated;
    the gain G holds the directivity index and the efficiency.
    """
    if values.median("source_level"):
        return values.stated("source_level", "dB", 220.0)
    power, gain = values.median("transmit_power"), values.median("gain_db")
    if "voltage" in values.data and power and gain:
        level = 170.8 + 10 * np.log10(power) + gain
        return Stated(f"{level:.4g} dB", f"{values.group}: transmit_power and gain_db", level)
    return Stated("210 dB", "assumed", 210.0)


def recorder_lines(values: ScenarioValues) -> str:
    """Lines on the recorder; empty for samples that are written as they are received."""
    if "voltage" in values.data:
        return ""
    group, shape = values.group, values.data.sizes
    level = source_level(values).number
    reference = Stated(f"{{kind: gain, fixed_db: {-level:.4g} dB}}",
                       "assumed: the level stored is re the source level and the receiver's sensitivity")  # fmt: skip
    law = Stated("{kind: gain, tvg_db_per_decade: 40}", "assumed")
    log = Stated("{kind: companding, law: log}", f"format {values.file.format}")
    if (spreading := values.median("gain_exponent")) is not None:
        offset = values.median("gain_offset") or 0.0
        law = Stated(f"{{kind: gain, tvg_db_per_decade: {spreading:g}, fixed_db: {offset:g} dB}}",
                     f"{group}: gain_exponent and gain_offset; absorption assumed, the water's")  # fmt: skip
        return _lines((law, reference, log, _steps(values, 8, 0.5)))
    if values.is_multibeam:
        return _lines((_stated_gain(values, law), reference, log, _steps(values, 16, 0.1)))
    if "level_db" in values.data:
        own = Stated(f"{{kind: gain, fixed_db: {values.median('gain_db') or 0.0:g} dB}}", f"{group}: gain_db")
        return _lines((law, own, reference, log, _steps(values, 8, DECIBELS_PER_COUNT, ", signed: false")))
    if "amplitude" not in values.data:
        return ""
    count, top = shape["sample"], float(np.nanmax(values.data["amplitude"].values))
    sidescan = group in ("port", "starboard")
    keep = "peak" if sidescan else "mean"
    stages = [law, Stated(f"{{kind: decimation, samples: {count}, keep: {keep}}}", f"{group}: samples; {keep} assumed")]
    if not sidescan:
        exponent = values.median("gamma") or 255.0
        stages.append(
            Stated(f"{{kind: companding, law: gamma, gamma: {exponent / 255:.4g}}}", f"{group}: gamma of 255")
        )
    bits = max(8, int(np.ceil(np.log2(top + 1))))
    stages.append(Stated(f"{{kind: quantisation, bits: {bits}}}", f"{group}: amplitude, at most {top:.0f} counts"))
    return _lines(
        stages, Stated(f"{level - HEADROOM:.4g} dB", "assumed; insonify.processing.fit_recorder estimates it")
    )


def _lines(stages: Sequence[Stated], full_scale: Stated | None = None) -> str:
    """Section of some stages."""
    scale = "" if full_scale is None else full_scale.line("full_scale_db", "    ")
    return f"  recorder:\n{scale}    stages:\n" + "".join(
        f"      - {stage.text} # {stage.source}\n" for stage in stages
    )


def _steps(values: ScenarioValues, bits: int, step: float, more: str = "") -> Stated:
    """Rounding of levels that the format prescribes."""
    return Stated(f"{{kind: quantisation, bits: {bits}, step_db: {step:.6g} dB{more}}}", f"format {values.file.format}")


def _stated_gain(values: ScenarioValues, otherwise: Stated) -> Stated:
    """Gain of a multibeam by its stated values at the detections, as a curve over range."""
    slant, gain = _detected_gains(values)
    if not slant.size:
        absorption = values.median("absorption")
        if absorption is None:
            return otherwise
        return Stated(f"{{kind: gain, tvg_db_per_decade: 40, absorption_db_per_m: {absorption:.4g}}}",
                      f"40 log R assumed; {values.group}: absorption")  # fmt: skip
    parts = np.array_split(np.argsort(slant), min(CURVE_POINTS, slant.size))
    rows = {round(float(np.median(slant[part])), 2): round(float(np.median(gain[part])), 1) for part in parts}
    curve = ", ".join(f"[{at:g} m, {db:g} dB]" for at, db in rows.items())
    return Stated(f"{{kind: gain, curve: [{curve}]}}", f"{values.group}: gain at the detections of the sector")


def _detected_gains(values: ScenarioValues) -> tuple[Floats, Floats]:
    """Slant ranges [m] and gains [dB] of the detections of the sector, shape (n,) each; none where a file has none."""
    if "gain" not in values.data or "travel_time" not in values.data:
        return np.empty(0), np.empty(0)
    slant = values.data["travel_time"].values.ravel().astype(float) * values.sound_speed / 2
    gain = values.data["gain"].values.ravel()
    known = np.isfinite(slant) & np.isfinite(gain)
    if "sector" in values.data:
        known &= values.data["sector"].values.ravel() == values.sector
    return slant[known], gain[known]
