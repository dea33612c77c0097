"""Seabed: depth, relief, scattering law, texture and specular reflection."""

from collections.abc import Hashable
from functools import lru_cache
from typing import Annotated, Literal, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from insonify.model import MAX_DEPTH, Metres, Model, field_error
from insonify.scattering.compiled_law import CompiledLaw, compiled_once
from insonify.scattering.lambert import Lambert
from insonify.scattering.reflection import reflection_coefficient, reflection_coefficient_at_sine
from insonify.scene.boundary_law import BoundaryLaw, infer_law_kind, law_at
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.seabed_law import SedimentLaw, TableLaw, checked_sediment, sediment
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain.bathymetry_grid import BathymetryGrid, warn_of_overlap
from insonify.scene.terrain.composite_relief import build_terrain
from insonify.scene.terrain.power_law import PowerLaw
from insonify.scene.terrain.ripples import Ripples
from insonify.scene.terrain.roughness_cutoff import COARSEST, FINEST, RoughnessCutoff
from insonify.scene.terrain.scour import Scour
from insonify.scene.texture import Texture

Reflection = Annotated[float, Field(ge=-1, le=1)] | Annotated[str, AfterValidator(checked_sediment)]
SeabedLaw = BoundaryLaw | SedimentLaw | TableLaw
ReliefKind = Annotated[PowerLaw | Ripples | BathymetryGrid | Scour, Field(discriminator="kind")]


def _as_list_of_reliefs(value: object) -> object:
    """A relief given without a list, as a list of one; null for none."""
    if value is None:
        return ()
    return (value,) if isinstance(value, dict | Model) else value


