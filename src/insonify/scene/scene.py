"""The scene: water between seabed and surface, with targets in it."""

from collections.abc import Iterator
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator
from pydantic_core import PydanticCustomError

from insonify.noun import Noun, located, refuse
from insonify.ocean.water import Water
from insonify.scattering.point import PointEcho
from insonify.scene.box import box_body, inside_box
from insonify.scene.scatterers import Scatterers, target_place
from insonify.scene.seabed import Seabed
from insonify.scene.surface import Surface
from insonify.scene.target import Box, PointTarget, Target

RESERVED = ("seabed", "surface", "target", "noise", "total")
_ROUNDING = 1e-9  # what is left when a depth is summed up [m]
_WHOLE = 7  # stands in a target's keys where a face would


class Scene(Noun):
    """What the sound can meet."""

    water: Water = Water()
    seabed: Seabed = Seabed()
    surface: Surface = Surface()
    targets: tuple[Target, ...] = ()

    @model_validator(mode="after")
    def _targets_fit(self) -> Self:
        refuse(scene_faults(self.seabed, self.targets))
        return self

    @property
    def boxes(self) -> tuple[Box, ...]:
        """The targets that cast shadows, in the order of `bodies`."""
        return tuple(target for target in self.targets if isinstance(target, Box))

    @property
    def bodies(self) -> NDArray[np.float64]:
        """Occluding bodies as numbers for kernels, shape (boxes, 8), see `box_body`."""
        return np.array([box_body(box, self.seabed.depth) for box in self.boxes]).reshape(-1, 8)

    @property
    def body_depths(self) -> tuple[float, float]:
        """Depths of the highest top and of the deepest base of all bodies [m]; those of the seabed without any."""
        top, base = self.bodies[:, 6:8].T
        bed = self.seabed.depth
        return float(top.min(initial=bed)), min(float(base.max(initial=0.0)), bed) if len(base) else bed


def scene_faults(seabed: Seabed, targets: tuple[Target, ...]) -> Iterator[PydanticCustomError]:
    """Everything that keeps targets from standing in the water, each with a label of its own.

    Args:
        seabed: The seabed that they lie on, or above.
        targets: The targets; paths of the faults begin with `targets`.

    Yields:
        Errors of `located`, each at the guilty value, with its limit and the way out.
    """
    for row, target in enumerate(targets):
        if target.label in RESERVED or any(other.label == target.label for other in targets[:row]):
            yield located(f"targets.{row}.label", repr(target.label), "is taken. Give each target a label of its own.")
        if isinstance(target, Box):
            yield from _box_faults(f"targets.{row}", target, seabed.depth)
        else:
            yield from _point_faults(f"targets.{row}", target, seabed.depth, targets)


def _box_faults(path: str, box: Box, seabed_depth: float) -> Iterator[PydanticCustomError]:
    body = box_body(box, seabed_depth)
    top, base = float(body[6]), float(body[7])
    if not 0 < base <= seabed_depth + _ROUNDING:
        yield _out_of_the_water(f"{path}.base_depth", base, seabed_depth)
    elif top <= 0:
        yield located(
            f"{path}.size.2", f"{box.size[2]:g} m", f"high on a base at {base:g} m puts the top at or above the sea "
            f"surface (0 m). Write a height under {base:g} m"
            + (", or a deeper base." if base < seabed_depth else "."),
        )  # fmt: skip


def _point_faults(
    path: str, point: PointTarget, seabed_depth: float, targets: tuple[Target, ...]
) -> Iterator[PydanticCustomError]:
    depth = point.position[2]
    if not 0 < depth <= seabed_depth + _ROUNDING:
        yield _out_of_the_water(f"{path}.position.2", depth, seabed_depth)
    # on a face it is still heard; a face that stands on the bed is no way in
    margin = np.array([0, 0, 0, 0, -_ROUNDING, -_ROUNDING, _ROUNDING, 0])
    for box in targets:
        if isinstance(box, Box) and inside_box(box_body(box, seabed_depth) + margin, np.array(point.position)):
            yield located(
                f"{path}.position", None, f"the point is inside {box.label}, where no sound reaches it. "
                f"Move it out, or leave {box.label} out.",
            )  # fmt: skip


def _out_of_the_water(path: str, depth: float, seabed_depth: float) -> PydanticCustomError:
    where = f"below the seabed (depth {seabed_depth:g} m)" if depth > 0 else "at or above the sea surface (0 m)"
    way_out = f"write a depth above 0 m and up to {seabed_depth:g} m."
    return located(path, f"{depth:g} m", f"is {where}. Depths are positive downwards; {way_out}")


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
