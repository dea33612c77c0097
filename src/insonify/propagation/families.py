"""Path families: which boundaries a leg meets on its way from the sonar, in order.

D is direct, S bounced once off the surface, B once off the bottom, SB off the surface and then the
bottom, and so on (the paper's a, b, c, d, e are D, S, B, SB, BS). Between two flat boundaries the
letters of a family must alternate.
"""

from itertools import pairwise

from insonify.scene.scatterers import Boundary

DIRECT = "D"
_OWN_LETTER = {"seabed": "B", "surface": "S", "target": "", "water": ""}


def families_up_to(order: int) -> tuple[str, ...]:
    """All families with at most `order` bounces: D, S, B, SB, BS, SBS, BSB, ..."""
    names = [DIRECT]
    for bounces in range(1, order + 1):
        names += [("SB" * bounces)[:bounces], ("BS" * bounces)[:bounces]]
    return tuple(names)


def is_family(name: str) -> bool:
    """True for D and for strings of S and B that alternate."""
    return name == DIRECT or (name != "" and set(name) <= {"S", "B"} and all(a != b for a, b in pairwise(name)))


def bounce_sequence(family: str) -> str:
    """The boundaries that a family meets, from the sonar outward; empty for the direct path."""
    return "" if family == DIRECT else family


def families_reaching(boundary: Boundary, chosen: tuple[str, ...]) -> tuple[str, ...]:
    """The families that reach a scatterer on a boundary without counting its own answer twice.

    A bounce off the very interface that the scatterer belongs to, right at the scatterer, is already
    part of its scattering law: on the seabed B is D over again, and SB is S.

    Args:
        boundary: What the scatterer lies on.
        chosen: Families that are followed.

    Returns:
        The families kept, in the order given.
    """
    own = _OWN_LETTER[boundary]
    return tuple(name for name in chosen if own == "" or not name.endswith(own))


def image_depth(family: str, source_depth: float, water_depth: float) -> float:
    """Depth of the image source from which all legs of a family run straight [m].

    Args:
        family: Name of the family.
        source_depth: Depth of the sonar [m].
        water_depth: Depth of the bottom [m].
    """
    depth = source_depth
    for letter in bounce_sequence(family):
        depth = -depth if letter == "S" else 2 * water_depth - depth
    return depth
