"""Legs between one end of the sonar and positions by families of reflections, as straight lines from image sources."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import bounce_sequence, image_depth
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ImageLegs:
    """Legs of one family between one end and n positions, not tested for occlusion."""

    length: Floats
    """Path length [m], (n,)."""
    departure: Floats
    """Direction of travel at the sonar, for sound that leaves it [1], (n, 3)."""
    arrival: Floats
    """Direction of travel at the position, for sound that leaves the sonar [1], (n, 3)."""
    intensity: Floats
    """Product of the reflections' intensity factors, without spreading and absorption [1], (n,)."""


def image_legs(scene: Scene, end: Floats, position: Floats, family: str, wavelength: float) -> ImageLegs:
    """Legs of one family between one end of the sonar and n positions.

    Args:
        scene: Scene, of which the flat surface and the mean seabed reflect.
        end: Position of transmitter or receiver [m], shape (3,).
        position: Positions [m], shape (n, 3).
        family: Name of the family.
        wavelength: Acoustic wavelength [m].
    """
    bed = scene.seabed.depth
    ray = position - np.array([end[0], end[1], image_depth(family, end[2], bed)])
    length = np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
    arrival = ray / length[:, None]
    vertical_sign = np.array([1, 1, -1 if len(bounce_sequence(family)) % 2 else 1])
    sine = np.abs(arrival[:, 2])
    intensity = reflected_intensity(scene, family, np.arcsin(np.minimum(sine, 1.0)))
    intensity = intensity * coherent_intensity_factor(scene, family, float(end[2]), length, sine, wavelength)
    return ImageLegs(length, arrival * vertical_sign, arrival, intensity)


def refracted_sine(cosine: Floats) -> Floats:
    """Sine of the grazing angle of refracted rays at a boundary [1], by the cosine that Snell's law gives there."""
    return np.asarray(np.sqrt(np.clip((1 - cosine) * (1 + cosine), 1e-12, 1.0)))


def reflected_intensity(scene: Scene, family: str, grazing: Floats) -> Floats:
    """Product of the squared reflection coefficients of a family at one grazing angle [rad], shape of `grazing`."""
    intensity = np.ones(np.shape(grazing))
    for letter in set(bounce_sequence(family)):
        coefficient = scene.seabed.reflection_coefficient if letter == "B" else scene.surface.reflection_coefficient
        intensity = intensity * np.abs(coefficient(grazing)) ** (2 * bounce_sequence(family).count(letter))
    return intensity


def coherent_intensity_factor(
    scene: Scene, family: str, depth: float, length: Floats, sine: Floats, wavelength: float
) -> Floats:
    """Factor of the seabed's roughness on the specular intensity over all bounces of a family [1], shape of `length`.

    Args:
        scene: The scene; 1 over a flat bed.
        family: Name of the family.
        depth: Depth of transmitter or receiver, where the family begins [m].
        length: Lengths of the paths [m].
        sine: Sines of their grazing angles at the boundaries [1].
        wavelength: Acoustic wavelength [m].
    """
    factor, vertical_path, z = np.ones(np.shape(length)), 0.0, depth
    for letter in bounce_sequence(family) if scene.seabed.terrain is not None else "":
        boundary_depth = scene.seabed.depth if letter == "B" else 0.0
        vertical_path, z = vertical_path + abs(boundary_depth - z), boundary_depth
        if letter == "B":
            path_fraction = np.clip(vertical_path / np.maximum(sine * length, 1e-12), 0, 1)
            factor = factor * bounce_roughness_factor(scene, path_fraction, length, sine, wavelength)
    return factor


def bounce_roughness_factor(
    scene: Scene, path_fraction: Floats, length: Floats, sine: Floats, wavelength: float
) -> Floats:
    """Factor of the seabed's roughness on the specular intensity of one bounce [1], shape of `length`.

    Args:
        scene: The scene; 1 over a flat bed.
        path_fraction: Fraction of the path before the bounce [1].
        length: Lengths of the paths [m].
        sine: Sines of their grazing angles at the bounce [1].
        wavelength: Acoustic wavelength [m].
    """
    terrain = scene.seabed.terrain
    if terrain is None:
        return np.ones(np.shape(length))
    # geometric mean of length and width of the first Fresnel zone [m]
    zone = 2 * np.sqrt(wavelength * length * path_fraction * (1 - path_fraction) / np.maximum(sine, 1e-9))
    return np.asarray(terrain.roughness_reflection_factor(sine, wavelength, np.maximum(zone, 1e-6)) ** 2)
