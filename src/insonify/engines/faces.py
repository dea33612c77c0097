"""The smooth faces of targets as facets, split until wavefronts, beams and pulses are flat on each.

A facet answers in closed form for the directions at its middle. So it must be small enough that the wavefronts there
and back, which are round, stay within a fraction of a radian of a plane (near the sonar that is small, far away large);
small beside the beam; and shallow along every way beside the pulse, for all of it is heard at one delay.
"""

import warnings

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import image_depth
from insonify.scattering.kirchhoff_facet import SmoothFace
from insonify.scene.scatterers import Scatterers, whole_target
from insonify.scene.scene import Scene
from insonify.scene.smooth_faces import above_ground, smooth_triangles
from insonify.scene.target import Solid
from insonify.sonar.footprint import two_way_width
from insonify.sonar.stance import Stance
from insonify.validity import PhysicsWarning

Floats = NDArray[np.float64]

BEND = 0.03
"""Most by which wavefronts may leave the plane of a facet's middle, out and back together [rad]."""
CORNER = 0.6
"""A corner lies no farther from the middle of a triangle than this part of its longest side [1]."""
BEAM_CELLS = 3.0
"""Facets across the width of the beam [1]."""
PULSE_CELLS = 3.0
"""Facets along a resolution cell of slant range [1]."""
ASIDE = 0.2
"""Sine by which a face may look away from a straight way and still be asked, where rays bend or waves tilt them [1]."""
MOST_FACETS = 300_000
"""Facets of one target [1]."""


def smooth_facets(scene: Scene, solid: Solid, families: tuple[str, ...], stance: Stance, slant: float) -> Scatterers:
    """The smooth faces of a target that may be seen from the sonar, facet by facet.

    Args:
        scene: The scene.
        solid: One of its targets, with smooth faces.
        families: Families of the legs.
        stance: The sonar at this ping.
        slant: What it resolves along the slant range [m].
    """
    images = [
        np.array([[*place[:2], image_depth(name, place[2], scene.seabed.depth)] for name in families])
        for place in (stance.transmit_place, stance.receive_place)
    ]
    slowest = float(np.min(scene.water.speed_at(np.linspace(*scene.body_depths, 9))))
    wavelength = slowest / stance.frequency
    corners = smooth_triangles(solid, scene.seabed, wavelength)
    aside = ASIDE if scene.water.layered or scene.surface.bounce != "mirror" else 0.0
    corners = corners[np.logical_and(*(_facing(corners, places, aside) for places in images))]
    width = two_way_width(stance.transmit_beams, stance.receive_beams)
    corners, whole = split(corners, images, wavelength, width / BEAM_CELLS, slant / PULSE_CELLS)
    if not whole:
        warnings.warn(
            f"target {solid.label}: its smooth faces would be split into more than {MOST_FACETS} facets, and are left "
            "coarser; their echo is not exact. Give a smaller target, a longer pulse, or leave smooth out.",
            PhysicsWarning, stacklevel=2,
        )  # fmt: skip
    corners = above_ground(corners, scene.seabed)
    middle = corners.mean(axis=1)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.maximum(np.linalg.norm(across, axis=1), 1e-300)
    count = len(corners)
    assert solid.smooth is not None
    return Scatterers(
        owner=solid.label, boundary="target", law=SmoothFace(solid.smooth), position=middle,
        normal=across / twice[:, None], area=twice / 2, phase=np.ones(count, complex),
        place=whole_target(solid.label, count), drawn=False, occluder=scene.occluders.index(solid),
        corners=corners - middle[:, None],
    )  # fmt: skip


def split(corners: Floats, images: list[Floats], wavelength: float, beam: float, depth: float) -> tuple[Floats, bool]:
    """Triangles halved across a side until they are small enough, side by side.

    Args:
        corners: Of the triangles [m], shape (t, 3, 3).
        images: Places from which the two ends of the sonar look at them, straight on [m], shapes (f, 3).
        wavelength: Of the sound [m].
        beam: Angle that a triangle may fill [rad].
        depth: How far a triangle may reach along any way [m].

    Returns:
        Triangles of the same surface, and whether all are small enough.
    """
    done = []
    held = 0
    while len(corners):
        sides = np.roll(corners, -1, axis=1) - corners
        size = _size(corners, sides, images, wavelength, beam, depth)
        longest = size.argmax(axis=1)
        large = size.max(axis=1) > 1
        done.append(corners[~large])
        held += len(done[-1])
        corners, longest = corners[large], longest[large]
        if held + 2 * len(corners) > MOST_FACETS:
            return np.concatenate([*done, corners]), False
        order = (longest[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(corners, order[:, :, None], axis=1), 1, 0)
        middle = (a + b) / 2
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate(done) if done else corners, True


def _size(corners: Floats, sides: Floats, images: list[Floats], wavelength: float, beam: float, depth: float) -> Floats:
    """Sides of triangles as parts of what they may be [1], shape (t, 3)."""
    middle = corners.mean(axis=1)
    nearness = np.zeros(len(middle))
    along = np.zeros(sides.shape[:2])
    nearest = np.full(len(middle), np.inf)
    for places in images:
        closest = np.full(len(middle), np.inf)
        for place in places:
            ray = middle - place
            length = np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
            along = np.maximum(along, np.abs(np.einsum("tsk,tk->ts", sides, ray / length[:, None])))
            closest = np.minimum(closest, length)
        nearness += 1 / closest
        nearest = np.minimum(nearest, closest)
    # the path to a corner is longer by half the square of its distance over the way's length
    flat = np.sqrt(BEND * wavelength / (np.pi * CORNER**2 * nearness))
    length = np.linalg.norm(sides, axis=2)
    return np.maximum(length / np.minimum(flat, beam * nearest)[:, None], along / depth)


def _facing(corners: Floats, places: Floats, aside: float) -> NDArray[np.bool_]:
    """Which triangles look at any of some places, or away by a sine of no more than `aside`, shape (t,)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    seen = np.zeros(len(corners), bool)
    for place in places:
        ray = place - corners.mean(axis=1)
        seen |= np.einsum("tk,tk->t", ray, normal) > -aside * np.linalg.norm(ray, axis=1)
    return seen
