"""Points whose legs and pairs are held at once: what bounds the memory of a ping, whatever is in the scene."""

from insonify.propagation.families import bounce_sequence, families_reaching
from insonify.propagation.glints import FEW, SEVERAL
from insonify.propagation.path_settings import PathSettings
from insonify.scene.scatterers import Boundary, Scatterers
from insonify.scene.scene import Scene

BYTES_AT_ONCE = 256e6
"""Memory for the legs and pairs of one block, about [bytes]."""
BYTES_PER_LEG, BYTES_PER_PAIR, BYTES_PER_SPECULAR_PAIR = 350, 40, 130
"""Memory for one leg and one ordered pair of legs to one point, drawn or smooth [bytes]."""
BOUNCES = 3
"""Bounce points of one leg off explicit waves, about [1]."""
MIN_POINTS = 16
"""Points that are held at least."""


def legs_per_point(scene: Scene, choice: PathSettings, boundary: Boundary, *, drawn: bool, further: int = 0) -> int:
    """Number of legs between one end and one point: one for each family; more for those off rough boundaries.

    A moving surface and a rough seabed add glints; explicit waves have several bounce points, each with its own glints.
    A hull and smooth faces add legs.

    Args:
        scene: The scene.
        choice: Paths followed.
        boundary: Boundary that the point lies on.
        drawn: True for a random scatterer; False for point targets and smooth faces, which have more glints.
        further: Legs off a hull and off faces that light the point.
    """
    kept = families_reaching(boundary, choice.followed_families)
    if scene.surface.reflection == "explicit":
        moving = sum("S" in bounce_sequence(name) for name in kept)
        return len(kept) + moving * (BOUNCES * (1 + FEW * (scene.surface.wind_speed is not None)) - 1) + further
    rough = "S" * (scene.surface.reflection == "statistical") + "B" * (scene.seabed.reflecting_interface == "rough")
    random = sum(bool(set(rough) & set(bounce_sequence(name))) for name in kept)
    return len(kept) + random * (FEW if drawn else SEVERAL) + further


def bytes_per_point(scene: Scene, choice: PathSettings, boundary: Boundary, *, drawn: bool, further: int = 0) -> float:
    """Memory that the legs and pairs of one point take [bytes]: arguments see `legs_per_point`."""
    legs = legs_per_point(scene, choice, boundary, drawn=drawn, further=further)
    return legs * BYTES_PER_LEG + legs**2 * (BYTES_PER_PAIR if drawn else BYTES_PER_SPECULAR_PAIR)


def points_at_once(scene: Scene, choice: PathSettings, scatterers: Scatterers, further: int = 0) -> int:
    """Points of a block whose pairs are made at once, with further legs to each off a hull and off faces."""
    each = bytes_per_point(scene, choice, scatterers.boundary, drawn=scatterers.has_random_phase, further=further)
    share = BYTES_AT_ONCE if scatterers.has_random_phase else BYTES_AT_ONCE / 2
    return max(int(share / max(each, 1.0)), MIN_POINTS)
