"""Boundary echoes: sound from the transmitter to the receiver by reflections at boundaries, without a scatterer.

B is the seabed's own specular echo (the first bottom return), S that of the surface, BS, SB, BSB, ... their multiples;
D is the sound that travels straight from one platform to another. A path is a leg from the receiver to the
transmitter's position, so spreading, reflection coefficients, refraction, relief, occlusion and wavefronts are those of
every other leg. It is stored as the receive leg of a pair whose transmit leg has no length; the family is named on the
transmit leg, in the order of travel. Sound that roughness takes from the coherent echo is in the scattering laws of the
boundaries or, under a wind and without a law of the surface, in glints.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.engines.face_reflection import face_families, face_family
from insonify.engines.hull_reflection import hull_families
from insonify.propagation.families import DIRECT, bottom_bounces
from insonify.propagation.glints import leg_rows
from insonify.propagation.local_planes import flat_bounces, fresnel_zone
from insonify.propagation.path_settings import PathSettings
from insonify.records.legs import GlintPhasors, Legs, LegStatus
from insonify.records.pairs import Pairs
from insonify.scattering.point_target import PointTargetLaw
from insonify.scattering.roughness import band_variance
from insonify.scene.scatterers import BOUNDARY_ECHO, Scatterers, whole_target_id
from insonify.scene.scene import Scene
from insonify.scene.seabed import Seabed
from insonify.scene.seabed_law import SedimentLaw, sediment
from insonify.scene.surface import AplSurfaceLaw
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]


def boundary_echo_families(path_settings: PathSettings, *, two_platforms: bool) -> tuple[str, ...]:
    """Families that reach the receiver without a scatterer: all with a reflection, and D between two platforms.

    On one platform the straight path between its own arrays is left out: baffles and blanking suppress it.

    Args:
        path_settings: Path settings.
        two_platforms: True: transmitter and receiver are on platforms of their own.
    """
    if BOUNDARY_ECHO not in path_settings.contributions:
        return ()
    followed = path_settings.followed_families
    return followed if two_platforms else tuple(name for name in followed if name != DIRECT)


def from_receiver(families: tuple[str, ...]) -> tuple[str, ...]:
    """Names of families reversed, as those of legs from the receiver.

    If these are the same set, the order is kept: entry i is then not the reverse of entry i.

    Args:
        families: Names of families from the transmitter.

    Example:
        >>> from_receiver(("D", "BS")), from_receiver(("BS", "SB"))
        (('D', 'SB'), ('BS', 'SB'))
    """
    backwards = [name[::-1] for name in families]
    return tuple(sorted(backwards, key=lambda name: families.index(name if name in families else name[::-1])))


def label_families(
    path_settings: PathSettings, *, two_platforms: bool, under_hull: bool, faces: bool
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Families by which labels divide echoes: of the legs to scatterers, and of the boundary echoes.

    Both include those by a hull; legs also those by targets' faces.

    Args:
        path_settings: Path settings.
        two_platforms: True: transmitter and receiver are on platforms of their own.
        under_hull: True: a hull reflects sound too.
        faces: True: large smooth faces of targets reflect sound too.
    """
    families = path_settings.followed_families
    echoes = boundary_echo_families(path_settings, two_platforms=two_platforms)
    if faces:
        families += tuple(map(face_family, face_families(path_settings)))
    if not under_hull:
        return families, echoes
    return families + hull_families(path_settings.followed_families), echoes + hull_families(echoes, echoes=True)


def transmitter_point(ping_geometry: PingGeometry) -> Scatterers:
    """The transmitter's position, as the end point of the boundary echoes' receive legs; its law is not evaluated."""
    return Scatterers(
        BOUNDARY_ECHO, BOUNDARY_ECHO, PointTargetLaw(0.0), ping_geometry.transmit_position[None].copy(),
        normal=np.zeros((1, 3)), area=np.ones(1), phase=np.ones(1, complex),
        scatterer_id=whole_target_id(BOUNDARY_ECHO, 1), has_random_phase=False,
    )  # fmt: skip


def surface_law_has_facets(scene: Scene, path_settings: PathSettings) -> bool:
    """Return True if the surface scatters by a law that includes the energy that waves take from its specular echo.

    The facets of that law scatter about the specular direction; integrated, they have the energy of a flat surface.
    """
    return isinstance(scene.surface.scattering, AplSurfaceLaw) and "surface" in path_settings.contributions


