"""Which scatterers one ping asks for: all where a beam looks, few where it hardly listens.

A scatterer is kept where its priority, which belongs to its place, lies below a share, and stands for as much more
ground as others beside it were left out. The share is one wherever the two-way gain is within 14 dB of the loudest at
its distance. It falls with the square of the gain's envelope below, so that each that is left is about as loud as one
at that edge; far below, only with the envelope, for side lobes far out are all that fills a wide shadow. Every path,
beam and element of a ping has the same scatterers, so that what is coherent stays so; from ping to ping they come and
go only where shares are below one. The mean is that of all scatterers, whatever the share is.

Recorded elements that are to be steered as one aperture each hear more than the beams that will be made of them: their
share falls from 14 dB below the loudest on, and with the square of the gain all the way.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _loudness_kernel as kernel
from insonify.propagation.rays import Rays
from insonify.scene.lattice import PARTS, SIDE, TILE, Draw, Lattice, Tiles, below
from insonify.sonar.beam import Beams
from insonify.sonar.stance import Stance
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

_BETWEEN = np.einsum(
    "ai,bj->abij", *(np.stack([np.arange(PARTS, -1, -1), np.arange(PARTS + 1)]) / PARTS for _ in range(2))
).reshape(4, -1)
"""Weights of the four corners of a tile at the corners of its parts."""
Integers = NDArray[np.int64]
BEAM_EDGE_DB = -14.0
"""Two-way gain of a beam, re the loudest at its distance, above which every scatterer is kept [dB]."""
ELEMENT_EDGE_DB = -14.0
"""The same for recorded elements."""
FEWER = 0.25
"""Gain of a beam, re that edge, below which shares fall no longer with its square, but with it: side lobes far out are
all that fills a wide shadow [1]."""
LEAST = 0.001
"""Smallest share."""
PEAK = 0.7
"""Loudest corner of a part, re its loudest place, above which scatterers are judged by the corners [1]."""
FAINTEST = 1e-300
"""Least gain that others are compared with."""
FIRST_NODE = 0.05
"""Distance of the first of the nodes, at which rays and the loudest gain are worked out; the n-th is n^2 as far [m]."""
BEARINGS = 3600
"""Bearings over which a mean share is taken."""
SECTORS = 16
"""Sectors in which the loudest direction is looked for first."""
FEW = 48
"""Scatterers of a tile below which it is judged as a whole, not part by part."""
HALVINGS = 12
"""Of a sector, at most."""
CLOSE = 1.05
"""Ratio to which the loudest gain is found [1]."""


class Bounds(NamedTuple):
    """How loud n tiles are at most, before anything is drawn in them."""

    density: Floats
    """Share of their scatterers that fills the sonar's cells: the lattice's come in powers of two, shape (n,)."""
    whole: Floats
    """Loudest gain anywhere in each, re that above which all are kept, shape (n,)."""
    middle: Floats
    """Gain in the middle of each, likewise."""
    row: Integers
    """Row in `parts` of each, -1 for one with few scatterers that is judged as a whole, shape (n,)."""
    parts: Floats
    """The loudest gain in each part of some tiles, shape (any, PARTS, PARTS)."""

    def take(self, rows: slice) -> "Bounds":
        """Those of some tiles."""
        return Bounds(self.density[rows], self.whole[rows], self.middle[rows], self.row[rows], self.parts)


class Shares(NamedTuple):
    """How many of the scatterers of n tiles one ping keeps, part by part."""

    density: Floats
    """As of `Bounds`, shape (n,)."""
    most: Floats
    """Largest share anywhere in each part, shape (n, PARTS, PARTS); no scatterer is given more."""
    corner: Floats
    """Gain at the corners of the parts, re that above which all are kept, shape (n, PARTS + 1, PARTS + 1)."""
    peaked: NDArray[np.bool_]
    """Parts that hold a place much louder than their corners, shape (n, PARTS, PARTS)."""


@dataclass(frozen=True)
class Loudness:
    """How loud one ping hears the places of one level boundary."""

    stance: Stance
    depth: float
    """Of the boundary [m]."""
    rays: Rays
    families: tuple[str, ...]
    """Families that reach it."""
    lattice: Lattice
    farthest: float
    """Distance from the middle between both ends that is asked about at most [m]."""

    def bounds(self, tiles: Tiles, density: Floats) -> Bounds:
        """How loud some tiles are at most, those with many scatterers part by part.

        Args:
            tiles: The tiles.
            density: Share of their scatterers that fills the sonar's cells, shape (n,).
        """
        row, none = np.full(len(density), -1), np.empty((0, PARTS, PARTS))
        if self.stance.receive_survey is not None:  # what is loudest at a distance is told of one place only
            return Bounds(density, np.ones(len(density)), np.ones(len(density)), row, none)
        around, place = TILE * tiles.pitch * np.sqrt(0.5), self._places(tiles, np.array([0.5]))
        whole, middle = self._at(place, around), self._at(place)
        many = np.flatnonzero(density * self._share(whole) * TILE**2 > FEW)
        row[many] = np.arange(len(many))
        place = self._places(tiles.take(many), (np.arange(PARTS) + 0.5) / PARTS)
        parts = self._at(place, np.repeat(around[many] / PARTS, PARTS**2))
        return Bounds(density, whole, middle, row, parts.reshape(-1, PARTS, PARTS))

    def expected(self, bounds: Bounds) -> Floats:
        """Scatterers of each tile that are likely to be drawn [1], shape (n,)."""
        share, many = self._share(bounds.whole), bounds.row >= 0
        share[many] = self._share(bounds.parts[bounds.row[many]]).mean(axis=(1, 2))
        return bounds.density * share * TILE**2

    def shares(self, tiles: Tiles, bounds: Bounds) -> Shares:
        """Shares in some tiles, few enough that the answer is small.

        Args:
            tiles: The tiles.
            bounds: Of these tiles.
        """
        many = np.flatnonzero(bounds.row >= 0)
        loudest = np.repeat(bounds.whole, PARTS**2).reshape(-1, PARTS, PARTS)
        corner = np.repeat(bounds.middle, (PARTS + 1) ** 2).reshape(-1, PARTS + 1, PARTS + 1)
        if len(many):
            loudest[many] = bounds.parts[bounds.row[many]]
            place = self._places(tiles.take(many), np.arange(PARTS + 1) / PARTS)
            corner[many] = self._at(place).reshape(-1, PARTS + 1, PARTS + 1)
        odd = np.flatnonzero((bounds.row < 0) & (bounds.middle < PEAK * np.minimum(bounds.whole, 1.0)))
        if len(odd):  # their middles do not speak for them
            ends = self._at(self._places(tiles.take(odd), np.arange(2.0))).reshape(-1, 4)
            corner[odd] = (ends @ _BETWEEN).reshape(-1, PARTS + 1, PARTS + 1)
        peaked = np.empty(loudest.shape, np.bool_)
        kernel.peaks(corner, loudest, bounds.row < 0, PEAK, peaked)
        return Shares(bounds.density, bounds.density[:, None, None] * self._share(loudest), corner, peaked)

    def _at(self, place: Floats, around: Floats | None = None) -> Floats:
        """Gain at some places, or the loudest within so far [m] of them, re that above which all are kept."""
        found, (out, back) = np.empty(len(place)), self._ends
        around = np.zeros(len(place)) if around is None else around
        last = float(_nodes(self.farthest)[-1])
        kernel.re_edge(out, back, out is back, self._edge, last, self.stance.middle, FAINTEST, place, around, found)
        return found

    def kept(self, cell: Draw, tiles: Tiles, shares: Shares) -> tuple[Draw, Floats]:
        """The scatterers that are kept of those drawn, and the ground that each stands for [m^2].

        Args:
            cell: Those drawn.
            tiles: In these tiles.
            shares: Of these tiles.
        """
        share = np.empty(len(cell.tile))
        kernel.shares_between(
            shares.corner, shares.peaked, shares.density, shares.most, self._fewer, LEAST, cell.tile, cell.row,
            cell.column, cell.along, cell.across, tiles.pitch, share,
        )  # fmt: skip
        asked = np.flatnonzero(np.isnan(share))
        if len(asked):
            tile = cell.tile[asked]
            part = (tile * PARTS + cell.row[asked] % TILE // SIDE) * PARTS + cell.column[asked] % TILE // SIDE
            own = self._share(self._at(self.lattice.to_world(cell.along[asked], cell.across[asked])))
            share[asked] = np.minimum(shares.density[tile] * own, shares.most.ravel()[part])
        kept, share = below(cell, share)
        return kept, kept.area / share

    def mean_share(self, distance: Floats) -> Floats:
        """Part of the scatterers that is kept, on the average over all bearings.

        Args:
            distance: From the middle between both ends [m], shape (n,).

        Returns:
            Shape (n,).
        """
        bearing = np.arange(BEARINGS) * (2 * np.pi / BEARINGS)
        way = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
        place = (self.stance.middle + distance[:, None, None] * way).reshape(-1, 2)
        return np.asarray(self._share(self._at(place)).reshape(len(distance), BEARINGS).mean(axis=1))

    def _places(self, tiles: Tiles, part: Floats) -> Floats:
        """North and east at the same parts of the sides of some tiles [m], shape (tiles * parts * parts, 2)."""
        shape, side = (len(tiles.level), len(part), len(part)), TILE * tiles.pitch[:, None, None]
        along = np.broadcast_to((tiles.along[:, None, None] + part[:, None]) * side, shape)
        across = np.broadcast_to((tiles.across[:, None, None] + part) * side, shape)
        return self.lattice.to_world(along.ravel(), across.ravel())

    def _share(self, gain: Floats) -> Floats:
        """Part of the scatterers that is kept, by the gain re that above which all are [1]."""
        found = np.empty(gain.shape)
        kernel.shares(np.ravel(gain), self._fewer, LEAST, found.ravel())
        return found

    @property
    def _fewer(self) -> float:
        """Gain below which shares fall no longer with its square, but with it [1]."""
        return 0.0 if self._wide else FEWER

    @cached_property
    def _edge(self) -> Floats:
        """Two-way gain above which all scatterers are kept, at the nodes."""
        return np.asarray(self._loudest * amplitude_ratio(ELEMENT_EDGE_DB if self._wide else BEAM_EDGE_DB))

    @property
    def _wide(self) -> bool:
        """Whether elements are heard that no motion of the sonar joins to an aperture."""
        return self.stance.elements is not None and self.stance.pulse.receiver.synthetic_aperture is None

    @cached_property
    def _loudest(self) -> Floats:
        """Envelope of the loudest gain at each node [1], shape (nodes,), within `CLOSE` of it.

        Sectors that may hold a louder one than was found are halved.
        """
        far = _nodes(self.farthest)
        best = np.max([self._around_middle(far, np.full(len(far), axis)) for axis in self._axes], axis=0)
        wide = np.pi / SECTORS
        sector = self.stance.bearing + (2 * np.arange(SECTORS) + 1) * wide
        node, bearing = np.arange(len(far)).repeat(SECTORS), np.tile(sector, len(far))
        for _ in range(HALVINGS):
            np.maximum.at(best, node, self._around_middle(far[node], bearing))
            hopeful = self._around_middle(far[node], bearing, wide * far[node]) > best[node] * CLOSE
            wide /= 2
            node, bearing = node[hopeful].repeat(2), (bearing[hopeful, None] + [-wide, wide]).ravel()
        return best

    def _around_middle(self, distance: Floats, bearing: Floats, around: Floats | None = None) -> Floats:
        """Gain [1] at distances [m] and bearings [rad], or the loudest no farther than `around` from there [m]."""
        place = self.stance.middle + distance[:, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
        found, (out, back) = np.empty(len(place)), self._ends
        around = np.zeros(len(place)) if around is None else around
        kernel.two_way(out, back, out is back, place, around, np.full(len(place), np.inf), found)
        return found

    @property
    def _axes(self) -> list[float]:
        """Bearings of the axes of some beams [rad], where the loudest places are likely to lie."""
        found = {self.stance.bearing}
        for beams in (self.stance.transmit_beams, self.stance.receive_beams):
            across, deep = beams.steer[:: max(1, len(beams.steer) // SECTORS)].T
            ahead = np.sqrt(np.maximum(1 - across**2 - deep**2, 0))
            way = np.stack([ahead, across, deep], axis=-1) @ beams.axes
            found |= set(np.arctan2(way[:, 1], way[:, 0]).tolist())
        return sorted(found)

    @cached_property
    def _ends(self) -> tuple[kernel.End, kernel.End]:
        here = self.stance
        apart = float(np.linalg.norm(here.transmit_place - here.receive_place))
        out = self._end(here.transmit_place, here.transmit_beams, self.farthest + apart)
        if here.together and here.alike:
            return out, out
        return out, self._end(here.receive_place, here.ears, self.farthest + apart)

    def _end(self, place: Floats, beams: Beams, farthest: float) -> kernel.End:
        distance = np.maximum(_nodes(farthest), 1e-6)
        centre = place[:2] + distance[:, None] * [1.0, 0.0]
        sines = np.empty((len(self.families), len(distance)))
        for row, name in enumerate(self.families):
            cones = self.rays.cones(name, place, centre, np.zeros(len(distance)), self.depth)
            sines[row] = np.where(cones.there, cones.way[:, 2], np.nan)
        beam = beams.axes, beams.steer, beams.scale, beams.majorants, beams.per_unit, beams.element
        return place, sines, float(distance[-1]), abs(self.depth - float(place[2])), beam


def _nodes(farthest: float) -> Floats:
    """Distances at which things are worked out, up to one beyond the farthest [m]: the same whatever that is."""
    return np.asarray(FIRST_NODE * np.arange(np.ceil(np.sqrt(farthest / FIRST_NODE)) + 2) ** 2)
