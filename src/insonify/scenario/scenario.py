"""A scenario: everything that one simulation is made from."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from insonify.noun import Noun, located
from insonify.ocean.water import Water
from insonify.propagation.choice import PathChoice
from insonify.scene.scene import Scene, check_targets
from insonify.scene.seabed import Seabed
from insonify.scene.surface import Surface
from insonify.scene.target import Target
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.sonar import Sonar, array_position
from insonify.sonar.track import LineTrack, StaticTrack, poses

Track = Annotated[StaticTrack | LineTrack, Field(discriminator="kind")]


class Output(Noun):
    """What a run leaves on disk beside the recording."""


class Scenario(Noun):
    """What is simulated: scene, sonar, track, paths and reading."""

    title: str = ""
    """One line about it."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    """Seed of every random draw: the same seed, the same bits."""
    water: Water = Water()
    seabed: Seabed = Seabed()
    surface: Surface = Surface()
    targets: tuple[Target, ...] = ()
    sonar: Sonar
    track: Track
    paths: PathChoice = PathChoice()
    field: Literal["coherent", "incoherent"] = "coherent"
    """Complex pressure with speckle, or the expected intensity."""
    output: Output = Output()

    @property
    def scene(self) -> Scene:
        """Water, boundaries and targets."""
        return Scene(water=self.water, seabed=self.seabed, surface=self.surface, targets=self.targets)

    @model_validator(mode="after")
    def _targets_fit(self) -> Self:
        check_targets(self.seabed, self.targets)
        return self

    @model_validator(mode="after")
    def _sonar_in_the_water(self) -> Self:
        stances = poses(self.track)
        where = "position" if isinstance(self.track, StaticTrack) else "start"
        for end, array in (("transmit", self.sonar.transmit), ("receive", self.sonar.receive)):
            depths = [array_position(array, stances.position[n], stances.rotation(n))[2] for n in (0, len(stances) - 1)]
            worst = min(depths) if min(depths) <= 0 else max(depths)
            if not 0 < worst < self.seabed.depth:
                side = "at or above the sea surface (0 m)" if worst <= 0 else f"at or below the seabed ({self.seabed.depth:g} m)"
                raise located(
                    f"track.{where}.2", f"{stances.position[0][2]:g} m",
                    f"puts the {end} array {side}, at {worst:g} m. Depths are positive downwards; "
                    f"write a depth between 0 and {self.seabed.depth:g} m.",
                )  # fmt: skip
        return self

    @model_validator(mode="after")
    def _slice_has_one_beam(self) -> Self:
        if self.paths.geometry == "slice" and self.sonar.channel_count > 1:
            raise located(
                "paths.geometry", "slice", f"has one beam, but the sonar steers {self.sonar.channel_count}. "
                "Write 3d, for a bearing needs the third dimension, or give one steer angle.",
            )  # fmt: skip
        return self

    @model_validator(mode="after")
    def _beams_without_grating(self) -> Self:
        return self


def wavelength(scenario: Scenario) -> float:
    """Wavelength at the centre of the band [m]."""
    return scenario.water.sound_speed / scenario.sonar.pulse.frequency


__all__ = ["LineArray", "Output", "PlanarArray", "PointTransducer", "Scenario", "np", "wavelength"]
