"""Tables of fast reverberation that its compiled functions read and write: tuples of arrays."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]


class RadialFrame(NamedTuple):
    """Start of the radials of one ping, in the frame of the seabed's map."""

    along: float
    """Distance along the frame's first axis from the first node of the map's window [m]."""
    across: float
    """Distance along its second axis [m]."""
    heading: float
    """Heading of the first axis [rad]."""
    step: float
    """Shortest distance of samples along a radial [m]."""


class SampleLists(NamedTuple):
    """Lists of samples, each of one line, and of those of them that each pair takes."""

    first: Integers
    """First point of each list, (lists + 1,)."""
    samples: Integers
    """Samples of the line from the sonar up to the last point of each list, (lists,)."""
    families: Integers
    """Families requested at any point of each list, a bit for each, (lists,)."""
    passed: NDArray[np.bool_]
    """Rows of launches that any of these passes by, (lists, paths)."""
    sample: Integers
    """Number of each point along its line, (n,)."""
    requested: Integers
    """Families requested at each point, a bit for each, (n,)."""
    reach: Floats
    """Horizontal distance of each point [m], (n,)."""
    ahead: Singles
    """North and east of the bearing at which the beams are evaluated there [1], (2, n)."""
    pair_first: Integers
    """First row of each pair in each list, (lists, p + 1)."""
    row: Integers
    """Number of the point in its list, (rows,)."""
    more: Singles
    """Number of points that each row represents [1], (rows,)."""
    close_first: Integers
    """First range of each list, (lists + 1,)."""
    close: Integers
    """First point and after the last, in the list, of ranges where pairs may arrive within one pulse, (any, 2)."""


class RadialSet(NamedTuple):
    """Radials of one ping with the lists of their samples."""

    radials: Floats
    """One row each, (s, 9): cosine and sine in the frame of the map; width of its cell [rad]; width over which the beam
    is evaluated in turn, 0 for its middle alone [rad]; start and stop of what is received [m]; position of its first
    sample in its own steps; its number; its own step in steps of the frame."""
    lists: SampleLists
    """Lists of points."""
    taken: NDArray[np.int64]
    """Row in `lists` of each radial, (s,)."""
    passes_target: NDArray[np.bool_]
    """Radials that may pass a target, (s,)."""


class IsovelocityChannel(NamedTuple):
    """Water of one sound speed between a flat surface and the mean seabed."""

    source: float
    """Depth of the sonar [m]."""
    water_depth: float
    """Depth of the mean seabed [m]."""
    speed: float
    """Sound speed [m/s]."""
    wavelength: float
    """Acoustic wavelength [m]."""


class FamilyTable(NamedTuple):
    """Bounces of the f families that reach the seabed, and the image sources of their segments."""

    images: Floats
    """Depth of the image source of each family [m], (f,)."""
    bounce_codes: Integers
    """Bounces of each family, 1 surface, 2 bottom, 0 no more, (f, most)."""
    horizon_row: Integers
    """Row of launches of what has been passed up to each segment, (f, most + 1)."""
    launch_image_depths: Floats
    """Depth of the image source of each row of launches [m], (rows,)."""
    launch_rising: NDArray[np.bool_]
    """True if its last bounce is off the bottom, (rows,)."""
    reflection_products: NDArray[np.complex64]
    """Product of all bounces of a family, over evenly spaced sines of the grazing angle [1], (f, nodes)."""
    factor: Singles
    """Direction factor of a law that is a product of two, see `CompiledLaw.factor`; empty for any other."""
    loss: float
    """Absorption [octaves of pressure/m]."""


class MapTiles(NamedTuple):
    """Tiles of the seabed's map in the window of one ping."""

    cell: float
    """Side of a cell [m]."""
    slot: Integers
    """Row in `nodes` of each tile of the window, (any, any)."""
    nodes: Singles
    """Height [m] and slopes [1] on nodes, (tiles, 65, 65, 3)."""
    flat: bool
    """True for a flat seabed, which has no map."""


class RadialLegs(NamedTuple):
    """Columns of the n samples of some radials, and of their legs by f families."""

    first: NDArray[np.int64]
    """First sample of each radial, and the number of all, (s + 1,)."""
    point: Floats
    """Horizontal distance and depth of each sample [m], (2, n)."""
    normal: Singles
    """Unit normal into the water, (3, n)."""
    delay: Floats
    """One-way travel time [s], (f, n)."""
    amplitude: NDArray[np.complex64]
    """Pressure re 1 m, times the root of the direction's factor if there is one [1]; 0 without a path, (f, n)."""
    departure: Singles
    """Direction of travel at the sonar, in the world, (f, 3, n)."""
    arrival: Singles
    """Direction of travel at the sample, (f, 3, n)."""


class PairSamples(NamedTuple):
    """Samples at which each of p pairs of families is evaluated."""

    rows: NDArray[np.int32]
    """Samples of each pair, (p, most)."""
    weight: Singles
    """Area of seabed that each stands for [m^2], (p, most)."""
    sample_count: NDArray[np.int64]
    """Number of samples, (p,)."""
