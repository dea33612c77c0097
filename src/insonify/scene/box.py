"""The faces of a box as random points, and its body as an occluder."""

import zlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.scene.scatterers import Scatterers, target_scatterer_id
from insonify.scene.target import Box

Floats = NDArray[np.float64]
FACES = ("fore", "aft", "starboard", "port", "top", "bottom")
"""Names of the faces; the random numbers of each are keyed by its position in this tuple."""
FLAT = ("top", "bottom")  # horizontal faces
TILE = 32
"""Number of cells along a side of the squares of a face that are included or omitted as a whole [1]."""
ReachTest = Callable[[Floats, Floats], NDArray[np.bool_]]
"""Function from the middles (n, 3) and radii (n,) of spheres [m] to a mask (n,): False where nothing is received."""
_GOLDEN = 0.6180339887498949
"""Golden ratio less 1: its multiples modulo 1 are evenly distributed."""
_STANDING_TOLERANCE = 1e-6  # a base this close to the seabed stands on it [m]


def box_axes(box: Box) -> NDArray[np.float64]:
    """Unit vectors along, across and up the box in the world (north, east, down), shape (3, 3)."""
    c, s = np.cos(box.heading), np.sin(box.heading)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, -1.0]])


def box_body(box: Box, seabed_depth: float) -> NDArray[np.float64]:
    """The box as numbers for kernels, shape (8,).

    North, east of its centre; cosine, sine of its heading; half length, half width [m];
    depth of its top, or 0 where it stands out of the water, and of its base [m].
    """
    base = seabed_depth if box.base_depth is None else box.base_depth
    length, width, height = box.size
    c, s = np.cos(box.heading), np.sin(box.heading)
    return np.array([*box.position, c, s, length / 2, width / 2, max(base - height, 0.0), base])


def inside_box(body: NDArray[np.float64], position: NDArray[np.float64]) -> bool:
    """Return True if a position (north, east, depth) [m], shape (3,), lies in a body of `box_body`."""
    north, east, c, s, half_length, half_width, top, base = body
    x, y = position[0] - north, position[1] - east
    return bool(abs(c * x + s * y) <= half_length and abs(c * y - s * x) <= half_width and top <= position[2] <= base)


def box_scatterers(
    box: Box, seabed_depth: float, seed: int, pitch: float, occluder: int, *, rise: float = np.inf,
    quadrature: bool = False, test: ReachTest | None = None,
) -> Scatterers:  # fmt: skip
    """Points on the faces of a box that are in contact with water, one jittered point in each cell.

    Args:
        box: The box.
        seabed_depth: Depth of the seabed it stands on [m].
        seed: Seed of the scenario.
        pitch: Largest side of a cell [m].
        occluder: Row of this box among the scene's occluders.
        rise: Largest height of a cell on the upright faces [m]; by default the pitch.
        quadrature: True: evenly spaced points, for an expectation.
        test: Test of spheres, given their middles (n, 3) and radii (n,) [m]: squares of `TILE` cells a side for
            which it is False have no points; by default all have.

    Returns:
        Scatterers whose random numbers depend on the seed and the box's label alone; none above the surface.
    """
    length, width = box.size[:2]
    top, base = box_body(box, seabed_depth)[6:]
    height = base - top
    axes = box_axes(box)
    along, across, up = axes
    centre = np.array([*box.position, base - height / 2])
    spans = {
        "fore": (along * length / 2, across * width, up * height),
        "aft": (-along * length / 2, across * width, up * height),
        "starboard": (across * width / 2, along * length, up * height),
        "port": (-across * width / 2, along * length, up * height),
        "top": (up * height / 2, along * length, across * width),
        "bottom": (-up * height / 2, along * length, across * width),
    }
    if base >= seabed_depth - _STANDING_TOLERANCE:
        del spans["bottom"]
    if top <= _STANDING_TOLERANCE:
        del spans["top"]
    upright = (pitch, min(pitch, rise))
    faces = [
        _face(f, centre, *spans[name], (pitch, pitch) if name in FLAT else upright, seed, box.label, quadrature, test)
        for f, name in enumerate(FACES)
        if name in spans
    ]
    position, normal, area, phase, scatterer_id = (np.concatenate(column) for column in zip(*faces, strict=True))
    return Scatterers(
        box.label, "target", box.scattering, position, normal, area, phase, scatterer_id, has_random_phase=True,
        occluder=occluder,
    )  # fmt: skip


def box_cells(box: Box, seabed_depth: float, pitch: float, rise: float) -> float:
    """Approximate number of cells on all faces of a box under water [1].

    Args:
        box: The box.
        seabed_depth: Depth of the seabed it stands on [m].
        pitch: Side of a cell [m].
        rise: Height of a cell on the upright faces [m].
    """
    length, width = box.size[:2]
    top, base = box_body(box, seabed_depth)[6:]
    return float(2 * length * width / pitch**2 + 2 * (length + width) * (base - top) / (pitch * min(pitch, rise)))


