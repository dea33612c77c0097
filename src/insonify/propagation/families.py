"""Path families: the boundaries at which a leg bounces, in order from the sonar.

D is direct, S has one bounce on the surface, B one on the bottom, SB one on the surface and then one
on the bottom, and so on (the paper's a, b, c, d, e are D, S, B, SB, BS). Between two flat boundaries
the letters of a family must alternate.
"""

from functools import lru_cache
from itertools import pairwise
from typing import Literal, NamedTuple

from insonify.scene.scatterers import Boundary

DIRECT = "D"
Reflector = Literal["surface", "bottom", "hull", "face", ""]
_REFLECTORS: dict[str, Reflector] = {
    "S": "surface", "B": "bottom", "H": "hull", "F": "face", "T": "face", DIRECT: "", "": "",
}  # fmt: skip
_OWN_LETTER = {"seabed": "B", "surface": "S", "target": "", "water": "", "boundary echo": ""}


class Bounces(NamedTuple):
    """Bounces of a leg on surface and bottom in turn."""

    number: int
    """Number of bounces."""
    first_up: bool
    """True if the first is on the surface; False without bounces."""


@lru_cache(maxsize=64)
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
    """Boundaries at which a family bounces, from the sonar outward; empty for the direct path."""
    return "" if family == DIRECT else family


def bounce_count(family: str) -> int:
    """Number of bounces of a family."""
    return len(bounce_sequence(family))


def surface_bounces(family: str) -> int:
    """Number of bounces of a family on the surface."""
    return family.count("S")


def bottom_bounces(family: str) -> int:
    """Number of bounces of a family on the bottom."""
    return family.count("B")


def first_boundary(family: str) -> Reflector:
    """Boundary of a family's first bounce from the sonar; empty for the direct path."""
    return _REFLECTORS[family[:1]]


def last_boundary(family: str) -> Reflector:
    """Boundary of a family's last bounce; empty for the direct path."""
    return _REFLECTORS[family[-1:]]


@lru_cache(maxsize=64)
def family_bounces(family: str) -> Bounces:
    """Number of bounces of a family, and the first boundary."""
    return Bounces(bounce_count(family), first_boundary(family) == "surface")


@lru_cache(maxsize=64)
def families_reaching(boundary: Boundary, chosen: tuple[str, ...]) -> tuple[str, ...]:
    """Families that reach a scatterer on a boundary without counting its scattering twice.

    A reflection by the boundary of the scatterer, right at the scatterer, is already
    part of its scattering law: on the seabed B duplicates D, and SB duplicates S.

    Args:
        boundary: Boundary of the scatterer.
        chosen: Families to select from.

    Returns:
        Selected families, in the order given.
    """
    own = _OWN_LETTER[boundary]
    return tuple(name for name in chosen if own == "" or not name.endswith(own))


def image_depth(family: str, source_depth: float, water_depth: float) -> float:
    """Depth of the image source of all legs of a family [m].

    Args:
        family: Name of the family.
        source_depth: Depth of the sonar [m].
        water_depth: Depth of the bottom [m].
    """
    depth = source_depth
    for letter in bounce_sequence(family):
        depth = -depth if letter == "S" else 2 * water_depth - depth
    return depth
