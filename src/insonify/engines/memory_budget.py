"""Number of points whose legs and pairs are held at once, by which the memory of a ping is bounded in any scene."""

from insonify.propagation.explicit_surface import MAX_BOUNCE_POINTS
from insonify.propagation.families import bounce_sequence, families_reaching, surface_bounces
from insonify.propagation.glints import FIXED_PHASE_GLINTS, RANDOM_PHASE_GLINTS
from insonify.propagation.path_settings import PathSettings
from insonify.scene.scatterers import Boundary, Scatterers
from insonify.scene.scene import Scene

BYTES_AT_ONCE = 256e6
"""Approximate memory for the legs and pairs of one block [bytes]."""
BYTES_PER_LEG, BYTES_PER_PAIR, BYTES_PER_SPECULAR_PAIR = 350, 40, 130
"""Memory for one leg and one ordered pair of legs to one point, drawn or smooth [bytes]."""
BOUNCES = 3
"""Approximate mean number of bounce points of one leg that explicit waves reflect [1]."""
MIN_POINTS = 16
"""Least number of points that are held."""


def legs_per_point(
    scene: Scene, path_settings: PathSettings, boundary: Boundary, *, drawn: bool, further: int = 0
) -> int:
    """Number of legs between one end and one point: one for each family, and more for reflections at rough boundaries.

    A moving surface and a rough seabed add glints; explicit waves have several bounce points, each with its own glints.
    A hull and smooth faces add legs.

    Args:
        scene: The scene.
        path_settings: Path settings.
        boundary: Boundary that the point lies on.
        drawn: True for a random scatterer; False for point targets and smooth faces, which have more glints.
        further: Number of legs reflected by a hull, and by faces that reflect sound to the point.
    """
    kept = families_reaching(boundary, path_settings.followed_families)
    if scene.surface.reflection == "explicit":
        moving = sum(surface_bounces(name) > 0 for name in kept)
        glints = RANDOM_PHASE_GLINTS * (scene.surface.wind_speed is not None)
        return len(kept) + moving * (BOUNCES * (1 + glints) - 1) + further
    rough = "S" * (scene.surface.reflection == "statistical") + "B" * (scene.seabed.reflecting_interface == "rough")
    random = sum(bool(set(rough) & set(bounce_sequence(name))) for name in kept)
    return len(kept) + random * (RANDOM_PHASE_GLINTS if drawn else FIXED_PHASE_GLINTS) + further


def bytes_per_point(
    scene: Scene, path_settings: PathSettings, boundary: Boundary, *, drawn: bool, further: int = 0
) -> float:
    """Memory for the legs and pairs of one point [bytes]; arguments are those of `legs_per_point`."""
    return _bytes_of_legs(legs_per_point(scene, path_settings, boundary, drawn=drawn, further=further), drawn)


def points_at_once(scene: Scene, path_settings: PathSettings, scatterers: Scatterers, further: int = 0) -> int:
    """Number of points of a block whose legs are evaluated at once.

    With explicit waves the number of legs is not yet known: a third of the budget then holds the largest number.

    Args:
        scene: The scene.
        path_settings: Path settings.
        scatterers: The block.
        further: Number of further legs to each point, reflected by a hull and by faces.
    """
    drawn, most = scatterers.has_random_phase, 0
    if scene.surface.reflection == "explicit":
        kept = families_reaching(scatterers.boundary, path_settings.followed_families)
        moving = sum(surface_bounces(name) > 0 for name in kept)
        glints = 0 if scene.surface.wind_speed is None else RANDOM_PHASE_GLINTS if drawn else FIXED_PHASE_GLINTS
        most = len(kept) + moving * MAX_BOUNCE_POINTS * (1 + glints) + further
    count = points_of_legs(
        legs_per_point(scene, path_settings, scatterers.boundary, drawn=drawn, further=further), drawn=drawn
    )
    return max(min(count, int(_budget(drawn) / 3 / max(most * BYTES_PER_LEG, 1.0))), MIN_POINTS)


def points_of_legs(legs: int, *, drawn: bool) -> int:
    """Number of points whose pairs are evaluated at once.

    Args:
        legs: Number of legs between one end and one point.
        drawn: See `legs_per_point`.
    """
    return max(int(_budget(drawn) / max(_bytes_of_legs(legs, drawn), 1.0)), MIN_POINTS)


def _bytes_of_legs(legs: int, drawn: bool) -> float:
    """Memory of the legs and pairs of one point [bytes], by its number of legs."""
    return legs * BYTES_PER_LEG + legs**2 * (BYTES_PER_PAIR if drawn else BYTES_PER_SPECULAR_PAIR)


def _budget(drawn: bool) -> float:
    """Memory budget of one block: half of `BYTES_AT_ONCE` for point targets and smooth faces [bytes]."""
    return BYTES_AT_ONCE if drawn else BYTES_AT_ONCE / 2
