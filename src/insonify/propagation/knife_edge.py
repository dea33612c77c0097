"""Shadows with soft edges: sound bends around the edges of what stands in its way.

Behind a half plane the field is a Fresnel integral of the height by which the edge stands above the ray, in Fresnel
zones. Around an upright box it is the field without the box less what the box, a screen between two sides, a base
and a top, keeps from the point: by Kirchhoff's approximation that part is a product of two differences of the same
integral. A wide box leaves the half plane of its top. Each edge has its own distance from the point; the top's is
where it stands highest above the ray, so that half the pressure remains on the edge of the hard shadow.

Solids are screens of many columns, see `silhouette`. The last segment of each leg is looked at, as a straight line in
its direction of arrival; a target that the points lie on cuts them as hard as ever. Crests of the ground are edges of
the same kind, see `engines.skyline`.

Source: Born & Wolf (1999), Principles of Optics, 7th ed., 8.7.2-8.7.3 (Fresnel's integrals, the straight edge; from
memory); ITU-R P.526-15, section 4.1 (the number of a knife edge between two ends; from memory).
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.propagation._silhouette_kernel import diffract_around_solid
from insonify.propagation.bounding_cylinders import edge_clearance, points_near_cylinders
from insonify.propagation.families import bounce_sequence, image_depth
from insonify.propagation.knife_edge_kernel import FAR, diffract_around_boxes
from insonify.propagation.silhouette import silhouette
from insonify.records.legs import Legs, LegStatus
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.target import Solid

PER_UNIT = 64
"""Entries of the table per unit of the Fresnel number: a cubic through four errs by less than 1e-8."""

TOUCHING = 0.01
"""A base this near to the bed leaves no gap [m]."""
STANDING_OUT = 1e-6
"""Depth of a top down to which a target stands through the surface [m]."""
SKY = 1e30
"""Height above the water at which such a screen ends [m]."""
RIPPLES = 12.0
"""Fresnel number beyond which a solid beside or below a ray takes nothing: its ripple is below 0.02 [1]."""
ROUGH_RIPPLES = 6.0
"""The same where ripples below 0.04 may be left out [1]."""


def fresnel_number(
    height: ArrayLike, distance_before: ArrayLike, distance_behind: ArrayLike, wavelength: float
) -> NDArray[np.float64]:
    """Height of an edge above the straight way past it, in Fresnel zones [1].

    Args:
        height: Of the edge above the ray, negative where it is below [m], any shape.
        distance_before: Distance from the source to the edge [m].
        distance_behind: Distance from the edge to the point [m].
        wavelength: Of the sound [m].

    Returns:
        height sqrt(2 / wavelength (1 / before + 1 / behind)), broadcast shape. Positive in the shadow.

    Source: ITU-R P.526-15, eq. 26 (from memory). Valid where both distances are many wavelengths and the height is
    small against them.
    """
    ways = 1 / np.asarray(distance_before, float) + 1 / np.asarray(distance_behind, float)
    return np.asarray(np.asarray(height, float) * np.sqrt(2 / wavelength * ways))


def knife_edge(number: ArrayLike) -> NDArray[np.complex128]:
    """Pressure behind a half plane, re that without it [1].

    Args:
        number: Fresnel number of the edge, any shape: positive in the shadow, 0 on its edge.

    Returns:
        (1 + j) / 2 times the integral of exp(-j pi t^2 / 2) from the number on: 1/2 on the edge of the shadow, 0 deep
        in it, 1 far outside, for the time factor exp(+j omega t).

    Source: Born & Wolf (1999), Principles of Optics, 7th ed., 8.7.3, conjugated (from memory).
    """
    from scipy.special import fresnel

    sine, cosine = fresnel(np.asarray(number, float))
    return np.asarray((1 + 1j) / 2 * ((0.5 - cosine) - 1j * (0.5 - sine)))


@lru_cache(maxsize=1)
def edge_diffraction_table() -> NDArray[np.complex128]:
    """Pressure behind a half plane without its turning phase, at numbers from 0 to beyond `FAR`, see `edge_diffraction`."""
    number = np.arange(int(FAR * PER_UNIT) + 3) / PER_UNIT
    table = knife_edge(number) * np.exp(1j * np.pi / 2 * number**2)
    table.flags.writeable = False  # shared by all pings
    return table


def diffract_at_edges(
    legs: Legs, scatterers: Scatterers, position: NDArray[np.float64], scene: Scene, wavelength: float, *,
    infinitely_wide: bool = False, approximate: bool = False,
) -> Legs:  # fmt: skip
    """Legs with what bends around the edges of boxes and solids.

    Args:
        legs: Legs with hard shadows, of shape (f, n).
        scatterers: The points that they reach.
        position: North, east, depth of the sonar's end [m], shape (3,).
        scene: Whose targets cast shadows.
        wavelength: Of the sound [m].
        infinitely_wide: Whether targets are taken as endlessly wide, as in a slice.
        approximate: Whether ripples of less than 0.04 about 1, and details of solids finer than half a wave's zone 1 m
            behind them, may be left out, as in expected intensities of a rough bed.

    Returns:
        The same legs with complex visibility: legs that a target cuts keep their status and occluder, but not quite
        nothing arrives; clear legs near an edge ripple about 1.
    """
    if not scene.occluders:
        return legs
    near = _near(legs, scatterers, position, scene, wavelength, ROUGH_RIPPLES if approximate else RIPPLES)
    if not any(map(len, near)) and not np.any(legs.occluder >= 0):
        return legs
    visibility = (legs.status == LegStatus.CLEAR).astype(complex)
    boxed = near[: len(scene.boxes)]
    if any(map(len, boxed)):
        beds = np.array([scene.seabed_depth_under(box) for box in scene.boxes]) - TOUCHING
        bounced = np.array([bool(bounce_sequence(name)) for name in legs.families])
        diffract_around_boxes(
            union(boxed, len(scatterers)), position, scatterers.position, legs.arrival, legs.length, bounced,
            scene.seabed.depth, wavelength, close_gap_above(scene.bodies, 6), beds, scatterers.occluder,
            infinitely_wide,
            edge_diffraction_table(), PER_UNIT, legs.status, legs.occluder, visibility,
        )  # fmt: skip
    for row, solid in enumerate(scene.solids, start=len(scene.boxes)):
        if row != scatterers.occluder and len(near[row]):
            _around(
                legs,
                scatterers,
                near[row],
                position,
                scene,
                wavelength,
                solid,
                row,
                visibility,
                infinitely_wide=infinitely_wide,
                approximate=approximate,
            )
    # what the ground cuts, or is not there at all, stays as it was; over relief the ground has had its share
    by_target = (legs.status == LegStatus.OCCLUDED) & (legs.occluder >= 0)
    ground = 1.0 if scene.seabed.terrain is None else legs.visibility
    partly = by_target | (legs.status == LegStatus.CLEAR)
    return replace(legs, visibility=np.where(partly, visibility * ground, legs.visibility))


def union(parts: list[NDArray[np.int64]], count: int) -> NDArray[np.int64]:
    """Rows that any part has, in order, of so many rows."""
    if len(parts) == 1:
        return parts[0]
    there = np.zeros(count, bool)
    for part in parts:
        there[part] = True
    return np.flatnonzero(there)


def close_gap_above(screens: NDArray[np.float64], top: int) -> NDArray[np.float64]:
    """Screens of which those that stand out of the water go on above it: no sound bends over their tops.

    Args:
        screens: Numbers of each screen, shape (n, k).
        top: Column of the depths of their tops [m].
    """
    return np.where((np.arange(screens.shape[1]) == top) & (screens[:, top, None] <= STANDING_OUT), -SKY, screens)


def _near(
    legs: Legs,
    scatterers: Scatterers,
    position: NDArray[np.float64],
    scene: Scene,
    wavelength: float,
    max_fresnel_number: float,
) -> list[NDArray[np.int64]]:
    """Rows of the points at which each target that casts a shadow may change anything."""
    longest = float(legs.length.max(initial=0.0))
    if not np.isfinite(longest):  # what is not there has no length
        longest = float(np.fmax.reduce(legs.length, axis=None, initial=0.0))
    boxes, found, points = len(scene.boxes), [], scatterers.position
    if boxes:
        beside = edge_clearance(longest, wavelength, FAR)
        found = points_near_cylinders(scene, position, points, beside, legs.arrival)[:boxes]
    if boxes < len(scene.occluders):
        beside = edge_clearance(longest, wavelength, max_fresnel_number)
        found += points_near_cylinders(scene, position, points, beside)[boxes:]
    return found


def _around(
    legs: Legs, scatterers: Scatterers, rows: NDArray[np.int64], position: NDArray[np.float64], scene: Scene,
    wavelength: float, solid: Solid, row: int, visibility: NDArray[np.complex128], *, infinitely_wide: bool,
    approximate: bool,
) -> None:  # fmt: skip
    """Multiply what one solid leaves of all legs into their visibility."""
    bed = scene.seabed_depth_under(solid) - TOUCHING
    far, widest = (ROUGH_RIPPLES, float(np.sqrt(wavelength)) / 2) if approximate else (RIPPLES, 0.0)
    for f, family in enumerate(legs.families):
        depth = image_depth(family, float(position[2]), scene.seabed.depth)
        seen = silhouette(solid, scene.seabed, (float(position[0]), float(position[1]), depth), widest)
        if seen is not None:
            diffract_around_solid(
                rows, position, scatterers.position, legs.arrival[f], legs.length[f], bool(bounce_sequence(family)),
                scene.seabed.depth, wavelength, seen.centre_bearing, seen.border_bearings, seen.border_ranges,
                close_gap_above(seen.columns, 1), bed, row, infinitely_wide, far, edge_diffraction_table(), PER_UNIT,
                legs.status[f],
                legs.occluder[f], visibility[f],
            )  # fmt: skip
