"""Library of target shapes: typical objects on a seabed, as generic bodies of their usual size.

No shape models one product: each has the outline and the usual size of its kind.
Sources of the sizes stand beside them; one marked "not verified" has not been checked against a document.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, get_args

import numpy as np

from insonify import random_keys
from insonify.scene.triangle_surfaces import (
    Triangles,
    block,
    cylinder,
    frustum,
    merged_surfaces,
    sphere,
    surface_of_revolution,
    torus,
    tube,
    wedge,
    with_axis_up,
)

Preset = Literal["manta", "cylinder_mine", "rockan", "drum", "rock", "tyre", "anchor", "pipe", "shell", "bomb", "wreck"]
PRESETS: tuple[str, ...] = get_args(Preset)
"""Names of the library's shapes."""

ROCK_WAVES = 24
"""Number of waves in the surface of a rock [1]."""


@dataclass(frozen=True)
class LibraryShape:
    """One entry of the library."""

    description: str
    """Description in one line."""
    source: str
    """Source of its size."""
    make: Callable[[int], Triangles]
    """Function from a variant to the surface [m] in its own axes; rocks differ, other shapes are the same."""


@lru_cache(maxsize=1024)
def preset_triangles(name: str, variant: int = 0) -> Triangles:
    """Surface of one of the library's shapes [m] in its own axes (forward, starboard, down).

    The origin is the middle of its bounding box.

    Args:
        name: One of `PRESETS`.
        variant: Number of the rock; ignored by other shapes.
    """
    return LIBRARY[name].make(variant).centred()


def _rock(variant: int) -> Triangles:
    """An ellipsoid with bumps, and half axes that vary by 15 %.

    The bumps are a sum of plane waves of random directions, evaluated on a sphere of radius 1, whose amplitudes fall as
    1 / wavenumber.
    """
    ball = sphere(2.0)
    n = np.arange(ROCK_WAVES)
    u = random_keys.uniforms(variant, random_keys.TARGET, n, 0, _ROCK)
    vertical, azimuth = 2 * u[:, 0] - 1, 2 * np.pi * u[:, 1]
    horizontal = np.sqrt(1 - vertical**2)
    direction = np.stack([horizontal * np.cos(azimuth), horizontal * np.sin(azimuth), vertical], axis=-1)
    wavenumber = 1.5 + 6.0 * n / ROCK_WAVES
    phase = ball.vertices @ direction.T * wavenumber + 2 * np.pi * u[:, 2]
    bump = (0.11 / wavenumber * np.cos(phase)).sum(axis=1)
    radii = np.array([0.5, 0.4, 0.3]) * (
        0.85 + 0.3 * random_keys.uniforms(variant, random_keys.TARGET, 0, 1, _ROCK)[:3]
    )
    return Triangles(ball.vertices * (1 + bump)[:, None] * radii, ball.faces)


_ROCK = 5
"""Third counter of the random numbers of a rock; boxes and solids have the number of a face there."""


def _shell(_: int) -> Triangles:
    """Boat tail, straight body and parabolic nose of an artillery shell."""
    nose = [(0.27 + 0.33 * s, 0.0775 * (1 - s**2)) for s in np.linspace(0, 0.9, 10)]
    return surface_of_revolution([(0.0, 0.0), (0.0, 0.066), (0.06, 0.0775), *nose, (0.6, 0.0)])


def _bomb(_: int) -> Triangles:
    """Tapered tail, straight body and parabolic nose of an aircraft bomb; two crossed plates are its four fins."""
    nose = [(1.0 + 0.6 * s, 0.1365 * (1 - s**2)) for s in np.linspace(0, 0.9, 10)]
    body = surface_of_revolution([(0.0, 0.0), (0.0, 0.09), (0.55, 0.1365), *nose, (1.6, 0.0)])
    fins = [block(0.45, 0.38, 0.008), block(0.45, 0.008, 0.38)]
    return merged_surfaces([body, *(fin.transformed(np.eye(3), np.array([-0.05, 0, 0])) for fin in fins)])