def without_glints(legs: Legs) -> Legs:
    """Coherent rows of legs that a moving surface reflects: those without a glint."""
    if legs.glints is None:
        return legs
    rows = [row for row, number in enumerate(legs.glints.bounce_id) if number < 0]
    label = tuple(legs.glints.bounce_id[row] for row in rows)
    return replace(leg_rows(legs, rows), glints=GlintPhasors(label, legs.glints.phasor[rows]))


def sediment_roughness_factor(
    legs: Legs, position: Floats, seabed: Seabed, wavelength: float, *, hull_depth: float = 0.0
) -> Floats:
    """Factor of the roughness of a sediment on the coherent pressure, all bottom bounces together, shape (f, n) [1].

    Args:
        legs: Legs between the position and n points.
        position: North, east, depth of the end at which the legs begin [m], shape (3,).
        seabed: The seabed.
        wavelength: Acoustic wavelength [m].
        hull_depth: Depth of the hull that reflects the families with H [m].
    """
    factor = np.ones_like(legs.delay)
    for row, family in enumerate(legs.families):
        sine, top = np.abs(legs.departure[row, :, 2]), hull_depth if "H" in family else 0.0
        factor[row] = sediment_bounce_factor(
            family, float(position[2]), legs.length[row], sine, seabed, wavelength, hull_depth=top
        )
    return factor


def sediment_bounce_factor(
    family: str, depth: float, length: Floats, sine: Floats, seabed: Seabed, wavelength: float, *,
    hull_depth: float = 0.0,
) -> Floats:  # fmt: skip
    """Factor of the roughness of a sediment on the coherent pressure of paths of one family [1], shape (n,).

    exp(-2 k^2 h^2 sin^2) for each bottom bounce, h^2 the variance of the roughness of wavelengths from the acoustic one
    to the geometric mean of the length and the width of the Fresnel zone. The energy lost is in the near-specular part
    of the sediment's scattering law. For a seabed with relief, whose legs include the roughness of the relief, and for
    one without a sediment law, it is 1.

    Args:
        family: Name of the family.
        depth: Depth of the end at which the paths begin [m].
        length: Lengths of the paths [m], shape (n,).
        sine: Sine of their grazing angle at the end, and at all bounces [1], shape (n,).
        seabed: The seabed.
        wavelength: Acoustic wavelength [m].
        hull_depth: Depth of the hull that reflects the family; 0 for none [m].

    Source: Eckart (1953), J. Acoust. Soc. Am. 25, 566, with the spectrum of APL-UW TR 9407 (1994), section IV.A.
    Valid: zones are those of straight rays over a flat seabed.
    """
    factor, k = np.ones_like(length), 2 * np.pi / wavelength
    if seabed.relief or not isinstance(seabed.scattering, SedimentLaw) or not bottom_bounces(family):
        return factor
    material = sediment(seabed.scattering.sediment)
    paths = flat_bounces(family, depth - hull_depth, length, sine, seabed.depth - hull_depth)
    for bounce in (number for number, letter in enumerate(family) if letter == "B"):
        half_length, half_width = fresnel_zone(paths, bounce, wavelength)
        low = np.minimum(np.pi / np.maximum(np.sqrt(half_length * half_width), 1e-6), k)
        factor *= np.exp(-2 * k**2 * band_variance(material, low, k) * sine**2)
    return factor


def boundary_echo_pairs(transmitter: Scatterers, receive: Legs) -> Pairs:
    """Boundary echoes as pairs of a transmit leg without length and a receive leg.

    Args:
        transmitter: Point from `transmitter_point`.
        receive: Legs from the receiver to that point.

    Returns:
        One pair for each row of the legs, of strength 1: its amplitude is the pressure at the receiver re that at 1 m
        from the source. Names of families are on the transmit legs.
    """
    rows = len(receive.families)
    zeros, ones = np.zeros_like(receive.delay), np.ones_like(receive.delay)
    transmit = replace(
        receive, families=tuple(name[::-1] for name in receive.families), delay=zeros, length=zeros, spreading=ones,
        absorption=ones, reflection_coefficient=ones.astype(complex), visibility=ones, caustics=0 * receive.caustics,
        departure=-receive.arrival, arrival=-receive.arrival, grazing_sine=zeros,
        status=np.full_like(receive.status, LegStatus.CLEAR), occluder=np.full_like(receive.occluder, -1), caustic=None,
        glints=None if receive.glints is None else GlintPhasors(receive.glints.bounce_id, ones.astype(complex)),
        aperture_expansion=None,
    )  # fmt: skip
    receive = replace(receive, families=("",) * rows, branch=(0,) * rows)
    return Pairs(transmitter, transmit, receive, np.repeat(np.arange(rows), 2).reshape(-1, 2), ones.copy())