class Seabed(Model):
    """A seabed: flat at one depth, or with relief about that depth.

    Example:
        >>> seabed = Seabed(depth="20 m", reflection="medium sand")
        >>> np.abs(seabed.reflection_coefficient(np.radians([10.0, 90.0]))).round(2).tolist()
        [0.96, 0.37]
    """

    depth: Annotated[Metres, Field(ge=0.1, le=MAX_DEPTH)] = 20.0
    """Depth of the flat seabed, or of the mean plane of its relief, below the mean surface, positive down [m].

    The default for a surveyed grid is its mean depth.
    """
    relief: Annotated[
        tuple[ReliefKind, ...],
        BeforeValidator(_as_list_of_reliefs, json_schema_input_type=tuple[ReliefKind, ...] | ReliefKind | None),
    ] = ()
    """Reliefs that are added to the mean plane; empty: a flat seabed."""
    cutoff_wavelength: Annotated[Metres, Field(ge=FINEST, le=COARSEST)] | None = None
    """Longest wavelength that is left to the scattering law [m]; None: that of the sediment of a law at the sonar's
    frequency (TR 9407), 0.5 m for laws without a sediment."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    """Seed of the relief and of the texture [1]; None: the scenario's. Given here, the relief stays while the
    scenario's seed changes scatterers and noise."""
    scattering: Annotated[
        Annotated[SeabedLaw, Field(discriminator="law")] | None,
        BeforeValidator(infer_law_kind, json_schema_input_type=SeabedLaw | None),
    ] = SedimentLaw()
    """Law of diffuse scattering; None for a seabed that reflects specularly only."""
    texture: Texture | None = None
    """Spatial variation of the scattering strength about its mean; None: none."""
    reflection: Reflection = "medium sand"
    """Pressure reflection coefficient [1], or the sediment whose Rayleigh coefficient is used."""
    reflecting_interface: Literal["smooth", "rough"] = "smooth"
    """Interface that reflects: smooth, or over relief one whose roughness leaves the coherent part; or rough as the
    sediment under `scattering` is, with a coherent part and glints that carry what it scatters forward."""

    scatterer_grid: ScattererGrid = ScattererGrid()
    """Frame of the random scatterers of seabed and surface."""

    @property
    def grid(self) -> BathymetryGrid | None:
        """The surveyed grid of the relief; None: none."""
        return next((kind for kind in self.relief if isinstance(kind, BathymetryGrid)), None)

    @model_validator(mode="after")
    def _check_grid_depth(self) -> Self:
        rows = [row for row, kind in enumerate(self.relief) if isinstance(kind, BathymetryGrid)]
        if len(rows) > 1:
            raise field_error(
                f"relief.{rows[1]}", None, "a second grid. Depths do not add up; merge the files into one."
            )
        if self.grid is None:
            return self
        shallowest, mean, deepest = self.grid.depths
        if "depth" not in self.model_fields_set:
            self.__dict__["depth"] = round(mean, 2)
        elif not shallowest <= self.depth <= deepest:
            raise field_error(
                "depth", f"{self.depth:g} m", f"is not among the grid's depths, {shallowest:.4g} to {deepest:.4g} m. "
                "Leave it out for their mean, or give the mean depth of the part in the sonar's range.",
            )  # fmt: skip
        for kind in self.relief:
            if isinstance(kind, PowerLaw):
                warn_of_overlap(self.grid.cell, kind.outer_scale)
        return self

    @model_validator(mode="after")
    def _check_interface(self) -> Self:
        if self.reflecting_interface == "rough" and not isinstance(self.scattering, SedimentLaw):
            raise field_error(
                "reflecting_interface", "rough", "needs the roughness of a sediment, and the scattering law names "
                "none. Write scattering: {law: jackson, sediment: medium sand}, or reflecting_interface: smooth.",
            )  # fmt: skip
        return self

    def completed(self, seed: int, frequency: float, sound_speed: float) -> Self:
        """Copy of the seabed with all optional values of its relief and texture determined.

        Args:
            seed: Seed of the scenario.
            frequency: Frequency of the sonar [Hz].
            sound_speed: Sound speed of the water [m/s].
        """
        if not (self.relief or self.texture) or (self.cutoff_wavelength is not None and self.seed is not None):
            return self
        cutoff = (
            RoughnessCutoff() if self.cutoff_wavelength is None else RoughnessCutoff(wavelength=self.cutoff_wavelength)
        )
        if self.cutoff_wavelength is None and isinstance(self.scattering, SedimentLaw):
            cutoff = RoughnessCutoff.of_sediment(sediment(self.scattering.sediment), frequency, sound_speed=sound_speed)
        seabed_seed = seed if self.seed is None else self.seed
        return self.unchecked_copy(cutoff_wavelength=cutoff.wavelength, seed=seabed_seed)

    @property
    def terrain(self) -> SeabedTerrain | None:
        """The terrain that the relief makes; None for a flat seabed."""
        return _cached_terrain(self) if self.relief else None

    def depth_at(self, north: ArrayLike, east: ArrayLike) -> NDArray[np.float64]:
        """Depth of the seabed at one or more positions [m]; NaN where it is unknown.

        Args:
            north: North of the positions [m], any shape.
            east: East of the positions [m], of a shape that broadcasts with it.

        Returns:
            Depths, the broadcast shape.

        Example:
            >>> Seabed(depth="20 m").depth_at([0.0, 5.0], 2.0).tolist()
            [20.0, 20.0]
        """
        if self.terrain is None:
            return np.full(np.broadcast_shapes(np.shape(north), np.shape(east)), self.depth)
        return np.asarray(self.terrain.depth_at(north, east))

    def law(self, frequency: float, sound_speed: float) -> Lambert | CompiledLaw | None:
        """The law of diffuse scattering at one frequency [Hz], under water of one sound speed [m/s].

        Every law is compiled but Lambert's, whose pairs need no cross sections of their own.
        """
        law = law_at(self.scattering, frequency, sound_speed)
        return law if law is None or isinstance(law, Lambert | CompiledLaw) else compiled_once(cast(Hashable, law))

    def interface_law(self, frequency: float, sound_speed: float) -> CompiledLaw | None:
        """Scattering law of the sediment's rough surface, for a rough reflecting interface; None: no such interface."""
        law = self.scattering
        if self.reflecting_interface == "smooth" or not isinstance(law, SedimentLaw) or law.law == "sediment-volume":
            return None
        return SedimentLaw(law="small-slope", sediment=law.sediment).at(frequency, sound_speed)

    def texture_factor(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Factor of the texture on the scattering cross section at positions [1], shape (n,).

        Args:
            position: North, east [m] and any further columns, shape (n, 2 or more).
        """
        if self.texture is None:
            return np.ones(len(position))
        seed = 1 if self.seed is None else self.seed
        return self.texture.at(position[:, 0], position[:, 1], seed=seed, scatterer_grid=self.scatterer_grid)

    def reflection_coefficient(self, grazing: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Pressure reflection coefficient of one bottom bounce [1].

        Args:
            grazing: Grazing angle at the seabed [rad], any shape.

        Returns:
            Complex coefficient for exp(+j omega t), shape of `grazing`.
        """
        if isinstance(self.reflection, str):
            return reflection_coefficient(sediment(self.reflection), grazing)
        return self.reflection_coefficient_at_sine(np.asarray(grazing))

    def reflection_coefficient_at_sine(self, sine: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Reflection coefficient at sines of the grazing angle [1], any shape."""
        if isinstance(self.reflection, str):
            return reflection_coefficient_at_sine(sediment(self.reflection), sine)
        return np.full(np.shape(sine), complex(self.reflection))


@lru_cache(maxsize=4)
def _cached_terrain(seabed: Seabed) -> SeabedTerrain:
    """Terrain shared by all pings, with its caches."""
    cutoff = (
        RoughnessCutoff() if seabed.cutoff_wavelength is None else RoughnessCutoff(wavelength=seabed.cutoff_wavelength)
    )
    composite = build_terrain(
        seabed.relief, seed=1 if seabed.seed is None else seabed.seed, cutoff=cutoff,
        scatterer_grid=seabed.scatterer_grid, mean_depth=seabed.depth,
    )  # fmt: skip
    return SeabedTerrain(seabed.depth, composite)
