"""Tables of fast reverberation that its kernels read and write: radials, their samples, legs and pairs of legs."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]


class RadialFrame(NamedTuple):
    """Start of the radials of one ping, in the frame of the seabed's height map."""

    origin_along: float
    """Distance of the sonar along the frame's first axis from the first node of the map's window [m]."""
    origin_across: float
    """Distance of the sonar along its second axis from that node [m]."""
    heading: float
    """Heading of the first axis [rad]."""
    step: float
    """Least spacing of samples along a radial [m]."""


class SampleLists(NamedTuple):
    """Samples at which any pair of families is evaluated: one list of points for each radial, in columns of n points.

    Each pair of families is evaluated at some points of a list, the rows of its columns.
    """

    list_offsets: Integers
    """First point of each list, and n, (lists + 1,)."""
    sample_counts: Integers
    """Number of samples of the radial from the sonar up to the last point of each list, (lists,)."""
    family_bits: Integers
    """Families requested at any point of each list, a bit for each, (lists,)."""
    needed_horizons: NDArray[np.bool_]
    """True for the launch horizons that the families of each list need, (lists, horizons)."""
    sample_number: Integers
    """Index of each point among the samples of its radial, (n,)."""
    requested_families: Integers
    """Families requested at each point, a bit for each, (n,)."""
    distance: Floats
    """Horizontal distance of each point from the sonar [m], (n,)."""
    beam_bearing: Singles
    """North and east component of the bearing at which the beams are evaluated for each point [1], (2, n)."""
    pair_offsets: Integers
    """First row of each pair of each list, and the end of the last, (lists, p + 1)."""
    pair_points: Integers
    """Index of a point in its list, for each row, (number of rows,)."""
    inverse_probability: Singles
    """One over the keep probability of the point, for each row [1], (number of rows,)."""
    interference_offsets: Integers
    """First row of each list in `interference_ranges`, and the number of rows, (lists + 1,)."""
    interference_ranges: Integers
    """First point, and the one after the last, of each range of a list's points in which pairs may arrive within one
    pulse, (ranges, 2)."""


class RadialSet(NamedTuple):
    """Radials of one ping with the lists of their samples."""

    radials: Floats
    """Columns of `radial_columns`, (s, 9)."""
    lists: SampleLists
    """Lists of points."""
    list_rows: NDArray[np.int64]
    """Row in `lists` of each radial, (s,)."""
    passes_target: NDArray[np.bool_]
    """True for radials that may pass a target, (s,)."""


class IsovelocityChannel(NamedTuple):
    """Water of one sound speed between a flat surface and the mean seabed.

    In layered water its straight rays are those with which a `RefractionTable` compares refracted ones.
    """

    sonar_depth: float
    """Depth of the sonar [m]."""
    water_depth: float
    """Depth of the mean seabed [m]."""
    sound_speed: float
    """Sound speed of straight rays, in layered water that at the sonar [m/s]."""
    wavelength: float
    """Acoustic wavelength [m]."""
    terrain_span: tuple[float, float]
    """Least and greatest depth of the seabed with its relief [m]."""


class RefractionTable(NamedTuple):
    """Refracted rays of f families and h launch horizons on a grid of distances and depths, re straight rays.

    Without nodes the water has one sound speed, and rays are straight.
    """

    first_depth: float
    """Least depth of the grid [m]."""
    depth_spacing: float
    """Spacing of its depths [m]."""
    range_spacing: float
    """Spacing of its horizontal distances, the first of which is 0 [m]."""
    nodes: Singles
    """Columns of `refraction_columns`, (f, depths, distances, 8)."""
    horizon_climb: Singles
    """Horizontal distance times launch slope of the rays to each node by launch horizon [m], NaN for none,
    (h, depths, distances)."""
    clear_bounces: NDArray[np.bool_]
    """True for families whose rays no seabed occludes before their last bounce, (f,)."""
    bed_speed: float
    """Sound speed at the mean seabed [m/s]."""


STRAIGHT = RefractionTable(
    0.0, 1.0, 1.0, np.zeros((0, 2, 2, 8), np.float32), np.zeros((0, 2, 2), np.float32), np.zeros(0, bool), 1.0
)
"""Table of water of one sound speed."""


class FamilyTable(NamedTuple):
    """Bounces of the f families that reach the seabed, their image sources and their launch horizons.

    A leg is cut by terrain where a ray of one of its segments would reach the seabed before the segment's end. So each
    segment, with the bounces before it, has a launch horizon; families with the same first bounces share it.
    """

    image_depths: Floats
    """Depth of the image source of each family [m], (f,)."""
    bounce_codes: Integers
    """Bounces of each family from the sonar outwards, 1 surface, 2 bottom, 0 no more, (f, most)."""
    horizon_row: Integers
    """Row of the launch horizon of each segment of each family, (f, most + 1)."""
    horizon_image_depths: Floats
    """Depth of the image source of each launch horizon [m], (horizons,)."""
    horizon_rising: NDArray[np.bool_]
    """True for launch horizons of segments that begin at the bottom, (horizons,)."""
    reflection_products: NDArray[np.complex64]
    """Product of the reflection coefficients of a family, over evenly spaced sines of the grazing angle at the mean
    seabed, 0 to 1 [1], (f, nodes)."""
    direction_factor: Singles
    """`CompiledLaw.direction_factors` of a law that is a product of one factor for each leg [1]; else empty."""
    absorption_exponent: float
    """Absorption as the base-2 exponent of pressure [1/m]."""
    refraction: RefractionTable = STRAIGHT
    """Rays of layered water."""


class MapTiles(NamedTuple):
    """Tiles of the seabed's height map in the window of one ping."""

    cell_size: float
    """Side of a cell [m]."""
    tile_row: Integers
    """Row in `nodes` of each tile of the window, (along, across)."""
    nodes: Singles
    """Height [m] and slopes [1] on nodes, (tiles, 65, 65, 3)."""
    is_flat: bool
    """True for a flat seabed, which has no map."""


class RadialLegs(NamedTuple):
    """Columns of the n samples of some radials, and of their legs by f families."""

    radial_offsets: NDArray[np.int64]
    """First sample of each radial, and n, (s + 1,)."""
    range_depth: Floats
    """Horizontal distance and depth of each sample [m], (2, n)."""
    normal: Singles
    """Unit normal into the water, (3, n)."""
    delay: Floats
    """One-way travel time [s], (f, n)."""
    amplitude: NDArray[np.complex64]
    """Pressure re the source at 1 m, times the root of the direction factor if there is one [1]; 0 without a path,
    (f, n)."""
    departure: Singles
    """Direction of travel at the sonar, in the world [1], (f, 3, n)."""
    arrival: Singles
    """Direction of travel at the sample, in the world [1], (f, 3, n)."""


class PairSamples(NamedTuple):
    """Samples at which each of p pairs of families is evaluated."""

    rows: NDArray[np.int32]
    """Indices of the samples of each pair in `RadialLegs`, (p, most)."""
    weight: Singles
    """Area of seabed that each sample represents [m^2], later times the cross section per area, (p, most).

    With a direction factor the cross section is in the amplitudes of the legs instead.
    """
    sample_count: NDArray[np.int64]
    """Number of samples, (p,)."""
