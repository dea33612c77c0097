"""Seabed with the scour pits of the targets that lie on it."""

from collections.abc import Iterable

from insonify.scene.seabed import Seabed
from insonify.scene.solid import footprint
from insonify.scene.target import Cone, PointTarget, Solid, Sphere, Target, TruncatedCone
from insonify.scene.terrain.scour import Scour

ROUND = (Sphere, Cone, TruncatedCone)
"""Shapes whose footprint is a disc if they are upright."""


def with_scour_pits(seabed: Seabed, targets: Iterable[Target]) -> Seabed:
    """A seabed with the scour pits of targets added to its relief.

    Args:
        seabed: The seabed; scour pits that it has already are not added again.
        targets: Targets on or in the seabed.
    """
    scours = [_scour(target) for target in targets if not isinstance(target, PointTarget) and target.scour is not None]
    new = [scour for scour in dict.fromkeys(scours) if scour not in seabed.relief]
    return seabed.unchecked_copy(relief=(*seabed.relief, *new)) if new else seabed


def _scour(target: Solid) -> Scour:
    length, width, middle = footprint(target)
    pit = target.scour
    assert pit is not None  # called only then
    corner = min(length, width) / 2 if isinstance(target, ROUND) else 0.0
    return Scour(depth=pit.depth, width=pit.width, position=middle, size=(length, width), corner=corner,
                 heading=target.heading)  # fmt: skip
