"""Insonification of a target by one ping: images of the sonar, beams, window, and largest size of its patches."""

import numpy as np
from numpy.typing import NDArray

from insonify.engines.face_images import FaceImage, face_images
from insonify.engines.patch_subdivision import Lobe, TargetInsonification
from insonify.propagation.families import bounce_sequence, families_reaching, image_depth
from insonify.propagation.image_sources import StraightRays
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.scene.scene import Scene
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.two_way_beam import two_way_height, two_way_width
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

BEAM_CELLS = 10.0
"""Number of patches across the main lobe of the narrowest beam [1]."""
PULSE_CELLS = 6.0
"""Number of patches along a resolution cell of slant range [1]."""
FRESNEL_FRACTION = 0.25
"""Side of a patch that others may occlude in part, re the root of wavelength times distance [1]."""
MAX_DEVIATION = 0.2
"""Sine of the largest angle between rays and straight lines to the images, by refraction or a tilted surface [1]."""
MIN_TRAVEL_TIME_RATIO = 0.95
"""Least travel time of a refracted path, re that of the straight one [1]."""
NEAREST_WAVES = 4.0
"""Side of a patch, re the wavelength, below which partial occlusion makes it no smaller [1]."""


def target_insonification(
    scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry, slant: float, distance: float,
    rays: PropagationModel | None,
) -> TargetInsonification:  # fmt: skip
    """Insonification of a target by one ping.

    Args:
        scene: The scene.
        path_settings: Path settings.
        ping_geometry: The sonar at this ping.
        slant: Resolution along the slant range [m].
        distance: Distance from the nearer end to the target [m].
        rays: Propagation model of the scene; None: unknown, and no patch is dropped by its gain.
    """
    families = families_reaching("target", path_settings.followed_families)
    straight = isinstance(rays, StraightRays) and not scene.is_rough(families)
    terrain = scene.seabed.terrain
    is_flat = terrain is None or terrain.span[0] == terrain.span[1]
    max_deviation = 0.0 if straight and is_flat else MAX_DEVIATION
    slowest = float(np.min(scene.water.sound_speed_at(np.linspace(*scene.body_depths, 9))))
    wavelength = slowest / ping_geometry.frequency
    images = tuple(
        np.array([[*position[:2], image_depth(name, position[2], scene.seabed.depth)] for name in families])
        for position in (ping_geometry.transmit_position, ping_geometry.receive_position)
    )
    faces = [
        (
            face_image,
            np.array([[*end[:2], image_depth(name, end[2], scene.seabed.depth)] for name in face_image.families]),
        )
        for face_image in face_images(scene, path_settings, ping_geometry, "target")
        for end in (face_image.sonar.transmit_position, face_image.sonar.receive_position)
    ]
    shaded = len(scene.occluders) > 1 or not is_flat or scene.surface.reflection == "explicit"
    zone = FRESNEL_FRACTION * np.sqrt(wavelength * max(distance, wavelength))
    largest = max(zone, NEAREST_WAVES * wavelength) if shaded else np.inf
    first, last = (max(delay, 0.0) for delay in ping_geometry.recorded_delays)
    floor = float(amplitude_ratio(path_settings.beam_cutoff_db))

    def may_receive(middle: Floats, radius: Floats) -> NDArray[np.bool_]:
        if not isinstance(rays, StraightRays):
            return np.ones(len(middle), bool)
        ends = (images[0], ping_geometry.transmit_beams), (images[1], ping_geometry.bounding_receive_beams)
        gain = np.ones(len(middle))
        for row, (positions, beams) in enumerate(ends):
            best = _largest_gain(middle, radius, families, positions, beams, max_deviation)
            for face_image, image in faces[row::2]:
                beams_of_end = (face_image.sonar.transmit_beams, face_image.sonar.bounding_receive_beams)[row]
                np.maximum(
                    best, _largest_gain(middle, radius, face_image.families, image, beams_of_end, max_deviation),
                    out=best,
                )  # fmt: skip
            gain *= best
        return np.asarray(gain >= floor)

    return TargetInsonification(
        (images[0], images[1]), 2 * np.pi / wavelength, lobes(ping_geometry), slant / PULSE_CELLS, largest,
        max_deviation,
        (first * scene.water.min_sound_speed, last * scene.water.max_sound_speed / MIN_TRAVEL_TIME_RATIO), may_receive,
        (_stacked(faces[::2]), _stacked(faces[1::2])),
    )  # fmt: skip


def lobes(ping_geometry: PingGeometry) -> tuple[Lobe, ...]:
    """Main lobes that a patch must be small beside: of the narrowest two-way beam, along the axes of both arrays."""
    sent, receive = ping_geometry.transmit_beams, ping_geometry.full_aperture_beams or ping_geometry.receive_beams
    width, height = (measure(sent, receive) / BEAM_CELLS for measure in (two_way_width, two_way_height))
    if ping_geometry.elements is not None:
        # elements receive a patch in the phase of its middle
        wavelength = ping_geometry.sound_speed / ping_geometry.frequency
        spans = [2 * max(side, wavelength) / wavelength * BEAM_CELLS for side in ping_geometry.element_extent]
        width, height = min(width, 1 / spans[0]), min(height, 1 / spans[1])
    result: list[Lobe] = []
    for axes in (sent.axes, receive.axes):
        for axis, span in ((axes[1], width), (axes[2], height)):
            if not any(np.allclose(axis, lobe.axis) and span == lobe.width for lobe in result):
                result.append(Lobe(axis, span))
    return tuple(result)


def _stacked(faces: list[tuple[FaceImage, Floats]]) -> Floats:
    """Positions of all images of one end in faces [m], shape (k, 3)."""
    return np.concatenate([np.zeros((0, 3)), *(image for _, image in faces)])


def _largest_gain(
    middle: Floats, radius: Floats, families: tuple[str, ...], images: Floats, beams: Beams, max_deviation: float
) -> Floats:
    """Upper bound of the pressure pattern of an end towards spheres, by any of the families [1], shape (n,).

    Args:
        middle: Their middles [m], shape (n, 3).
        radius: Their radii [m], shape (n,).
        families: Families of the legs.
        images: Image of the end for each family [m], shape (f, 3).
        beams: Beams of the end.
        max_deviation: Largest angle between legs and the straight lines [rad].
    """
    best = np.zeros(len(middle))
    for name, image in zip(families, images, strict=True):
        ray = middle - image
        length = np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
        direction = ray / length[:, None]
        if len(bounce_sequence(name)) % 2:
            direction[:, 2] *= -1
        margin = np.arcsin(np.minimum(radius / length, 1.0)) + max_deviation
        best = np.maximum(best, beams.bound(direction, np.minimum(margin, np.pi)))
    return best
