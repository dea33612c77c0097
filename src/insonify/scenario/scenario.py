"""A scenario: everything that one simulation is made from."""

import warnings
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from insonify.noun import Noun, located
from insonify.ocean.water import Water
from insonify.propagation.choice import PathChoice
from insonify.scene.box import inside_box
from insonify.scene.scene import Scene, check_targets
from insonify.scene.seabed import Seabed
from insonify.scene.surface import Surface
from insonify.scene.target import Target
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.beam import beams, grating_lobes
from insonify.sonar.sonar import Sonar, array_position
from insonify.sonar.track import LineTrack, StaticTrack, poses
from insonify.validity import PhysicsWarning

Transducers = LineArray | PlanarArray | PointTransducer
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
                side = (
                    "at or above the sea surface (0 m)"
                    if worst <= 0
                    else f"at or below the seabed ({self.seabed.depth:g} m)"
                )
                raise located(
                    f"track.{where}.2", f"{stances.position[0][2]:g} m",
                    f"puts the {end} array {side}, at {worst:g} m. Depths are positive downwards; "
                    f"write a depth between 0 and {self.seabed.depth:g} m.",
                )  # fmt: skip
        return self

    @model_validator(mode="after")
    def _sonar_outside_the_boxes(self) -> Self:
        stances, scene = poses(self.track), self.scene
        rows = [row for row, target in enumerate(self.targets) if target in scene.boxes]
        for row, body in zip(rows, scene.bodies, strict=True):
            if any(inside_box(body, place) for place in stances.position):
                raise located(
                    f"targets.{row}.position", None, f"the sonar is inside {self.targets[row].label}. "
                    "Move the target, or the track.",
                )  # fmt: skip
        return self

    @model_validator(mode="after")
    def _beams_can_be_formed(self) -> Self:
        # Whether a steered beam exists depends on the wavelength, which no array knows by itself.
        for end, array in zip(("transmit", "receive"), self.sonar.arrays, strict=True):
            try:
                beams(array, self.sonar.pulse.frequency, self.water.sound_speed)
            except ValueError as fault:
                raise located(f"sonar.{end}.steer", None, str(fault)) from fault
            warn_of_grating_lobes(end, array, self.sonar.pulse.frequency, self.water.sound_speed)
        return self

    @model_validator(mode="after")
    def _slice_has_one_beam(self) -> Self:
        if self.paths.geometry == "slice" and self.sonar.channel_count > 1:
            raise located(
                "paths.geometry", "slice", f"has one beam, but the sonar steers {self.sonar.channel_count}. "
                "Write 3d, for a bearing needs the third dimension, or give one steer angle.",
            )  # fmt: skip
        return self


def warn_of_grating_lobes(end: str, array: Transducers, frequency: float, sound_speed: float) -> None:
    """Warn once where the elements of an array stand so far apart that it also looks elsewhere.

    Args:
        end: Which end of the sonar, "transmit" or "receive".
        array: Its array, steer angles filled in.
        frequency: Centre frequency [Hz].
        sound_speed: Sound speed [m/s].
    """
    lobes = grating_lobes(array, frequency, sound_speed)
    if len(lobes):
        aside = np.degrees(np.arcsin(np.clip(lobes[0], -1, 1)))
        warnings.warn(
            f"sonar.{end}: {len(lobes)} grating lobes, the first {aside[0]:.0f} deg to the right and {aside[1]:.0f} "
            "deg down: the elements stand more than half a wavelength apart. Give more elements, or steer less.",
            PhysicsWarning,
            stacklevel=2,
        )
