"""Knife-edge diffraction: shadows of targets with soft edges.

Behind a half plane the field is a Fresnel integral whose limit is the Fresnel number of the edge. Around an upright box
it is the field without the box less the part that the box, a screen with two sides, a base and a top, blocks: by
Kirchhoff's approximation that part is a product of two differences of the same integral. A very wide box leaves the
half plane of its top. Each edge has its own distance from the point; the top's is that of its largest height above the
ray, so that half the pressure remains on the edge of the geometric shadow.

Solids are screens of many columns, see `silhouette`. Only the last segment of each leg is diffracted, as a straight
line in its direction of arrival; a target occludes points on itself without diffraction. Crests of the terrain are
edges of the same kind, see `engines.terrain_occlusion`.

Source: Born & Wolf (1999), Principles of Optics, 7th ed., 8.7.2-8.7.3 (Fresnel's integrals, the straight edge; not
verified); ITU-R P.526-15, section 4.1 (the number of a knife edge between two ends; not verified).
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.propagation._silhouette_kernel import NARROWING, SolidScreen, diffract_around_solid
from insonify.propagation.bounding_cylinders import edge_clearance, points_near_cylinders, union
from insonify.propagation.families import bounce_sequence, image_depth
from insonify.propagation.knife_edge_kernel import FAR, PER_UNIT, BoxScreens, DiffractedLegs, diffract_around_boxes
from insonify.propagation.silhouette import silhouette
from insonify.records.legs import Legs, LegStatus
from insonify.scene.scatterers import BOUNDARY_ECHO, Scatterers
from insonify.scene.scene import Scene

TOUCHING = 0.01
"""Largest gap between a base and the seabed that counts as none [m]."""
STANDING_OUT = 1e-6
"""Depth of a top above which a target pierces the surface [m]."""
SKY = 1e10
"""Height above the water at which such a target ends; its cube is still a number of single precision [m]."""
RIPPLES = 12.0
"""Fresnel number beyond which a solid beside or below a ray is neglected: its ripple is below 0.02 [1]."""
ROUGH_RIPPLES = 6.0
"""Fresnel number beyond which solids and boxes are neglected where ripples below 0.04 are acceptable [1]."""


def knife_edge(number: ArrayLike) -> NDArray[np.complex128]:
    """Pressure behind a half plane, re that without it [1].

    Args:
        number: Fresnel number of the edge, any shape: positive in the shadow, 0 on its edge.

    Returns:
        (1 + j) / 2 times the integral of exp(-j pi t^2 / 2) from the number on: 1/2 on the edge of the shadow, 0 deep
        in it, 1 far outside, for the time factor exp(+j omega t).

    Source: Born & Wolf (1999), Principles of Optics, 7th ed., 8.7.3, conjugated (not verified).
    """
    from scipy.special import fresnel

    sine, cosine = fresnel(np.asarray(number, float))
    return np.asarray((1 + 1j) / 2 * ((0.5 - cosine) - 1j * (0.5 - sine)))


@lru_cache(maxsize=1)
def edge_diffraction_table() -> NDArray[np.complex128]:
    """Pressure behind a half plane without its phase, at numbers from 0 to beyond `FAR`; see `edge_diffraction`."""
    number = np.arange(int(FAR * PER_UNIT) + 3) / PER_UNIT
    table = knife_edge(number) * np.exp(1j * np.pi / 2 * number**2)
    table.flags.writeable = False  # shared by all pings
    return table


@lru_cache(maxsize=1)
def edge_polynomials() -> NDArray[np.float32]:
    """Polynomials in 2 t - 1 of the same pressure over t = 1 / (1 + `NARROWING` number): coefficients, shape (2, 13).

    Rows are real and imaginary part, powers increase; NARROWING is that of the silhouette kernel.
    """
    x = np.polynomial.chebyshev.chebpts1(13)
    t = (x + 1) / 2
    number = (1 / t - 1) / NARROWING
    field = knife_edge(number) * np.exp(1j * np.pi / 2 * number**2) / t
    fits = (np.polynomial.chebyshev.chebfit(x, part, 12) for part in (field.real, field.imag))
    rows = np.array([np.polynomial.chebyshev.cheb2poly(fit) for fit in fits], np.float32)
    rows.flags.writeable = False  # shared by all pings
    return rows


def diffract_at_edges(
    legs: Legs, scatterers: Scatterers, position: NDArray[np.float64], scene: Scene, wavelength: float, *,
    infinitely_wide: bool = False, approximate: bool = False,
) -> Legs:  # fmt: skip
    """Legs with diffraction around the edges of boxes and solids.

    Args:
        legs: Legs with geometric shadows, of shape (f, n).
        scatterers: Ends of the legs.
        position: North, east, depth of the sonar's end [m], shape (3,).
        scene: The scene with its targets.
        wavelength: Wavelength of the sound [m].
        infinitely_wide: True to treat targets as infinitely wide, as in a slice.
        approximate: True to neglect ripples of less than 0.04 by each edge, and details of solids finer than a quarter
            of the width of the first Fresnel zone 1 m behind them, as for expected intensities of a rough seabed.

    Returns:
        The same legs with complex visibility: legs that a target cuts keep their status and occluder with a small
        pressure; clear legs near an edge ripple about 1.
    """
    if not scene.occluders:
        return legs
    max_number_boxes, max_number_solids = (ROUGH_RIPPLES, ROUGH_RIPPLES) if approximate else (FAR, RIPPLES)
    rows_near = _rows_near_targets(legs, scatterers, position, scene, wavelength, max_number_boxes, max_number_solids)
    if not any(map(len, rows_near)) and not np.any(legs.occluder >= 0):
        return legs
    visibility = (legs.status == LegStatus.CLEAR).astype(complex)
    bounced = np.array([bool(bounce_sequence(name)) for name in legs.families])
    diffracted = DiffractedLegs(
        position, scatterers.position, legs.arrival, legs.length, bounced, legs.status, legs.occluder, visibility
    )
    rows_near_boxes = rows_near[: len(scene.boxes)]
    if any(map(len, rows_near_boxes)):
        beds = np.array([scene.seabed_depth_under(box) for box in scene.boxes]) - TOUCHING
        screens = BoxScreens(
            close_gap_above(scene.bodies, 6), beds, scatterers.occluder, infinitely_wide, max_number_boxes
        )
        rows = union(rows_near_boxes, len(scatterers))
        diffract_around_boxes(rows, diffracted, scene.seabed.depth, wavelength, screens, edge_diffraction_table())
    for solid in range(len(scene.boxes), len(scene.occluders)):
        if solid != scatterers.occluder and len(rows_near[solid]):
            _diffract_around(
                diffracted, rows_near[solid], scene, wavelength, legs.families, solid, infinitely_wide, approximate
            )
    # legs that the terrain cuts, or that do not exist, stay unchanged; over relief the terrain has been applied
    by_target = (legs.status == LegStatus.OCCLUDED) & (legs.occluder >= 0)
    terrain_factor = 1.0 if scene.seabed.terrain is None else legs.visibility
    is_diffracted = by_target | (legs.status == LegStatus.CLEAR)
    return replace(legs, visibility=np.where(is_diffracted, visibility * terrain_factor, legs.visibility))


def screened_part(
    strips: NDArray[np.float64], gap_below: NDArray[np.bool_], ends: tuple[NDArray[np.float64], NDArray[np.float64]],
    direction: NDArray[np.float64], length: NDArray[np.float64], wavelength: float,
) -> NDArray[np.complex128]:  # fmt: skip
    """Pressure that a flat upright screen blocks, re that of the straight leg without it [1], shape (n,).

    Args:
        strips: Upright strips of the screen, side by side, in columns of `insonify.scene.box.box_body`, shape (k, 8).
        gap_below: True: sound passes below the strip too, shape (k,).
        ends: Position from which the legs start, shape (3,), and positions of their ends [m], shape (n, 3).
        direction: Unit vector of travel along the legs [1], shape (n, 3).
        length: Length from which the curvature of the wave follows [m], shape (n,).
        wavelength: Wavelength of the sound [m].
    """
    n, blocked = len(length), np.zeros(len(length), complex)
    clear, no_occluder, rows = np.zeros((1, n), np.uint8), np.full((1, n), -1, np.int16), np.arange(n)
    for strip, gap in zip(strips, gap_below, strict=True):
        remaining = np.ones((1, n), complex)
        legs = DiffractedLegs(*ends, direction[None], length[None], np.zeros(1, bool), clear, no_occluder, remaining)
        screens = BoxScreens(strip[None], np.array([np.inf if gap else -np.inf]), -1, False, FAR)
        diffract_around_boxes(rows, legs, 0.0, wavelength, screens, edge_diffraction_table())
        blocked += 1 - remaining[0]
    return blocked


def close_gap_above(screens: NDArray[np.float64], top: int) -> NDArray[np.float64]:
    """Screens, of which those that pierce the water surface end high above it: no sound diffracts over their tops.

    Args:
        screens: Columns of each screen, shape (n, k).
        top: Index of the column with the depths of the tops [m].
    """
    return np.where((np.arange(screens.shape[1]) == top) & (screens[:, top, None] <= STANDING_OUT), -SKY, screens)


def _rows_near_targets(
    legs: Legs, scatterers: Scatterers, position: NDArray[np.float64], scene: Scene, wavelength: float,
    max_number_boxes: float, max_number_solids: float,
) -> list[NDArray[np.int64]]:  # fmt: skip
    """Rows of the points at which each occluding target may change the field, up to Fresnel numbers of both kinds."""
    longest = float(legs.length.max(initial=0.0))
    if not np.isfinite(longest):  # legs that do not exist have no length
        longest = float(np.fmax.reduce(legs.length, axis=None, initial=0.0))
    boxes, near_points, points = len(scene.boxes), [], scatterers.position
    aside = 0.0
    if scatterers.boundary == BOUNDARY_ECHO:  # slopes turn paths aside from the straight line between both ends
        horizontal = legs.length * np.hypot(legs.arrival[..., 0], legs.arrival[..., 1])
        aside = float(np.fmax.reduce(horizontal, axis=None, initial=0.0))
    if boxes:
        max_offset = edge_clearance(longest, wavelength, max_number_boxes) + aside
        near_points = points_near_cylinders(scene, position, points, max_offset, legs.arrival, targets=slice(boxes))
    if boxes < len(scene.occluders):
        max_offset = edge_clearance(longest, wavelength, max_number_solids) + aside
        near_points += points_near_cylinders(scene, position, points, max_offset, targets=slice(boxes, None))
    return near_points


def _diffract_around(
    legs: DiffractedLegs, rows: NDArray[np.int64], scene: Scene, wavelength: float, families: tuple[str, ...], row: int,
    infinitely_wide: bool, approximate: bool,
) -> None:  # fmt: skip
    """Multiply the diffraction factor of one solid, a row among the occluders, into the visibility of some legs."""
    solid, position = scene.solids[row - len(scene.boxes)], legs.position.tolist()
    bed = scene.seabed_depth_under(solid) - TOUCHING
    max_number, max_width = (ROUGH_RIPPLES, float(np.sqrt(wavelength)) / 2) if approximate else (RIPPLES, 0.0)
    for f, family in enumerate(families):
        depth = image_depth(family, position[2], scene.seabed.depth)
        outline = silhouette(solid, scene.seabed, (position[0], position[1], depth), max_width)
        if outline is not None:
            outline = outline._replace(columns=close_gap_above(outline.columns, 1))
            screen = SolidScreen(outline, bed, row, infinitely_wide, max_number)
            diffract_around_solid(rows, legs, f, scene.seabed.depth, wavelength, screen, edge_polynomials())
