"""Map of sediments: a base, or patches of several, with regions and strips on top."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import AfterValidator, Field, model_validator

from insonify.model import Metres, Model, field_error
from insonify.scattering.sediments import Sediment
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.terrain.octaves import Octaves, unit_octave
from insonify.scene.terrain.relief import broadcast_positions

Floats = NDArray[np.float64]
Position = tuple[Metres, Metres]
SedimentName = Annotated[str, AfterValidator(lambda name: Sediment.named(name).name)]
"""A name that `Sediment.named` accepts; others are an error that lists the nearest names."""
_LAYER = 1 << 20  # above every layer of relief


class SedimentPatches(Model):
    """Patches of several sediments; in the given order, each borders on the one before and the next only.

    Example:
        >>> patches = SedimentPatches(sediments=["medium sand", "silty clay"], fractions=[0.7, 0.3], size="20 m")
        >>> SedimentMap(base=patches).sediments
        ('medium sand', 'silty clay')
    """

    kind: Literal["patches"] = "patches"
    sediments: Annotated[tuple[SedimentName, ...], Field(min_length=2)]
    """Names of the sediments, as many as fractions, none twice."""
    fractions: tuple[Annotated[float, Field(gt=0)], ...]
    """Fractions of the area, scaled to a sum of 1 [1]."""
    size: Annotated[Metres, Field(gt=0)] = 20.0
    """Typical size of a patch [m]."""

    @model_validator(mode="after")
    def _check_fractions(self) -> Self:
        if len(self.fractions) != len(self.sediments):
            raise field_error(
                "fractions",
                f"{len(self.fractions)} fractions",
                f"for {len(self.sediments)} sediments. Give one for each.",
            )
        if len(set(self.sediments)) != len(self.sediments):
            raise field_error("sediments", ", ".join(self.sediments), "has a name twice. Add up its fractions.")
        return self


class SedimentRegion(Model):
    """A polygon of one sediment.

    Example:
        >>> region = SedimentRegion(sediment="gravel", corners=[(0, 0), (0, 50), (50, 50)])
        >>> region.covers(np.array([10.0, 40.0]), np.array([40.0, 10.0])).tolist()
        [True, False]
    """

    kind: Literal["region"] = "region"
    sediment: SedimentName
    """Name of the sediment."""
    corners: Annotated[tuple[Position, ...], Field(min_length=3)]
    """North and east of the corners, in order; the last is joined to the first [m]."""

    def covers(self, north: Floats, east: Floats) -> NDArray[np.bool_]:
        """Mask of points [m] in the polygon, by the parity of its edges to the north of them."""
        inside = np.zeros(north.shape, bool)
        corners = np.array(self.corners)
        for (n0, e0), (n1, e1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if e0 == e1:
                continue
            crossing = n0 + (east - e0) * ((n1 - n0) / (e1 - e0))
            # half open: a corner shared by two edges counts once
            inside ^= ((e0 <= east) != (e1 <= east)) & (north < crossing)
        return inside


class SedimentStrip(Model):
    """A straight band of one sediment, such as a channel or a trawl mark.

    Example:
        >>> channel = SedimentStrip(sediment="silty clay", start=(0, 0), end=(100, 0), width="5 m")
        >>> channel.covers(np.array([50.0, 50.0]), np.array([2.0, 10.0])).tolist()
        [True, False]
    """

    kind: Literal["strip"] = "strip"
    sediment: SedimentName
    """Name of the sediment."""
    start: Position
    """North and east of one end of its middle line [m]."""
    end: Position
    """North and east of the other end of its middle line [m]."""
    width: Annotated[Metres, Field(gt=0)]
    """Width across [m]."""

    @model_validator(mode="after")
    def _check_length(self) -> Self:
        if self.start == self.end:
            raise field_error("end", str(self.end), "is where the strip starts. Give another position.")
        return self

    def covers(self, north: Floats, east: Floats) -> NDArray[np.bool_]:
        """Mask of points [m] in the band."""
        n, e = self.end[0] - self.start[0], self.end[1] - self.start[1]
        along = ((north - self.start[0]) * n + (east - self.start[1]) * e) / (n * n + e * e)
        across = ((east - self.start[1]) * n - (north - self.start[0]) * e) / np.hypot(n, e)
        return np.asarray((along >= 0) & (along <= 1) & (np.abs(across) <= self.width / 2))


class SedimentMap(Model):
    """Several sediments over one seabed.

    Example:
        >>> patches = SedimentPatches(sediments=["medium sand", "silty clay"], fractions=[0.7, 0.3], size="20 m")
        >>> cover = SedimentMap(base=patches).build_cover(seed=1)
        >>> north, east = np.mgrid[0:2000:10, 0:2000:10]
        >>> f"{np.mean(cover.lookup(north, east) == 1):.1f} of the area is silty clay"
        '0.3 of the area is silty clay'
    """

    base: SedimentName | SedimentPatches = "medium sand"
    """Sediment of all positions outside regions and strips."""
    on_top: tuple[Annotated[SedimentRegion | SedimentStrip, Field(discriminator="kind")], ...] = ()
    """Regions and strips over the base, in this order: the last one that covers a position applies."""

    @property
    def sediments(self) -> tuple[str, ...]:
        """All sediments of the map by name, each once."""
        base = (self.base,) if isinstance(self.base, str) else self.base.sediments
        return tuple(dict.fromkeys([*base, *(piece.sediment for piece in self.on_top)]))

    def build_cover(self, *, seed: int, scatterer_grid: ScattererGrid | None = None) -> "SedimentCover":
        """The map as a field over positions.

        Args:
            seed: Seed of the scene [1].
            scatterer_grid: Frame of the patches; the scene's origin and north if None.
        """
        fields: Sequence[Octaves] = ()
        if isinstance(self.base, SedimentPatches):
            fields = tuple(
                unit_octave(self.base.size / step, seed=seed, layer=_LAYER + row) for row, step in enumerate(_RATIOS)
            )
        return SedimentCover(self, scatterer_grid or ScattererGrid(), tuple(fields))


_RATIOS = (2.0, 4.4, 9.3)
"""Ratio of patch size to pitch of the three octaves whose sum determines the outlines of patches."""
_VARIANCE_FRACTIONS = (0.8, 0.16, 0.04)
"""Fractions of the variance of these octaves."""


@dataclass(frozen=True, slots=True)
class SedimentCover:
    """Field of sediments over positions.

    Example:
        >>> channel = SedimentStrip(sediment="silty clay", start=(0, 0), end=(100, 0), width="5 m")
        >>> cover = SedimentMap(base="medium sand", on_top=[channel]).build_cover(seed=1)
        >>> [cover.sediments[row].name for row in cover.lookup(50.0, [0.0, 10.0])]
        ['silty clay', 'medium sand']
    """

    map: SedimentMap
    """The map that it is made of."""
    scatterer_grid: ScattererGrid
    """Frame of the patches."""
    fields: tuple[Octaves, ...]
    """Octaves of noise; the quantile of their sum determines the sediment of a patch."""

    @property
    def sediments(self) -> tuple[Sediment, ...]:
        """Sediments, in the order of the rows that `lookup` returns."""
        return tuple(Sediment.named(name) for name in self.map.sediments)

    def lookup(self, north: ArrayLike, east: ArrayLike) -> NDArray[np.intp]:
        """Row of `sediments` of the sediment at some points.

        Args:
            north: Position [m], any shape.
            east: Position [m], broadcast.

        Returns:
            Row numbers, broadcast shape; a position's row is independent of the other positions.
        """
        n, e = broadcast_positions(north, east, allow_nan=False)
        rows = np.zeros(n.shape, np.intp)
        if isinstance(self.map.base, SedimentPatches):
            patch_row = self._patches(self.map.base, n, e)
            rows = np.array([self.map.sediments.index(name) for name in self.map.base.sediments])[patch_row]
        for piece in self.map.on_top:
            rows = np.where(piece.covers(n, e), self.map.sediments.index(piece.sediment), rows)
        return rows

    def _patches(self, patches: SedimentPatches, north: Floats, east: Floats) -> NDArray[np.intp]:
        """Row of the sediment among those of the patches at positions [m], shape of the positions."""
        from scipy.special import ndtri

        position = self.scatterer_grid.from_world(np.stack([north, east], axis=-1))
        field_sum = np.zeros(north.shape)
        for fraction, field in zip(_VARIANCE_FRACTIONS, self.fields, strict=True):
            field_sum += np.sqrt(fraction) * field.height(position[..., 0], position[..., 1])
        shares = np.cumsum(patches.fractions) / np.sum(patches.fractions)
        return np.searchsorted(ndtri(shares[:-1]), field_sum)
