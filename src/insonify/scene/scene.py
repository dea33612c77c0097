"""The scene: water between seabed and surface, with targets in it."""

from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from insonify.noun import Noun, located
from insonify.ocean.water import Water
from insonify.scattering.point import PointEcho
from insonify.scene.box import box_body
from insonify.scene.scatterers import Scatterers, target_place
from insonify.scene.seabed import Seabed
from insonify.scene.surface import Surface
from insonify.scene.target import Box, PointTarget, Target

RESERVED = ("seabed", "surface", "target", "noise", "total")
_WHOLE = 7  # stands in a target's keys where a face would


class Scene(Noun):
    """What the sound can meet."""

    water: Water = Water()
    seabed: Seabed = Seabed()
    surface: Surface = Surface()
    targets: tuple[Target, ...] = ()

    @model_validator(mode="after")
    def _targets_fit(self) -> Self:
        check_targets(self.seabed, self.targets)
        return self

    @property
    def boxes(self) -> tuple[Box, ...]:
        """The targets that cast shadows, in the order of `bodies`."""
        return tuple(target for target in self.targets if isinstance(target, Box))

    @property
    def bodies(self) -> NDArray[np.float64]:
        """Occluding bodies as numbers for kernels, shape (boxes, 8), see `box_body`."""
        return np.array([box_body(box, self.seabed.depth) for box in self.boxes]).reshape(-1, 8)


def check_targets(seabed: Seabed, targets: tuple[Target, ...]) -> None:
    """Refuse targets that do not stand in the water, or that share a label.

    Raises:
        PydanticCustomError: Located at the guilty value, with the way out.
    """
    for row, target in enumerate(targets):
        if target.label in RESERVED or any(other.label == target.label for other in targets[:row]):
            raise located(f"targets.{row}.label", repr(target.label), "is taken. Give each target a label of its own.")
        top, base, field = _extent(target, seabed.depth)
        if base > seabed.depth + 1e-9:
            raise located(
                f"targets.{row}.{field}", f"{base:g} m", f"is below the seabed (depth {seabed.depth:g} m). "
                f"Depths are positive downwards; write {seabed.depth:g} m or less.",
            )  # fmt: skip
        if top <= 0:
            raise located(
                f"targets.{row}.{'size' if isinstance(target, Box) else field}", f"{top:g} m",
                "for the top of the target is at or above the sea surface (0 m). Depths are positive downwards; "
                "lower the target or make it less high.",
            )  # fmt: skip


def _extent(target: Target, seabed_depth: float) -> tuple[float, float, str]:
    """Depth of top and base [m], and the field that sets the base."""
    if isinstance(target, Box):
        body = box_body(target, seabed_depth)
        return float(body[6]), float(body[7]), "base_depth"
    return target.position[2], target.position[2], "position.2"


def point_scatterer(target: PointTarget) -> Scatterers:
    """A point target as the one scatterer it is, answering alike in all directions."""
    return Scatterers(
        owner=target.label,
        boundary="target",
        law=PointEcho(target.target_strength_db),
        position=np.array([target.position]),
        normal=np.zeros((1, 3)),
        area=np.ones(1),
        phase=np.ones(1, complex),
        place=target_place(target.label, _WHOLE, np.zeros(1, int), np.zeros(1, int)),
        drawn=False,
    )
