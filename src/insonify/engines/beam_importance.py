"""Importance sampling of scatterers by the two-way beam gain: all within the beam, few far outside it.

A scatterer is kept where its priority, which belongs to its position, lies below a keep probability; its area is
divided by that probability. The probability is one wherever the two-way gain is within 14 dB of the largest at the same
distance. Below, it falls with the square of the gain's envelope, so that each scatterer kept is about as strong as one
at that edge; far below, it is proportional to the envelope, because far side lobes alone fill a wide shadow. Every
path, beam and element of a ping has the same scatterers, so that coherence is preserved; from ping to ping, scatterers
change only where probabilities are below one. The mean is unbiased for any keep probability.

Recorded elements that are not focused to a synthetic aperture receive from more directions than one beam: their keep
probability falls from 14 dB below the largest gain on, and with the square of the gain throughout.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.engines import _gain_envelope_arrays as _gain_envelope_arrays  # stand-ins of the kernels
from insonify.engines import _gain_envelope_kernel as kernel
from insonify.engines import _keep_probability_kernel as keep_kernel
from insonify.engines._draw_kernel import KeptScatterers, TileRows, draw_and_keep
from insonify.engines._keep_probability_kernel import GainBounds
from insonify.engines.face_images import FaceImage
from insonify.engines.glint_spread import GlintSpread, spread_gain_tables
from insonify.propagation.propagation_model import PropagationModel, departure_cones
from insonify.scene.drawn_tiles import DrawnTiles
from insonify.scene.scatterer_grid import PARTS, TILE, ScattererGrid, Tiles, max_point_count, prefix_sizes
from insonify.scene.scatterers import grid_scatterer_id
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

Integers = NDArray[np.int64]
BEAM_EDGE_DB = -14.0
"""Two-way gain of a beam, re the largest gain at its distance, above which every scatterer is kept [dB]."""
ELEMENT_EDGE_DB = -14.0
"""Two-way gain of recorded elements, re the largest gain at its distance, above which every scatterer is kept [dB]."""
LINEAR_BELOW = 0.25
"""Gain of a beam, re that edge, below which keep probabilities are proportional to it, no longer to its square: only
far side lobes fill a wide shadow [1]."""
MIN_KEEP_PROBABILITY = 0.001
"""Smallest keep probability [1]."""
PEAK_RATIO = 0.7
"""Largest gain at a corner of a part, re its largest gain, above which gains are interpolated from corners [1]."""
MIN_GAIN = 1e-300
"""Least gain by which another is divided [1]."""
FIRST_NODE = 0.05
"""Distance of the first of the nodes, at which rays and the largest gain are computed; the n-th is n^2 as far [m]."""
BEARINGS = 900
"""Number of bearings on each ring, over which a mean keep probability is taken."""
GOLDEN_RATIO = 0.5 * (1 + math.sqrt(5))
SECTORS = 16
"""Number of sectors in which the largest gain is searched first."""
MIN_SCATTERERS_BY_PART = 48
"""Number of kept scatterers of a tile up to which it is evaluated as a whole, not part by part."""
HALVINGS = 12
"""Largest number of halvings of a sector."""
GAIN_TOLERANCE = 1.05
"""Ratio to which the largest gain is found [1]."""


class KeepProbabilities(NamedTuple):
    """Keep probabilities of the scatterers of n tiles, part by part."""

    density: Floats
    """See `GainBounds`, shape (n,)."""
    max_probability: Floats
    """Largest keep probability anywhere in each part, shape (n, PARTS, PARTS); no scatterer is given more."""
    corner: Floats
    """Gain at the corners of the parts, re that above which all are kept, shape (n, PARTS + 1, PARTS + 1)."""
    is_peaked: NDArray[np.bool_]
    """True for parts with a gain much larger than at their corners, shape (n, PARTS, PARTS)."""


@dataclass(frozen=True)
class BeamImportance:
    """Two-way gain and keep probabilities over one flat boundary at one ping."""

    ping_geometry: PingGeometry
    depth: float
    """Depth of the boundary [m]."""
    rays: PropagationModel
    families: tuple[str, ...]
    """Families that reach it."""
    scatterer_grid: ScattererGrid
    farthest: float
    """Largest distance from the middle between both ends that is evaluated [m]."""
    importance_sampling: bool = True
    """False: all scatterers are kept."""
    glints: GlintSpread | None = None
    """Angular spread of legs by a moving surface; None: it is still."""
    images: tuple[FaceImage, ...] = ()
    """Images of the sonar in faces; the gain is the largest of those of the sonar and of its images."""

    def bounds(self, tiles: Tiles, density: Floats) -> GainBounds:
        """Upper bounds of the gain over some tiles, part by part for those with many scatterers.

        Args:
            tiles: The tiles.
            density: Fraction of their scatterers that fills the sonar's cells [1], shape (n,).
        """
        row, no_parts = np.full(len(density), -1), np.empty((0, PARTS, PARTS))
        # the largest gain at a distance is known for one origin only
        if self.ping_geometry.receive_track_extent is not None or not self.importance_sampling:
            return GainBounds(density, np.ones(len(density)), np.ones(len(density)), row, no_parts)
        every, around = np.arange(len(density)), TILE * tiles.pitch * np.sqrt(0.5)
        position = self._positions(tiles, every, np.array([0.5]))
        tile_gain, centre_gain = self._relative_gain(position, around), self._relative_gain(position)
        many_scatterers = np.flatnonzero(density * self._keep_probability(tile_gain) * TILE**2 > MIN_SCATTERERS_BY_PART)
        row[many_scatterers] = np.arange(len(many_scatterers))
        position = self._positions(tiles, many_scatterers, (np.arange(PARTS) + 0.5) / PARTS)
        parts = self._relative_gain(position, np.repeat(around[many_scatterers] / PARTS, PARTS**2))
        return GainBounds(density, tile_gain, centre_gain, row, parts.reshape(-1, PARTS, PARTS))

    def expected(self, bounds: GainBounds) -> Floats:
        """Expected number of kept scatterers of each tile [1], shape (n,)."""
        probability, in_parts = self._keep_probability(bounds.tile_gain), bounds.row >= 0
        probability[in_parts] = self._keep_probability(bounds.part_gains[bounds.row[in_parts]]).mean(axis=(1, 2))
        return bounds.density * probability * TILE**2

    def keep_probabilities(self, tiles: Tiles, bounds: GainBounds) -> KeepProbabilities:
        """Keep probabilities of the scatterers of some tiles."""
        by_part, nonuniform = keep_kernel.classify_tiles(bounds.tile_gain, bounds.centre_gain, bounds.row, PEAK_RATIO)
        at_parts = self._relative_gain(self._positions(tiles, by_part, np.arange(PARTS + 1) / PARTS))
        at_ends = self._relative_gain(self._positions(tiles, nonuniform, np.arange(2.0)))
        count = len(bounds.row)
        corner, largest = np.empty((count, PARTS + 1, PARTS + 1)), np.empty((count, PARTS, PARTS))
        keep_kernel.interpolate_corner_gains(bounds, by_part, at_parts, nonuniform, at_ends, corner, largest)
        if self.images:
            self._fill_parts_lit_by_faces(tiles, corner, largest)
        peaked, max_probability = np.empty(largest.shape, np.bool_), np.empty(largest.shape)
        keep_kernel.find_peaked_parts(
            corner, largest, bounds, PEAK_RATIO, self._linear_below, MIN_KEEP_PROBABILITY, peaked, max_probability
        )
        return KeepProbabilities(bounds.density, max_probability, corner, peaked)

    def _fill_parts_lit_by_faces(self, tiles: Tiles, corner: Floats, largest: Floats) -> None:
        """Raise the gains at the corners of parts where the gain by faces is larger than that without.

        There the gain has no peak, and all scatterers of a part have one keep probability.

        Args:
            tiles: The tiles.
            corner: Gains at the corners, overwritten, shape (n, PARTS + 1, PARTS + 1).
            largest: Largest gain in each part, overwritten, shape (n, PARTS, PARTS).
        """
        count = len(corner)
        position = self._positions(tiles, np.arange(count), (np.arange(PARTS) + 0.5) / PARTS)
        around = np.repeat(TILE * tiles.pitch * np.sqrt(0.5) / PARTS, PARTS**2)
        face_gain, direct = self._face_gain(position, around), self._direct_gain(position, around)
        gain = np.where(face_gain > direct, face_gain, 0.0).reshape(count, PARTS, PARTS)
        for i in (0, 1):
            for j in (0, 1):
                part = corner[:, i : PARTS + i, j : PARTS + j]
                np.maximum(part, gain, out=part)
        np.copyto(largest, gain, where=gain > 0)

    def _relative_gain(self, position: Floats, around: Floats | None = None) -> Floats:
        """Gain at some positions, or the largest within a radius [m] of them, re that above which all are kept."""
        around = np.zeros(len(position)) if around is None else around
        gain = self._direct_gain(position, around)
        return np.maximum(gain, self._face_gain(position, around)) if self.images else gain

    def _direct_gain(self, position: Floats, around: Floats) -> Floats:
        """Gain of the beams, without faces, as `_relative_gain`."""
        gain = np.empty(len(position))
        if len(position):
            kernel.gain_re_threshold(self._gains, position, np.array(around), gain)  # writable, as all others
        return gain

    def _face_gain(self, position: Floats, around: Floats) -> Floats:
        """Gain of the images of the sonar in faces, as `_relative_gain`."""
        gain = np.zeros(len(position))
        for face_image, image in zip(self.images, self._image_importances, strict=True):
            rows = face_image.lights(position, self.depth, around)
            gain[rows] = np.maximum(gain[rows], image._direct_gain(position[rows], around[rows]))
        return gain

    @cached_property
    def _image_importances(self) -> tuple["BeamImportance", ...]:
        """Gain of each image of the sonar, as if there were no face."""
        return tuple(
            replace(
                self, ping_geometry=face_image.sonar, families=face_image.families, images=(),
                farthest=self.farthest + float(np.linalg.norm(face_image.sonar.midpoint - self.ping_geometry.midpoint)),
            ) for face_image in self.images
        )  # fmt: skip

    def kept_scatterers(
        self, tiles: Tiles, bounds: GainBounds, drawn_tiles: DrawnTiles, density: Floats
    ) -> KeptScatterers:
        """The scatterers of some tiles that are kept, on the boundary's terrain.

        Args:
            tiles: The tiles.
            bounds: Bounds of the gain over these tiles.
            drawn_tiles: Scatterers of the boundary.
            density: Largest fraction of a tile's scatterers that any ping keeps [1], shape (tiles,).
        """
        keep_probabilities = self.keep_probabilities(tiles, bounds)
        count = max_point_count(keep_probabilities.max_probability)
        kept = KeptScatterers(
            np.empty((count, 3)), np.empty((count, 3)), np.empty(count), np.empty(count, complex),
            np.empty(count, np.uint64),
        )  # fmt: skip
        first_key = grid_scatterer_id(drawn_tiles.stream, tiles.scale, tiles.along * TILE, tiles.across * TILE)
        probabilities = (
            keep_probabilities.density,
            keep_probabilities.max_probability,
            keep_probabilities.corner,
            keep_probabilities.is_peaked,
            self._linear_below,
            MIN_KEEP_PROBABILITY,
        )
        key = random_keys.stream_key(drawn_tiles.seed, drawn_tiles.stream)
        plane = self.depth, -1.0 if drawn_tiles.boundary == "seabed" else 1.0
        with drawn_tiles.reading(tiles, prefix_sizes(keep_probabilities.max_probability, density)) as (drawn, start):
            rows = TileRows(tiles, drawn, start, first_key)
            count = draw_and_keep(rows, key, probabilities, self._gains, self.scatterer_grid.frame, plane, kept)
        return kept.first(count)

    def gain_at(self, position: Floats, around: Floats | None = None) -> Floats:
        """Largest two-way gain at or about some positions, re that above which all scatterers are kept [1], shape (n,).

        Args:
            position: North and east [m], shape (n, 2).
            around: Distance from each position within which the gain is the largest [m], shape (n,); None: at the
                position.
        """
        return self._relative_gain(position, around)

    def keep_probability_of(self, gain: Floats) -> Floats:
        """Keep probability of the points where the gain is that of `gain_at` [1], any shape."""
        return self._keep_probability(gain) if self.importance_sampling else np.ones(gain.shape)

    def mean_keep_probability(self, distance: Floats) -> Floats:
        """Keep probability of scatterers, mean over all bearings [1], shape (n,).

        Args:
            distance: Distance from the middle between both ends [m], shape (n,).
        """
        if not self.importance_sampling:
            return np.ones(len(distance))
        gain = self._relative_gain(self.ring_positions(distance))
        return np.asarray(self._keep_probability(gain).reshape(len(distance), BEARINGS).mean(axis=1))

    def ring_positions(self, distance: Floats) -> Floats:
        """North and east of positions all round on rings about the midpoint [m], shape (n * BEARINGS, 2).

        Bearings of successive rings differ by golden ratios of their step: a narrower beam is hit by some rings.

        Args:
            distance: Radius of each ring [m], shape (n,).
        """
        row = np.arange(BEARINGS) + (np.arange(len(distance)) * GOLDEN_RATIO % 1)[:, None]
        bearing = row * (2 * np.pi / BEARINGS)
        offset = distance[:, None, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
        return np.asarray((self.ping_geometry.midpoint + offset).reshape(-1, 2))

    def _positions(self, tiles: Tiles, rows: Integers, part: Floats) -> Floats:
        """North and east of a square lattice of positions in some tiles, see `grid_positions` [m], (m k^2, 2)."""
        position = np.empty((len(rows) * len(part) ** 2, 2))
        keep_kernel.grid_positions(*tiles, rows, part, self.scatterer_grid.frame, position)
        return position

    def _keep_probability(self, gain: Floats) -> Floats:
        """Keep probability of scatterers by the gain re that above which all are kept [1], shape of `gain`."""
        probability = np.empty(gain.shape)
        keep_kernel.keep_probabilities(np.ravel(gain), self._linear_below, MIN_KEEP_PROBABILITY, probability.ravel())
        return probability

    @property
    def _linear_below(self) -> float:
        """Gain re the threshold below which keep probabilities are proportional to it, not to its square [1]."""
        return 0.0 if self._needs_all_directions else LINEAR_BELOW

    @cached_property
    def _gains(self) -> kernel.EnvelopeArguments:
        """First argument of `gain_re_threshold`."""
        transmit, receive = self._ends
        return (
            transmit,
            receive,
            transmit is receive,
            self._threshold_gain,
            float(_nodes(self.farthest)[-1]),
            self.ping_geometry.midpoint,
            MIN_GAIN,
        )

    @cached_property
    def _threshold_gain(self) -> Floats:
        """Two-way pressure gain above which all scatterers are kept, at the nodes of distance [1], (nodes,)."""
        return np.asarray(
            self._max_gain * amplitude_ratio(ELEMENT_EDGE_DB if self._needs_all_directions else BEAM_EDGE_DB)
        )

    @property
    def _needs_all_directions(self) -> bool:
        """Return True if elements are recorded that are not processed to a synthetic aperture."""
        return self.ping_geometry.elements is not None and self.ping_geometry.pulse.receiver.synthetic_aperture is None

    @cached_property
    def _max_gain(self) -> Floats:
        """Envelope of the largest two-way pressure gain at each node [1], within `GAIN_TOLERANCE` of it, (nodes,)."""
        distance, (transmit, receive) = _nodes(self.farthest), self._ends
        sectors = self.ping_geometry.first_beam_bearing + (2 * np.arange(SECTORS) + 1) * (np.pi / SECTORS)
        best = np.empty(len(distance))
        kernel.max_two_way_gain(
            transmit, receive, transmit is receive, distance, self.ping_geometry.midpoint, np.array(self._axes),
            sectors, HALVINGS, GAIN_TOLERANCE, best,
        )  # fmt: skip
        return best

    @property
    def _axes(self) -> list[float]:
        """Bearings of the axes of some beams [rad], where the positions of largest gain are likely to lie."""
        bearings = {self.ping_geometry.first_beam_bearing}
        for beams in (self.ping_geometry.transmit_beams, self.ping_geometry.receive_beams):
            across, deep = beams.steer[:: max(1, len(beams.steer) // SECTORS)].T
            forward = np.sqrt(np.maximum(1 - across**2 - deep**2, 0))
            direction = np.stack([forward, across, deep], axis=-1) @ beams.axes
            bearings |= set(np.arctan2(direction[:, 1], direction[:, 0]).tolist())
        return sorted(bearings)

    @cached_property
    def _ends(self) -> tuple[kernel.EnvelopeEnd, kernel.EnvelopeEnd]:
        """Transmitter and receiver; one object twice where they and their beams are the same."""
        geometry = self.ping_geometry
        separation = float(np.linalg.norm(geometry.transmit_position - geometry.receive_position))
        transmit = self._end(geometry.transmit_position, geometry.transmit_beams, self.farthest + separation)
        if geometry.is_monostatic and geometry.same_beams:
            return transmit, transmit
        farthest = self.farthest + separation
        return transmit, self._end(geometry.receive_position, geometry.bounding_receive_beams, farthest)

    def _end(self, position: Floats, beams: Beams, farthest: float) -> kernel.EnvelopeEnd:
        """Transmitter or receiver, with departure angles of rays to distances up to `farthest` [m]."""
        distance = np.maximum(_nodes(farthest), 1e-6)
        centre = position[:2] + distance[:, None] * [1.0, 0.0]
        sines = np.empty((len(self.families), len(distance)))
        for row, name in enumerate(self.families):
            cones = departure_cones(self.rays, name, position, centre, np.zeros(len(distance)), self.depth)
            sines[row] = np.where(cones.exists, cones.axis[:, 2], np.nan)
        spread, sines = self._spread(beams, float(position[2]), distance, sines)
        return (
            position,
            sines,
            float(distance[-1]),
            abs(self.depth - float(position[2])),
            beams.kernel_majorants,
            spread,
        )

    def _spread(
        self, beams: Beams, source_depth: float, distance: Floats, sines: Floats
    ) -> tuple[kernel.RaySpreads, Floats]:
        """Amplitudes and angular spreads of the rays of one end, and their sines with rows of glints appended."""
        glint_rows = [] if self.glints is None else [
            (row, legs) for row, name in enumerate(self.families)
            if (legs := self.glints.legs(name, source_depth, distance, self.depth)) is not None
        ]  # fmt: skip
        count = len(sines)
        glinting = np.arange(count + len(glint_rows)) >= count
        if self.glints is None or not glint_rows:
            empty = np.empty((count, 0))
            return kernel.RaySpreads(empty, empty, empty, glinting, np.zeros(3), (empty, empty, empty, empty)), sines
        amplitude, (tilt, turn) = np.ones((len(glinting), len(distance))), np.zeros((2, len(glinting), len(distance)))
        for to, (row, legs) in enumerate(glint_rows, count):
            amplitude[row], amplitude[to], tilt[to], turn[to] = (
                legs.coherent,
                legs.glints,
                legs.elevation_change,
                legs.bearing_change,
            )
        spread = kernel.RaySpreads(
            amplitude, tilt, turn, glinting, np.array(self.glints.slopes), spread_gain_tables(beams)
        )
        return spread, np.concatenate([sines, sines[[row for row, _ in glint_rows]]])


@keep_kernel.keep_probabilities.stand_in
def _keep_probabilities(gain: Floats, linear_below: float, min_probability: float, probability: Floats) -> None:
    """Fill keep probabilities (n,); arguments are those of the kernel `keep_probabilities`."""
    gain = np.minimum(gain, 1.0)
    probability[:] = np.clip(np.maximum(gain * gain, linear_below * gain), min_probability, 1.0)


def _nodes(farthest: float) -> Floats:
    """Distances of the nodes, up to one beyond the farthest [m]; the farthest changes only their number."""
    return np.asarray(FIRST_NODE * np.arange(np.ceil(np.sqrt(farthest / FIRST_NODE)) + 2) ** 2)
