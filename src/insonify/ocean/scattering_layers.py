"""Volume scattering in a scenario: scattering layers by depth, and patches such as a school of fish."""

from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from insonify.model import MAX_DEPTH, Coordinate, Decibels, Depth, Heading, Metres, Model, field_error, raise_errors
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]
Strength = Annotated[Decibels, Field(ge=-150, le=0, json_schema_extra={"units": "dB re 1/m"})]
Row = tuple[Annotated[Metres, Field(ge=0, le=MAX_DEPTH)], Strength | None]
ScenarioLayers = Strength | tuple[Row, ...]
"""One strength for all the water, or rows of a depth and the strength from it down to the next row; None: clear."""


class ScatteringPatch(Model):
    """School of fish, wake or plume: a volume of water with isotropic scattering besides that of the layers."""

    label: Annotated[str, Field(min_length=1)] = "patch"
    """Name of the patch in labels and arrivals."""
    position: tuple[Coordinate, Coordinate, Depth]
    """North and east of its centre [m], and depth [m]."""
    size: tuple[
        Annotated[Metres, Field(gt=0, le=10_000)],
        Annotated[Metres, Field(gt=0, le=10_000)],
        Annotated[Metres, Field(gt=0, le=10_000)],
    ]
    """Full length along its heading, width across it, and height [m]."""
    heading: Heading = 0.0
    """Compass heading of its length [rad]."""
    form: Literal["ellipsoid", "box"] = "ellipsoid"
    """Shape of the patch: ellipsoid or box."""
    volume_strength_db: Strength
    """Volume scattering strength in the patch, added to that of the water around [dB re 1/m]."""


def require_increasing_depths(written: ScenarioLayers | None, path: str) -> None:
    """Refuse layers whose depths do not increase.

    Args:
        written: Layers as in the scenario.
        path: Field of the layers in the scenario.

    Raises:
        PydanticCustomError: Every wrong row, for a validator to raise.
    """
    rows = written if isinstance(written, tuple) else ()
    if isinstance(written, tuple) and not rows:
        raise field_error(
            path, "[]", "has no rows. Give one, such as [0 m, -70], or leave the line out for clear water."
        )
    raise_errors(
        field_error(f"{path}.{n}.0", f"{row[0]:g} m", f"is not below the row above ({above[0]:g} m). Depths must grow.")
        for n, (above, row) in enumerate(pairwise(rows), start=1)
        if row[0] <= above[0]
    )


def layer_columns(written: ScenarioLayers | None, deepest: float) -> Floats:
    """Scattering layers from the surface to the seabed.

    Args:
        written: Layers as in the scenario.
        deepest: Largest depth of the water [m].

    Returns:
        Upper side [m], lower side [m] and volume backscattering coefficient s_v [1/m] of each, shape (layers, 3).
    """
    rows: tuple[Row, ...] = written if isinstance(written, tuple) else ((0.0, written),)
    lower_sides = [row[0] for row in rows[1:]] + [deepest]
    layers = [
        (top, min(lower_side, deepest), float(intensity_ratio(strength)))
        for (top, strength), lower_side in zip(rows, lower_sides, strict=True)
        if strength is not None and top < min(lower_side, deepest)
    ]
    return np.array(layers).reshape(-1, 3)
