"""The file that describes a data set: a scenario, what varies in it, and what is written."""

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, field_validator, model_validator

from insonify.annotations import Projection
from insonify.data_file import DataFile
from insonify.datasets.distributions import Draw, SwathArea, swath_area
from insonify.model import Decibels, Model, field_error
from insonify.scene.shape_library import PRESETS

Pair = Literal["no_multipath", "no_target", "other_speckle"]
Format = Literal["coco", "yolo", "png", "geotiff", "zarr"]
MAX_IMAGES = 10_000_000
"""More than any data set has [1]."""


class Settings(Model):
    """Number, seed, cut and split of the images."""

    images: Annotated[int, Field(ge=1, le=MAX_IMAGES)]
    """Number of scenes that are drawn; each gives one image, or its tiles."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    """Seed of all draws: the same seed, the same images."""
    projection: Projection = "slant"
    """Axes of the images: slant range, ground range or mosaic."""
    tile: tuple[Annotated[int, Field(ge=16, le=8192)], Annotated[int, Field(ge=16, le=8192)]] | None = None
    """Rows and columns of the tiles that images are cut to; None: they are not cut."""
    gain: str = "tvg30"
    """Gain of the images, see `insonify.processing.gain`; for spreading and absorption."""
    span: tuple[Decibels, Decibels] | None = None
    """Levels of the darkest grey and of white in pictures [dB]; None: of each image alone."""
    split: dict[str, Annotated[float, Field(gt=0, le=1)]] = Field(default={"train": 1.0})
    """Fraction of the scenes in each part; all tiles and twins of a scene are in one part."""

    @field_validator("gain")
    @classmethod
    def _known_gain(cls, value: str) -> str:
        from insonify.processing.gain import LAWS

        if value != "none" and value not in LAWS:
            raise ValueError(f"{value} is no gain; choose one of none, {', '.join(LAWS)}")
        return value

    @model_validator(mode="after")
    def _check_split(self) -> Self:
        total = sum(self.split.values())
        if abs(total - 1) > 1e-6:
            shown = " + ".join(f"{part:g}" for part in self.split.values())
            raise field_error("split", f"{shown} = {total:g}", "is not 1. Write fractions that make 1 together.")
        for name, count in zip(self.split, self.split_counts, strict=True):
            if not name.isidentifier():
                raise field_error("split", f"{name!r}", "is no name of a folder. Write letters, such as train.")
            if not count:
                raise field_error(f"split.{name}", f"{self.split[name]:g}", f"of {self.images} images is none. Give "
                                  "more images, a larger fraction, or leave it out.")  # fmt: skip
        return self

    @property
    def split_counts(self) -> list[int]:
        """Number of scenes in each part of the split."""
        ends = np.rint(np.cumsum(list(self.split.values())) * self.images).astype(int)
        return [int(count) for count in np.diff(ends, prepend=0)]


class Clutter(Model):
    """Things of one kind that are no targets: as many as drawn, each with draws of its own."""

    count: int | Draw
    """Number in an image."""
    target: dict[str, Any]
    """Keys of a target, without its position; each value fixed, or a distribution."""
    length: Draw | None = None
    """Length of a shape of the library, whose width and height stay in proportion [m]; None: as the target has it."""
    position: Annotated[SwathArea, BeforeValidator(swath_area)] = SwathArea()
    """Area over which they are spread uniformly."""

    @property
    def draws(self) -> dict[str, Draw]:
        """Distributions among the keys of the target."""
        known = set(Draw.model_fields)
        return {
            key: Draw.model_validate(value)
            for key, value in self.target.items()
            if isinstance(value, dict) and value and set(value) <= known
        }

    @model_validator(mode="after")
    def _check_length(self) -> Self:
        if self.length is not None and self.preset not in PRESETS:
            raise field_error("length", None, f"is for shapes of the library ({', '.join(PRESETS)}). Give the target's "
                              "own sizes.")  # fmt: skip
        return self

    @property
    def preset(self) -> str:
        """Name of the shape of the library; empty or unknown for others."""
        shape = str(self.target.get("shape", ""))
        return str(self.target.get("name", "")) if shape == "library" else shape


class DatasetFile(Model):
    """A data set: scenes drawn about one scenario."""

    dataset: Settings
    scene: DataFile
    """Scenario file; beside this file, unless its path starts from the root."""
    vary: dict[str, Draw] = Field(default={})
    """Distributions by key of the scenario, such as `targets[mine].heading` or `surface.wind_speed`."""
    clutter: tuple[Clutter, ...] = ()
    pairs: tuple[Pair, ...] = ()
    """Twins of each image that differ in one thing."""
    write: tuple[Format, ...] = ("coco",)
    """Formats that are written."""
    compare: DataFile | None = None
    """Real recording that the card states the distance to; None: none."""

    @model_validator(mode="after")
    def _check_formats(self) -> Self:
        if "geotiff" in self.write and self.dataset.projection != "mosaic":
            raise field_error("write", "geotiff", f"has a position on Earth, and {self.dataset.projection} range has "
                              "none. Write projection: mosaic, or leave geotiff out.")  # fmt: skip
        return self