def _anchor(_: int) -> Triangles:
    """Shank, crown and two flukes of a stockless anchor, lying on its side."""
    shank, crown = block(1.3, 0.16, 0.16), block(0.3, 0.85, 0.3)
    fluke = wedge(0.75, top_length=0.45, width=0.12, height=0.25)
    positions = [(0.65, 0, 0), (0, 0, 0), (0.4, 0.32, 0), (0.4, -0.32, 0)]
    parts = zip([shank, crown, fluke, fluke], positions, strict=True)
    return merged_surfaces([part.transformed(np.eye(3), np.array(position, float)) for part, position in parts])


def _wreck(_: int) -> Triangles:
    """A hull with a deckhouse and a mast, as three blocks."""
    parts = [(block(60, 10, 6), (0, 0, -3.0)), (block(10, 8, 4), (-18, 0, -8.0)), (block(0.4, 0.4, 10), (10, 0, -11.0))]
    return merged_surfaces([part.transformed(np.eye(3), np.array(position, float)) for part, position in parts])


LIBRARY: dict[str, LibraryShape] = {
    "manta": LibraryShape(
        "a squat mine on the seabed, a truncated cone: diameter 0.98 m at the base, 0.5 m at the top, 0.47 m high",
        "typical of its kind, not verified",
        lambda _: with_axis_up(frustum(0.47, 0.98, 0.5)),
    ),
    "cylinder_mine": LibraryShape(
        "a cylindrical mine: 2 m long, 0.6 m in diameter",
        "the Mk 25 found in the Kanmon Straits was 2 m by 0.6 m (press report, August 2013)",
        lambda _: cylinder(2.0, 0.6),
    ),
    "rockan": LibraryShape(
        "a wedge-shaped gliding mine: 1 m long, 0.8 m wide, 0.38 m high",
        "typical of its kind, not verified",
        lambda _: wedge(1.0, top_length=0.25, width=0.8, height=0.38),
    ),
    "drum": LibraryShape(
        "a 208 litre steel drum, lying: 0.851 m by 0.572 m",
        "ANSI drawings of the 55 gallon drum: 33.5 by 22.5 inches, as quoted by encyclopaedias",
        lambda _: cylinder(0.851, 0.572),
    ),
    "rock": LibraryShape(
        "a rough boulder of about 1.0 by 0.8 by 0.6 m; every variant is another one", "generic", _rock
    ),
    "tyre": LibraryShape(
        "a car tyre, lying flat: 0.632 m in diameter, 0.205 m wide, side wall 0.113 m high",
        "the size code 205/55 R16: width, side wall 55 % of it, a rim of 16 inches",
        lambda _: with_axis_up(torus(0.632, 0.113, width=0.205)),
    ),
    "anchor": LibraryShape(
        "a stockless ship's anchor, lying: 1.4 m long", "typical of about 400 kg, not verified", _anchor
    ),
    "pipe": LibraryShape(
        "an open steel pipe: 12 m long, 0.324 m in diameter, wall 10.3 mm",
        "ASME B36.10M, NPS 12 schedule 40: outside 323.8 mm, wall 10.31 mm; not verified",
        lambda _: tube(12.0, 0.3238, 0.01031),
    ),
    "shell": LibraryShape(
        "an artillery shell: 155 mm, 0.6 m long without its fuze",
        "155 mm is its name; the length of the M107 without fuze, not verified",
        _shell,
    ),
    "bomb": LibraryShape(
        "an aircraft bomb of the 250 kg class with fins: 1.9 m long, 0.273 m in diameter",
        "typical of the Mk 82, 273 mm in diameter, not verified",
        _bomb,
    ),
    "wreck": LibraryShape("a small ship as blocks: hull 60 by 10 by 6 m, deckhouse, a mast to 16 m", "generic", _wreck),
}
"""Shape and description of each name."""
