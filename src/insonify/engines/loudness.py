"""Which scatterers one ping asks for: all where a beam looks, few where it hardly listens.

A scatterer is kept where its priority, which belongs to its place, lies below a share, and stands for as much more
ground as others beside it were left out. The share is one wherever the two-way gain is within 20 dB of the loudest at
its distance. It falls with the square of the gain's envelope below, so that each that is left is about as loud as one
at that edge; far below, only with the envelope, for side lobes far out are all that fills a wide shadow. Every path,
beam and element of a ping has the same scatterers, so that what is coherent stays so; from ping to ping they come and
go only where shares are below one. The mean is that of all scatterers, whatever the share is.

Recorded elements that are to be steered as one aperture each hear more than the beams that will be made of them: their
share falls from 16 dB below the loudest on.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _loudness_kernel as kernel
from insonify.propagation.rays import Rays
from insonify.scene.lattice import PARTS, SIDE, TILE, Draw, Lattice, Tiles
from insonify.sonar._beam_kernels import OMNI
from insonify.sonar.beam import Beams
from insonify.sonar.stance import Stance
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

_End = tuple[Floats, Floats, float, float, kernel.Beam]
"""The first arguments of `_loudness_kernel.envelopes`."""

BEAM_EDGE_DB = -20.0
"""Two-way gain of a beam, re the loudest at its distance, above which every scatterer is kept [dB]."""
ELEMENT_EDGE_DB = -16.0
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
HALVINGS = 12
"""Of a sector, at most."""
CLOSE = 1.05
"""Ratio to which the loudest gain is found [1]."""


class Shares(NamedTuple):
    """How many of the scatterers of n tiles one ping keeps, part by part."""

    density: Floats
    """Share of them that fills the sonar's cells: the lattice's come in powers of two, shape (n,)."""
    most: Floats
    """Largest share anywhere in each part, shape (n, PARTS, PARTS); no scatterer is given more."""
    corner: Floats
    """Gain at the corners of the parts, re that above which all are kept, shape (n, PARTS + 1, PARTS + 1)."""
    peaked: NDArray[np.bool_]
    """Parts that hold a place much louder than their corners, shape (n, PARTS, PARTS)."""

    def take(self, rows: slice) -> "Shares":
        """Those of some tiles."""
        return Shares(self.density[rows], self.most[rows], self.corner[rows], self.peaked[rows])


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

    def shares(self, tiles: Tiles, density: Floats) -> Shares:
        """Bounds of the shares in some tiles.

        Args:
            tiles: The tiles.
            density: Share of their scatterers that fills the sonar's cells, shape (n,).
        """
        if self.stance.receive_survey is not None:  # what is loudest at a distance is told of one place only
            part = np.ones((len(density), PARTS, PARTS))
            corner = np.ones((len(density), PARTS + 1, PARTS + 1))
            return Shares(density, density[:, None, None] * part, corner, part < 1)
        side = np.broadcast_to(TILE * tiles.pitch[:, None, None], (len(density), PARTS, PARTS))
        around = side.ravel() / PARTS * np.sqrt(0.5)
        middle = self._places(tiles, (np.arange(PARTS) + 0.5) / PARTS)
        edge = np.minimum(self._edge_at(middle, -around), self._edge_at(middle, around))
        bound = (self._gain(middle, around, edge) / np.maximum(edge, FAINTEST)).reshape(side.shape)
        place = self._places(tiles, np.arange(PARTS + 1) / PARTS)
        edge = self._edge_at(place)
        corner = self._gain(place, np.zeros(len(place)), edge) / np.maximum(edge, FAINTEST)
        corner = corner.reshape(-1, PARTS + 1, PARTS + 1)
        loudest = np.maximum.reduce([corner[:, i : PARTS + i, j : PARTS + j] for i in (0, 1) for j in (0, 1)])
        return Shares(
            density, density[:, None, None] * self._share(bound), corner, loudest < PEAK * np.minimum(bound, 1.0)
        )

    def kept(self, cell: Draw, tiles: Tiles, shares: Shares) -> tuple[Draw, Floats]:
        """The scatterers that are kept of those drawn, and the ground that each stands for [m^2].

        Args:
            cell: Those drawn.
            tiles: In these tiles.
            shares: Of these tiles.
        """
        found = np.empty(len(cell.tile))
        kernel.between_corners(
            shares.corner, shares.peaked, cell.tile, cell.row, cell.column, cell.along, cell.across, tiles.pitch, found
        )
        asked = np.flatnonzero(np.isnan(found))
        place = self.lattice.to_world(cell.along[asked], cell.across[asked])
        edge = self._edge_at(place)
        found[asked] = self._gain(place, np.zeros(len(asked)), edge) / np.maximum(edge, FAINTEST)
        part = (cell.tile * PARTS + cell.row % TILE // SIDE) * PARTS + cell.column % TILE // SIDE
        share = np.minimum(shares.density[cell.tile] * self._share(found), shares.most.ravel()[part])
        kept = np.flatnonzero(cell.priority < share)
        some = cell.take(kept)
        return some, some.area / share[kept]

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
        edge = self._edge_at(place)
        gain = self._gain(place, np.zeros(len(place)), edge) / np.maximum(edge, FAINTEST)
        return np.asarray(self._share(gain).reshape(len(distance), BEARINGS).mean(axis=1))

    def _places(self, tiles: Tiles, part: Floats) -> Floats:
        """North and east at the same parts of the sides of some tiles [m], shape (tiles * parts * parts, 2)."""
        shape, side = (len(tiles.level), len(part), len(part)), TILE * tiles.pitch[:, None, None]
        along = np.broadcast_to((tiles.along[:, None, None] + part[:, None]) * side, shape)
        across = np.broadcast_to((tiles.across[:, None, None] + part) * side, shape)
        return self.lattice.to_world(along.ravel(), across.ravel())

    def _share(self, gain: Floats) -> Floats:
        """Part of the scatterers that is kept, by the gain re that above which all are [1]."""
        gain = np.minimum(gain, 1.0)  # what is loud where nothing else is heard is any number of times louder
        share = gain**2 if self._wide else np.maximum(gain**2, FEWER * gain)
        return np.clip(share, LEAST, 1.0)

    def _gain(self, place: Floats, around: Floats, enough: Floats) -> Floats:
        """Envelope of the two-way gain no farther than `around` [m] from some places, or a part that is enough."""
        north, east = np.ascontiguousarray(place.T)
        out, back = self._ends
        alike = out is back
        sent = np.empty(len(place))
        enough = np.sqrt(enough) if alike else np.full(len(place), np.inf)
        kernel.envelopes(*out, north, east, around, enough, sent)
        if alike:
            return sent**2
        heard = np.empty(len(place))
        kernel.envelopes(*back, north, east, around, enough, heard)
        return sent * heard

    def _edge_at(self, place: Floats, beyond: Floats | float = 0.0) -> Floats:
        """Two-way gain above which all scatterers are kept, at some places or so far beyond them [m]."""
        distance = np.hypot(*(place - self.stance.middle).T) + beyond
        found = np.empty(len(place))
        kernel.at_nodes(self._edge, float(_nodes(self.farthest)[-1]), distance, found)
        return found

    @cached_property
    def _edge(self) -> Floats:
        """The same at the nodes."""
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
        best = np.zeros(len(far))
        wide = np.pi / SECTORS
        sector = self.stance.bearing + (2 * np.arange(SECTORS) + 1) * wide
        node, bearing = np.arange(len(far)).repeat(SECTORS), np.tile(sector, len(far))
        for _ in range(HALVINGS):
            way = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
            place = self.stance.middle + far[node, None] * way
            endless = np.full(len(node), np.inf)
            np.maximum.at(best, node, self._gain(place, np.zeros(len(node)), endless))
            hopeful = self._gain(place, wide * far[node], endless) > best[node] * CLOSE
            wide /= 2
            node, bearing = node[hopeful].repeat(2), (bearing[hopeful, None] + [-wide, wide]).ravel()
        return best

    @cached_property
    def _ends(self) -> tuple[_End, _End]:
        here = self.stance
        apart = float(np.linalg.norm(here.transmit_place - here.receive_place))
        out = self._end(here.transmit_place, here.transmit_beams, self.farthest + apart)
        if here.together and here.alike:
            return out, out
        return out, self._end(here.receive_place, _as_heard(here), self.farthest + apart)

    def _end(self, place: Floats, beams: Beams, farthest: float) -> _End:
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


def _as_heard(stance: Stance) -> Beams:
    """The receive beams, or a pattern that bounds them where elements face several ways."""
    ears = stance.receive_beams
    if stance.elements is None or not np.ptp(stance.elements.facing):
        return ears
    none = (np.empty(0),) * 4
    return replace(ears, element=OMNI, majorants=none, steer=np.zeros((1, 2)), scale=np.ones(1))