def box_section(
    scatterers: Scatterers, box: Box, sonar_position: Floats, bearing: float, width_in_beam: Callable[[float], float]
) -> Scatterers:
    """Section of a box by a slice: its faces projected into the plane, representing the part within the beam.

    Args:
        scatterers: Points on the faces of the box.
        box: The box.
        sonar_position: A point of the slice's vertical plane: north, east, ... [m].
        bearing: Bearing of that plane [rad].
        width_in_beam: Width within the two-way beam [m] as a function of a width across the plane, centred on it [m].

    Returns:
        The points of the faces that the plane cuts, moved into it; none if the plane misses the box.
        Approximation: beam and box are centred on each other.
    """
    plane_normal = np.array([-np.sin(bearing), np.cos(bearing)])
    axes = box_axes(box)[:2, :2]
    side = int(np.argmax(np.abs(axes @ plane_normal)))  # the edge that runs across the slice
    axis, extent = axes[side], box.size[side]
    cosine = axis @ plane_normal
    shift = -((scatterers.position[:, :2] - sonar_position[:2]) @ plane_normal) / cosine
    position = scatterers.position.copy()
    position[:, :2] += shift[:, None] * axis
    is_missed = abs((np.array(box.position) - sonar_position[:2]) @ plane_normal / cosine) > extent / 2
    across = np.abs(scatterers.normal[:, :2] @ axis) < 0.5
    included = np.zeros(len(scatterers), bool) if is_missed else across
    width = extent * abs(cosine)
    return replace(scatterers, position=position, area=scatterers.area * width_in_beam(width) / width).take(included)


def _face(
    face: int, centre: Floats, outward: Floats, first: Floats, second: Floats, pitch: tuple[float, float], seed: int,
    label: str, quadrature: bool, test: ReachTest | None,
) -> tuple[Floats, Floats, Floats, NDArray[np.complex128], NDArray[np.uint64]]:  # fmt: skip
    """Jittered points of one face.

    Args:
        face: Number of the face in `FACES`.
        centre: Centre of the box [m], shape (3,).
        outward: Vector from there to the middle of the face [m], shape (3,).
        first: Edge of the face [m], shape (3,).
        second: Other edge of the face [m], shape (3,).
        pitch: Largest side of a cell along both edges [m].
        seed: Seed of the scenario.
        label: Label of the box.
        quadrature: True: evenly spaced points.
        test: Test of spheres, as in `box_scatterers`; None: all cells have points.

    Returns:
        Position [m] (n, 3), unit normal (n, 3), area [m^2] (n,), unit phasor [1] (n,) and key (n,) of each point.
    """
    spans = [float(np.linalg.norm(first)), float(np.linalg.norm(second))]
    count = [int(np.ceil(span / max(side, span / 4095))) for span, side in zip(spans, pitch, strict=True)]
    if test is None:
        i, j = (index.ravel() for index in np.indices(count))
    else:
        i, j = _cells_in_reach((count[0], count[1]), centre + outward, first, second, test)
    label_hash = zlib.crc32(label.encode())
    u = random_keys.uniforms(seed, random_keys.TARGET, i, j, face, label_hash)
    if quadrature:
        u[:, 0], u[:, 1] = np.mod((j + 0.5) * _GOLDEN, 1), np.mod((i + 0.5) * _GOLDEN, 1)
    s, t = (i + u[:, 0]) / count[0] - 0.5, (j + u[:, 1]) / count[1] - 0.5
    position = centre + outward + s[:, None] * first + t[:, None] * second
    normal = np.broadcast_to(outward / np.linalg.norm(outward), position.shape)
    area = np.full(i.size, spans[0] * spans[1] / (count[0] * count[1]))
    return position, normal, area, np.exp(2j * np.pi * u[:, 2]), target_scatterer_id(label, face, i, j)


def _cells_in_reach(
    count: tuple[int, int], middle: Floats, first: Floats, second: Floats, test: ReachTest
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers of the cells of one face along both edges, in tiles that pass a test, tile by tile, each of shape (n,).

    Args:
        count: Cells along both edges.
        middle: Middle of the face [m], shape (3,).
        first: Edge along which the first number counts [m], shape (3,).
        second: Edge along which the second number counts [m], shape (3,).
        test: Test of spheres, as in `box_scatterers`.
    """
    tiles = [np.arange(0, n, TILE) for n in count]
    low, start = (index.ravel() for index in np.meshgrid(*tiles, indexing="ij"))
    high, stop = np.minimum(low + TILE, count[0]), np.minimum(start + TILE, count[1])
    s, t = (low + high) / 2 / count[0] - 0.5, (start + stop) / 2 / count[1] - 0.5
    half_s, half_t = (high - low) / 2 / count[0], (stop - start) / 2 / count[1]
    radius = np.hypot(half_s * np.linalg.norm(first), half_t * np.linalg.norm(second))
    rows = np.flatnonzero(test(middle + s[:, None] * first + t[:, None] * second, radius))
    i = (low[rows, None, None] + np.arange(TILE)[:, None]) + np.zeros(TILE, int)
    j = (start[rows, None, None] + np.arange(TILE)) + np.zeros((TILE, 1), int)
    inside = (i < count[0]) & (j < count[1])
    return i[inside], j[inside]
