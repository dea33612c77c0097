"""Recorder: stages of an instrument between received pressure and its file, in the order of the signal.

A stage acts on the envelope: rms pressure [uPa] at first, decibels or counts after companding or quantisation. The
recorder's output is the content of the instrument's file.
"""

from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from insonify.model import Decibels, Model, field_error
from insonify.sonar.electronics import ReceiverGain

Floats = NDArray[np.float64]
Average = Literal["intensity", "amplitude"]
Keep = Literal["mean", "peak", "sample"]


class RecorderGain(ReceiverGain):
    """Gain of the recorder, which remains in the recording: X log R + 2 alpha R + offset, and a curve over range."""

    kind: Literal["gain"] = "gain"


class Looks(Model):
    """Mean over neighbouring samples and pings: less speckle for less resolution."""

    kind: Literal["looks"] = "looks"
    samples: Annotated[int, Field(ge=1, le=100_000)] = 1
    """Samples in each mean [1]."""
    step: Annotated[int, Field(ge=1, le=100_000)] | None = None
    """Samples from one mean to the next [1]; None: as many as are averaged, so that means share no sample."""
    pings: Annotated[int, Field(ge=1, le=1000)] = 1
    """Pings in each line [1]; lines share no ping."""
    of: Average = "intensity"
    """Quantity of which the mean is taken: intensity, whose root is recorded, or amplitude."""


class Decimation(Model):
    """Reduction to fewer samples, each of which stands for an equal part of the record."""

    kind: Literal["decimation"] = "decimation"
    samples: Annotated[int, Field(ge=1, le=10_000_000)]
    """Number of samples of each line after decimation [1]."""
    keep: Keep = "mean"
    """Mean intensity of each part, its peak, or the sample in its middle."""


class Clipping(Model):
    """Limit of the amplitude at full scale."""

    kind: Literal["clipping"] = "clipping"


class Companding(Model):
    """Compression of the amplitude: decibels, or a power or logarithm of its fraction of full scale."""

    kind: Literal["companding"] = "companding"
    law: Literal["log", "gamma", "mu"] = "log"
    """Level [dB]; x^gamma; or log(1 + mu x) / log(1 + mu) (ITU-T G.711), with x the fraction of full scale, at most
    1."""
    gamma: Annotated[float, Field(gt=0, le=10)] = 0.5
    """Exponent of the law gamma [1]."""
    mu: Annotated[float, Field(gt=0, le=1e6)] = 255.0
    """Constant of the law mu [1]."""


class Quantisation(Model):
    """Rounding to whole numbers, or to steps of decibels after companding by log."""

    kind: Literal["quantisation"] = "quantisation"
    bits: Annotated[int, Field(ge=1, le=32)]
    """Bits of each number [1]: full scale is 2^bits - 1; levels have -2^(bits - 1) to 2^(bits - 1) - 1 steps."""
    step_db: Annotated[Decibels, Field(gt=0, le=100)] | None = None
    """Step of levels [dB]; None: counts."""
    signed: bool = True
    """Levels of both signs; False: 0 to 2^bits - 1 steps."""


Stage = Annotated[RecorderGain | Looks | Decimation | Clipping | Companding | Quantisation, Field(discriminator="kind")]
"""Any stage."""


class Recorder(Model):
    """Recorder of an instrument: stages between received pressure and file, in their order.

    Example:
        >>> recorder = Recorder(stages=[{"kind": "clipping"}, {"kind": "quantisation", "bits": 8}], full_scale_db=150)
        >>> [stage.kind for stage in recorder.stages], recorder.units
        (['clipping', 'quantisation'], '1')
    """

    stages: tuple[Stage, ...]
    """Stages, in the order in which the signal passes them."""
    full_scale_db: Annotated[Decibels, Field(ge=-300, le=500)] | None = None
    """Rms level of full scale, after the gain [dB re 1 uPa]; None: there is no full scale."""
    keep: Literal["both", "recorded"] = "both"
    """Content of the recording: the recorded numbers and the pressure before the recorder, or the numbers alone."""

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        unit = "uPa"
        for row, stage in enumerate(self.stages):
            where = f"stages.{row}"
            if unit in ("dB", "companded") and not isinstance(stage, Quantisation | Decimation):
                raise field_error(where, None, f"{stage.kind} comes after companding. Put it before.")
            precedes_quantisation = isinstance(stage, RecorderGain) or getattr(stage, "law", "") == "log"
            if precedes_quantisation and unit == "counts":
                raise field_error(where, None, f"{stage.kind} comes after quantisation. Put it before.")
            if isinstance(stage, Quantisation) and (stage.step_db is None) == (unit == "dB"):
                raise field_error(f"{where}.step_db", None, "belongs to levels: give a step in dB after companding by "
                                  "log, and none elsewhere.")  # fmt: skip
            is_scaled = isinstance(stage, Clipping | Companding | Quantisation) and unit == "uPa"
            if is_scaled and getattr(stage, "law", "") != "log" and self.full_scale_db is None:
                raise field_error("full_scale_db", None, f"is missing, and {stage.kind} refers to it. Give the level "
                                  "that fills the scale.")  # fmt: skip
            if isinstance(stage, Companding):
                unit = "dB" if stage.law == "log" else "companded"
            elif isinstance(stage, Quantisation) and unit == "uPa":
                unit = "counts"
        return self

    @property
    def pings_per_line(self) -> int:
        """Number of pings in one line of the recording."""
        count = 1
        for stage in self.stages:
            count *= stage.pings if isinstance(stage, Looks) else 1
        return count

    @property
    def units(self) -> str:
        """Units of the recorded numbers."""
        kinds = [stage.law if isinstance(stage, Companding) else stage.kind for stage in self.stages]
        if "log" in kinds:
            return "dB re 1 uPa"
        return "1" if {"gamma", "mu", "quantisation"} & set(kinds) else "uPa"

    def gain_db(self, time: Floats, sound_speed: float, absorption_db_per_m: float) -> Floats:
        """Gain of all stages together [dB].

        Args:
            time: Time after the start of transmission [s], any shape.
            sound_speed: Sound speed by which time is converted to range [m/s].
            absorption_db_per_m: One-way absorption of the water, for gains without an absorption of their own [dB/m].
        """
        gains = [stage for stage in self.stages if isinstance(stage, RecorderGain)]
        return sum((gain.db(time, sound_speed, absorption_db_per_m) for gain in gains), np.zeros(np.shape(time)))
