"""A target as one ping sees it: images of the sonar, beams, window, and how finely its faces must be split."""

import numpy as np
from numpy.typing import NDArray

from insonify.engines.patches import Lobe, Sight
from insonify.propagation.choice import PathChoice
from insonify.propagation.families import bounces, families_for, image_depth
from insonify.propagation.images import StraightRays
from insonify.propagation.rays import Rays
from insonify.scene.scene import Scene
from insonify.sonar.beam import Beams
from insonify.sonar.footprint import two_way_height, two_way_width
from insonify.sonar.stance import Stance
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

BEAM_CELLS = 10.0
"""Patches across the main lobe of the narrowest beam [1]."""
PULSE_CELLS = 6.0
"""Patches along a resolution cell of slant range [1]."""
ZONES = 0.25
"""Side of a patch that others may shade in part, as a part of the scale of the first Fresnel zone [1]."""
ASIDE = 0.2
"""Sine by which rays may arrive off the straight lines from the images, where they bend or waves tilt them [1]."""
LATER = 0.95
"""Least time of a bent path, as a part of the straight one's [1]."""
NEAREST_WAVES = 4.0
"""Side of a patch in wavelengths below which shade does not make it smaller [1]."""


def target_sight(
    scene: Scene, choice: PathChoice, stance: Stance, slant: float, distance: float, rays: Rays | None
) -> Sight:
    """The sonar as a target sees it.

    Args:
        scene: The scene.
        choice: Paths followed, and the floor of the beams.
        stance: The sonar at this ping.
        slant: Resolution along the slant range [m].
        distance: Distance from the nearer end to the target [m].
        rays: How sound travels in the scene; None: not known, and beams drop nothing.
    """
    families = families_for("target", choice.followed)
    straight = isinstance(rays, StraightRays) and scene.surface.bounce == "mirror"
    bed = scene.seabed.bed
    level = bed is None or bed.span[0] == bed.span[1]
    aside = 0.0 if straight and level else ASIDE
    slowest = float(np.min(scene.water.speed_at(np.linspace(*scene.body_depths, 9))))
    wavelength = slowest / stance.frequency
    images = tuple(
        np.array([[*place[:2], image_depth(name, place[2], scene.seabed.depth)] for name in families])
        for place in (stance.transmit_place, stance.receive_place)
    )
    shaded = len(scene.occluders) > 1 or not level or scene.surface.bounce == "waves"
    zone = ZONES * np.sqrt(wavelength * max(distance, wavelength))
    largest = max(zone, NEAREST_WAVES * wavelength) if shaded else np.inf
    first, last = (max(delay, 0.0) for delay in stance.heard_delays)
    floor = float(amplitude_ratio(choice.beam_floor_db))

    def received(middle: Floats, radius: Floats) -> NDArray[np.bool_]:
        if not isinstance(rays, StraightRays):
            return np.ones(len(middle), bool)
        ends = (images[0], stance.transmit_beams), (images[1], stance.ears)
        gain = np.ones(len(middle))
        for places, beams in ends:
            gain *= _largest_gain(middle, radius, families, places, beams, aside)
        return np.asarray(gain >= floor)

    return Sight(
        (images[0], images[1]), 2 * np.pi / wavelength, lobes(stance), slant / PULSE_CELLS, largest, aside,
        (first * scene.water.slowest, last * scene.water.fastest / LATER), received,
    )  # fmt: skip


def lobes(stance: Stance) -> tuple[Lobe, ...]:
    """Main lobes that a patch must be small beside: of the narrowest two-way beam, along the axes of both arrays.

    Args:
        stance: The sonar.
    """
    sent, heard = stance.transmit_beams, stance.resolving_beams or stance.receive_beams
    width, height = (measure(sent, heard) / BEAM_CELLS for measure in (two_way_width, two_way_height))
    if stance.elements is not None:
        # elements receive a patch in the phase of its middle
        wavelength = stance.sound_speed / stance.frequency
        spans = [2 * max(side, wavelength) / wavelength * BEAM_CELLS for side in stance.reach]
        width, height = min(width, 1 / spans[0]), min(height, 1 / spans[1])
    found: list[Lobe] = []
    for axes in (sent.axes, heard.axes):
        for axis, span in ((axes[1], width), (axes[2], height)):
            if not any(np.allclose(axis, lobe.axis) and span == lobe.width for lobe in found):
                found.append(Lobe(axis, span))
    return tuple(found)


def _largest_gain(
    middle: Floats, radius: Floats, families: tuple[str, ...], images: Floats, beams: Beams, aside: float
) -> Floats:
    """Bound of the gain of an end towards spheres, by any of the families [1], shape (n,).

    Args:
        middle: Their middles [m], shape (n, 3).
        radius: Their radii [m], shape (n,).
        families: Families of the legs.
        images: Image of the end for each family [m], shape (f, 3).
        beams: Beams of the end.
        aside: Angle by which legs may leave off the straight line [rad].
    """
    best = np.zeros(len(middle))
    for name, image in zip(families, images, strict=True):
        ray = middle - image
        length = np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
        way = ray / length[:, None]
        if len(bounces(name)) % 2:
            way[:, 2] *= -1
        margin = np.arcsin(np.minimum(radius / length, 1.0)) + aside
        best = np.maximum(best, beams.bound(way, np.minimum(margin, np.pi)))
    return best
