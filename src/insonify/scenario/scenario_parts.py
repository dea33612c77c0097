"""Parts of a scenario, and the scene that they make: what its checks against each other read."""

from typing import Annotated, Literal

from pydantic import Field

from insonify.model import Model, evaluated_once
from insonify.ocean.water import Water
from insonify.propagation.path_settings import PathSettings
from insonify.scene.scene import Scene
from insonify.scene.scour_pits import with_scour_pits
from insonify.scene.seabed import Seabed
from insonify.scene.surface import Surface
from insonify.scene.target import Target
from insonify.sonar.sonar import Sonar
from insonify.sonar.track import Track


class Output(Model):
    """Files that a run leaves on disk beside the recording."""

    labels: bool = False
    """True: every sample is labelled with object, paths, position, highlight, shadow, ghost; a run takes longer."""


class ScenarioParts(Model):
    """Parts of a scenario, which are not checked against each other: see `Scenario`."""

    title: str = ""
    """One line about it."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    """Seed of every random draw [1]: the same seed, the same bits. Files that share it share their seabed, whatever
    their track, targets and noise, if relief, cutoff wavelength and pulse are the same."""
    water: Water = Water()
    seabed: Seabed = Seabed()
    surface: Surface = Surface()
    targets: tuple[Target, ...] = ()
    sonar: Sonar
    track: Track
    receiver_track: Track | None = None
    """The receiver's own platform; its clock and pings are those of `track`, which is then of the transmitter alone.
    None: one platform for both."""
    paths: PathSettings = PathSettings()
    field: Literal["coherent", "incoherent"] = "coherent"
    """Complex pressure with speckle, or the expected intensity."""
    output: Output = Output()

    @property
    @evaluated_once
    def scene(self) -> Scene:
        """Water, boundaries and targets: one object, which caches with it as a key find without comparing fields."""
        return Scene(water=self.water, seabed=self.completed_seabed, surface=self.surface, targets=self.targets)

    @property
    @evaluated_once
    def completed_seabed(self) -> Seabed:
        """The seabed with the relief that this seed, sonar, water and targets give it: one object, as the scene."""
        sound_speed = float(self.water.sound_speed_at(self.seabed.depth))
        whole = with_scour_pits(self.seabed, self.targets)
        return whole.completed(self.seed, self.sonar.pulse.frequency, sound_speed)
