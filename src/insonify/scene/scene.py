"""The scene: water between seabed and surface, with targets in it."""

from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator
from pydantic_core import PydanticCustomError

from insonify.model import Model, field_error, raise_errors
from insonify.ocean.water import Water
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.box import box_body, inside_box
from insonify.scene.scatterers import BOUNDARY_ECHO, Scatterers, whole_target_id
from insonify.scene.scour_pits import with_scour_pits
from insonify.scene.seabed import Seabed
from insonify.scene.solid import complete_triangles, inside_solid, seabed_depth_at, solid_errors, world_triangles
from insonify.scene.surface import Surface
from insonify.scene.target import Box, PointTarget, Solid, Target, is_solid, solids_of_one_law

RESERVED = ("seabed", "surface", "target", "water", BOUNDARY_ECHO, "noise", "total")
"""Names that no target may have as its label."""
_ROUNDING = 1e-9  # rounding of sums of depths [m]


class Scene(Model):
    """Water, seabed, surface and targets.

    Example:
        >>> crate, buoy = Box(position=(10, 40), size=(2, 1, 0.5)), PointTarget(position=(10, 30, 15))
        >>> scene = Scene(seabed=Seabed(depth="20 m"), targets=[crate, buoy])
        >>> scene.seabed_depth_under(crate), [body.label for body in scene.occluders]
        (20.0, ['box'])
    """

    water: Water = Water()
    seabed: Seabed = Seabed()
    surface: Surface = Surface()
    targets: tuple[Target, ...] = ()

    @model_validator(mode="after")
    def _check_targets(self) -> Self:
        self.__dict__["seabed"] = with_scour_pits(self.seabed, self.targets)  # frozen from here on
        raise_errors(scene_errors(self.seabed, self.targets))
        return self

    def is_rough(self, families: Iterable[str]) -> bool:
        """Return True if a boundary that reflects some of the families is rough: neither flat nor smooth relief."""
        letters = "S" * (self.surface.reflection != "flat") + "B" * (self.seabed.reflecting_interface != "smooth")
        return any(letter in name for name in families for letter in letters)

    @property
    def boxes(self) -> tuple[Box, ...]:
        """The upright boxes, in the order of `bodies`."""
        return _boxes_and_solids(self)[0]

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The targets that are made of triangles: all but points and upright boxes."""
        return _boxes_and_solids(self)[1]

    @property
    def occluders(self) -> tuple[Solid, ...]:
        """The targets that cast shadows, in the order of their rows in `Legs.occluder`: boxes, then solids."""
        return (*self.boxes, *self.solids)

    @property
    def solids_of_one_law(self) -> tuple[Solid, ...]:
        """The occluders in the same order, each part of a mesh by itself."""
        return tuple(faces for solid in self.occluders for faces in solids_of_one_law(solid))

    @property
    def bodies(self) -> NDArray[np.float64]:
        """Occluding bodies as numbers for kernels, shape (boxes, 8), see `box_body`."""
        return np.array([box_body(box, self.seabed_depth_under(box)) for box in self.boxes]).reshape(-1, 8)

    def seabed_depth_under(self, target: Solid) -> float:
        """Depth of the seabed under the middle of a target [m]."""
        return seabed_depth_under(target, self.seabed)

    @property
    def body_depths(self) -> tuple[float, float]:
        """Depths of the highest top and of the deepest base of all bodies in the water [m]; without any, of the seabed.

        If the water scatters, the least depth is 0 and the greatest that of the seabed.
        """
        seabed = self.seabed
        shallowest, deepest = (seabed.depth,) * 2 if seabed.terrain is None else seabed.terrain.span
        if self.water.scatters:
            return 0.0, deepest
        surfaces = [world_triangles(solid, seabed) for solid in self.solids]
        tops = [*self.bodies[:, 6], *(float(surface.low[2]) for surface in surfaces)]
        bases = [*self.bodies[:, 7], *(float(surface.high[2]) for surface in surfaces)]
        if not tops:
            return max(shallowest, 0.0), deepest
        return max(float(min(tops)), 0.0), min(float(max(bases)), deepest)


@lru_cache(maxsize=16)
def _boxes_and_solids(scene: Scene) -> tuple[tuple[Box, ...], tuple[Solid, ...]]:
    """Upright boxes, and all other targets that are made of triangles, of one scene."""
    boxes = tuple(target for target in scene.targets if isinstance(target, Box) and target.is_upright)
    return boxes, tuple(target for target in scene.targets if is_solid(target))


@lru_cache(maxsize=8)
def open_scene(scene: Scene) -> Scene:
    """The scene without targets and relief."""
    return scene.unchecked_copy(targets=(), seabed=scene.seabed.unchecked_copy(relief=()))


def scene_errors(seabed: Seabed, targets: tuple[Target, ...]) -> Iterator[PydanticCustomError]:
    """Errors in the positions and labels of targets: each must be in the water and have a unique label.

    Args:
        seabed: The seabed that they lie on, or above.
        targets: The targets; paths of the faults begin with `targets`.

    Yields:
        Errors of `field_error`, each at the faulty value, with its limit and the fix.
    """
    for row, target in enumerate(targets):
        if target.label in RESERVED or any(other.label == target.label for other in targets[:row]):
            yield field_error(
                f"targets.{row}.label", repr(target.label), "is taken. Give each target a label of its own."
            )
        if np.isnan(seabed_depth_at(seabed, np.array(target.position[:2]))):
            yield field_error(f"targets.{row}.position", None, "the terrain is unknown there. Move the target.")
        elif isinstance(target, PointTarget):
            yield from _point_errors(f"targets.{row}", target, seabed, targets)
        elif isinstance(target, Box) and target.is_upright:
            yield from _box_errors(f"targets.{row}", target, seabed_depth_under(target, seabed))
        else:
            yield from solid_errors(f"targets.{row}", target, seabed)


def _box_errors(path: str, box: Box, seabed_depth: float) -> Iterator[PydanticCustomError]:
    base = float(box_body(box, seabed_depth)[7])
    if not 0 < base <= seabed_depth + _ROUNDING:
        yield _out_of_water_errors(f"{path}.base_depth", base, seabed_depth)


def _point_errors(
    path: str, point: PointTarget, seabed: Seabed, targets: tuple[Target, ...]
) -> Iterator[PydanticCustomError]:
    depth, bottom = point.position[2], float(seabed_depth_at(seabed, np.array(point.position[:2])))
    if not 0 < depth <= bottom + _ROUNDING:
        yield _out_of_water_errors(f"{path}.position.2", depth, bottom)
    for body in targets:
        if isinstance(body, PointTarget):
            continue
        # on a face its echo is still received
        if inside_body(body, seabed, np.array([point.position]), touching=False)[0]:
            yield field_error(
                f"{path}.position", None, f"the point is inside {body.label}, where no sound reaches it. "
                f"Move it out, or leave {body.label} out.",
            )  # fmt: skip


@lru_cache(maxsize=1024)
def seabed_depth_under(target: Solid, seabed: Seabed) -> float:
    """Depth of the seabed under the middle of a target [m]."""
    return float(seabed_depth_at(seabed, np.array(target.position)))


def inside_body(
    body: Solid, seabed: Seabed, position: NDArray[np.float64], *, touching: bool = True
) -> NDArray[np.bool_]:
    """Mask of positions inside a target, shape (n,).

    Args:
        body: Any target but a point.
        seabed: Seabed that it lies on.
        position: North, east, depth [m], shape (n, 3).
        touching: True if a position on top or under the base of an upright box counts as inside.
    """
    if is_solid(body):
        return inside_solid(complete_triangles(body, seabed), position)
    assert isinstance(body, Box)
    margin = 0.0 if touching else _ROUNDING
    # a face on the seabed is no face in the water
    box = box_body(body, seabed_depth_under(body, seabed)) + np.array([0, 0, 0, 0, -margin, -margin, margin, 0])
    is_inside = np.hypot(*(position[:, :2] - box[:2]).T) <= np.hypot(box[4], box[5])
    is_inside[is_inside] = [inside_box(box, row) for row in position[is_inside]]
    return is_inside


def _out_of_water_errors(path: str, depth: float, seabed_depth: float) -> PydanticCustomError:
    where = f"below the seabed (depth {seabed_depth:g} m)" if depth > 0 else "at or above the sea surface (0 m)"
    fix = f"write a depth above 0 m and up to {seabed_depth:g} m."
    return field_error(path, f"{depth:g} m", f"is {where}. Depths are positive downwards; {fix}")


def point_scatterer(target: PointTarget) -> Scatterers:
    """A point target as one isotropic scatterer."""
    return Scatterers(
        object=target.label, boundary="target", law=PointTargetLaw(target.target_strength_db),
        position=np.array([target.position]), normal=np.zeros((1, 3)), area=np.ones(1), phase=np.ones(1, complex),
        scatterer_id=whole_target_id(target.label, 1), has_random_phase=False,
    )  # fmt: skip
