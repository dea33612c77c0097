"""The file that describes a data set: a scenario, what varies in it, and what is written."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self, get_args

import numpy as np
from pydantic import BeforeValidator, Field, ValidationError, field_validator, model_validator
from pydantic_core import PydanticCustomError

from insonify.annotations import ClassScheme, Projection
from insonify.data_file import DataFile
from insonify.datasets.distributions import Draw, SwathArea, in_si, swath_area
from insonify.model import Decibels, Model, field_error, field_errors
from insonify.scene.shape_library import PRESETS

Level = Annotated[Decibels, Field(ge=-1000, le=1000)]
Pair = Literal["no_multipath", "no_target", "other_speckle"]
Format = Literal["coco", "yolo", "png", "geotiff", "zarr"]
MAX_IMAGES = 10_000_000
"""More than any data set has [1]."""
LEAST_SPAN_DB = 0.1
"""Least span of the greys of a picture [dB]."""
MAX_THINGS = 2000
"""Most things of one kind of clutter in an image [1]."""


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
    classes: ClassScheme = "parts"
    """Class of a highlight: parts, highlight; shapes, the shape of its target, of one of the library its name; labels,
    the label of its target, of clutter without its number. Shadows and ghosts have classes of their own in any case."""
    gain: str = "tvg30"
    """Gain of the images, see `insonify.processing.gain`; for spreading and absorption."""
    span: tuple[Level, Level] | None = None
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
    def _check_span(self) -> Self:
        if self.span is not None and not self.span[1] - self.span[0] >= LEAST_SPAN_DB:
            raise field_error("span", f"{self.span[0]:g} to {self.span[1]:g} dB", "is no range of levels. Write the "
                              f"darkest grey first, and white {LEAST_SPAN_DB:g} dB above it or more.")  # fmt: skip
        return self

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

    count: Annotated[int, Field(ge=0, le=MAX_THINGS)] | Draw
    """Number in an image."""
    target: dict[str, Any]
    """Keys of a target, without its position; each value fixed, or a distribution."""
    length: Draw | None = None
    """Length of a shape of the library, whose width and height stay in proportion [m]; None: as the target has it."""
    position: Annotated[SwathArea, BeforeValidator(swath_area)] = SwathArea()
    """Area over which they are spread uniformly."""

    @property
    def label(self) -> str:
        """Label of each thing, before its number."""
        return (
            typed_label({key: value for key, value in self.target.items() if key not in self._drawn_keys}) or "clutter"
        )

    @property
    def shapes(self) -> list[str]:
        """Names of the shapes that a thing can have, in the order of a distribution."""
        drawn = self.draws.get("name") or self.draws.get("shape")
        return [str(value) for value in drawn.extremes] if drawn is not None else [self.preset]

    @property
    def draws(self) -> dict[str, Draw]:
        """Distributions among the keys of the target."""
        return {key: Draw.model_validate(value) for key, value in self._drawn_keys.items()}

    @property
    def _drawn_keys(self) -> dict[str, dict[str, Any]]:
        """Keys of the target that have a distribution, as it was typed."""
        known = set(Draw.model_fields)
        return {
            key: value
            for key, value in self.target.items()
            if isinstance(value, dict) and value and set(value) <= known
        }

    @model_validator(mode="after")
    def _check_draws(self) -> Self:
        if isinstance(self.count, Draw) and (problem := _no_count(self.count)):
            raise field_error(f"count.{self.count.name}", None, f"{problem}. Write poisson, or integers or a choice of "
                              f"0 to {MAX_THINGS}.")  # fmt: skip
        if self.length is not None and (problem := _no_length(self.length)):
            raise field_error(f"length.{self.length.name}", None, f"{problem}. Write power_law, weibull, or limits "
                              "above 0.")  # fmt: skip
        if "position" in self.target:
            raise field_error("target.position", None, "is drawn. Leave it out, or write position: {area: swath} "
                              "as a key of the clutter.")  # fmt: skip
        for key, value in self._drawn_keys.items():
            try:
                draw = Draw.model_validate(value)
            except ValidationError as fault:
                raise _of_target(key, fault) from None
            if draw.uniform_in is not None:
                raise field_error(f"target.{key}", None, "uniform_in draws a position, and this key is none.")
        return self

    @model_validator(mode="after")
    def _check_length(self) -> Self:
        if self.length is not None and self.preset not in PRESETS:
            raise field_error("length", None, f"is for shapes of the library ({', '.join(PRESETS)}). Give the target's "
                              "own sizes.")  # fmt: skip
        return self

    @property
    def preset(self) -> str:
        """Name of the shape, of one of the library its name there; empty where it is drawn."""
        return typed_shape({key: value for key, value in self.target.items() if key not in self._drawn_keys})


def typed_shape(target: Mapping[str, Any]) -> str:
    """Name of the shape of a target as a file has it, of one of the library its name there; empty for none."""
    shape = str(target.get("shape", ""))
    return str(target.get("name", "")) if shape == "library" else shape


def typed_label(target: Mapping[str, Any]) -> str:
    """Label of a target as a file has it: without one, the name of its shape."""
    return str(target.get("label", "")) or typed_shape(target)


def _of_target(key: str, fault: ValidationError) -> PydanticCustomError:
    """Errors of a distribution of a key of the target."""
    errors = list[PydanticCustomError]()
    for one in fault.errors():
        for path, shown in (one.get("ctx") or {}).get("errors") or [("", one["msg"].removeprefix("Value error, "))]:
            steps = ["target", key, *map(str, one["loc"]), *filter(None, [path])]
            errors.append(field_error(".".join(steps), None, shown))
    return field_errors(errors)


def _no_count(draw: Draw) -> str:
    """Problem of a distribution of a number of things; empty where it has none."""
    if draw.poisson is not None:
        return ""
    if draw.integers is None and draw.choice is None:
        return "draws no whole numbers"
    bad = [
        value for value in draw.extremes
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MAX_THINGS
    ]  # fmt: skip
    return f"{bad[0]} is no number of things (0 to {MAX_THINGS})" if bad else ""


def _no_length(draw: Draw) -> str:
    """Problem of a distribution of lengths; empty where it has none."""
    if draw.uniform_in is not None:
        return "draws a position"
    if draw.poisson is not None or (draw.normal is not None and draw.normal.within is None):
        return "has lengths of 0 or less"
    for value in draw.extremes:
        try:
            is_length = not isinstance(value, bool) and in_si(value) > 0
        except (TypeError, ValueError):
            is_length = False
        if not is_length and not (draw.weibull is not None and in_si(value) == 0):
            return f"{value} is no length"
    return ""


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
        if not self.write:
            raise field_error("write", None, f"names no format. Write one of {', '.join(get_args(Format))}.")
        for name, given in (("write", self.write), ("pairs", self.pairs)):
            if twice := [one for one in given if given.count(one) > 1]:
                raise field_error(name, twice[0], "is there twice. Leave one out.")
        if "geotiff" in self.write and self.dataset.projection != "mosaic":
            raise field_error("write", "geotiff", f"has a position on Earth, and {self.dataset.projection} range has "
                              "none. Write projection: mosaic, or leave geotiff out.")  # fmt: skip
        return self
