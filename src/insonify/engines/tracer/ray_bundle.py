"""What passes between the parts of the tracer: one ping made ready, rays under way, and what they have met."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer.launch_sampling import LaunchSampler
from insonify.engines.tracer.tracing_scene import RayIntersector
from insonify.propagation.path_settings import PathSettings
from insonify.scene.scatterers import Law
from insonify.scene.scene import Scene
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]
Rows = NDArray[np.bool_] | NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class TracedPing:
    """One ping in the lattice's frame: what every part of its rays needs."""

    scene: Scene
    choice: PathSettings
    ping_geometry: PingGeometry
    intersector: RayIntersector
    launch_sampler: LaunchSampler
    transmit: Floats
    """Place of the transmitter [m], (3,)."""
    receive: Floats
    """Place of the receiver [m], (3,)."""
    transmit_beams: Beams
    receive_beams: Beams
    laws: Mapping[int, Law | None]
    """How bed and surface answer, by what is met."""
    attenuation: float
    """Intensity lost to absorption along each metre [Np/m]."""

    @property
    def farthest(self) -> float:
        """Length of the longest way out and back that is heard [m]."""
        return self.scene.water.sound_speed * max(self.ping_geometry.recorded_delays[1], 0.0)


@dataclass(frozen=True, slots=True)
class RayBundle:
    """Rays of one chain of mirrors, n of them, in the lattice's frame."""

    chain: str
    """Letters of the mirrors met so far, in order: S surface, B bed, T a target's face."""
    origin: Floats
    """Where they are [m], (n, 3)."""
    way: Floats
    """Where they go [1], (n, 3)."""
    length: Floats
    """Path so far [m], (n,)."""
    launch: Floats
    """Directions in which they left the sonar [1], (n, 3)."""
    solid_angle: Floats
    """That each stands for [sr], (n,)."""
    left: Floats
    """Part of the energy that the mirrors have left [1], (n,)."""
    flat: bool = True
    """Whether all mirrors so far are flat, so that rays spread as straight ones do."""

    def take(self, rows: Rows) -> "RayBundle":
        """Some of the rays."""
        return RayBundle(
            self.chain, self.origin[rows], self.way[rows], self.length[rows], self.launch[rows],
            self.solid_angle[rows], self.left[rows], self.flat,
        )  # fmt: skip

    @property
    def family(self) -> str:
        """Name of the chain: D where no mirror was met."""
        return self.chain or "D"


@dataclass(frozen=True, slots=True)
class RayHits:
    """Where rays of one chain meet one interface."""

    rays: RayBundle
    """The rays as they arrive: origin at the hit, way towards it."""
    normal: Floats
    """Unit normal into the water [1], (n, 3)."""
    contribution: str
    """What is met: "seabed", "surface" or "target"."""
    owner: str
    """Who: "seabed", "surface" or a target's label."""
    letter: str
    """How the mirror is written in chains."""
    law: Law | None
    """How the interface scatters."""
    mirror: float
    """Share of the energy that a target's face mirrors [1]; bed and surface have coefficients of their own."""
    flat: bool = True
    """Whether the mirror is flat; a round body is told from one with faces by the angles at its edges."""
