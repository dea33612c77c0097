"""Records of the tracer: the geometry of one ping, ray bundles, and their hits."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

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
    """One ping in the scatterer grid's frame: what every part of its rays needs."""

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
    """Scattering laws of seabed and surface, by interface."""
    attenuation: float
    """Intensity lost to absorption along each metre [Np/m]."""
    is_reversed: bool = False
    """True: transmitter and receiver are exchanged, so that rays from the receiver reach targets' faces on its side."""

    @property
    def farthest(self) -> float:
        """Length of the longest two-way path that is received [m]."""
        return self.scene.water.sound_speed * max(self.ping_geometry.recorded_delays[1], 0.0)

    def exchanged(self, launch_sampler: LaunchSampler) -> "TracedPing":
        """The ping with both ends of the sonar exchanged.

        Args:
            launch_sampler: Sampler of the rays from the receiver.
        """
        return replace(
            self, launch_sampler=launch_sampler, transmit=self.receive, receive=self.transmit,
            transmit_beams=self.receive_beams, receive_beams=self.transmit_beams, is_reversed=not self.is_reversed,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class RayBundle:
    """Rays of one chain of mirrors, n of them, in the scatterer grid's frame."""

    chain: str
    """Letters of the reflections so far, in order: S surface, B seabed, T a target's face."""
    origin: Floats
    """Positions [m], (n, 3)."""
    way: Floats
    """Directions [1], (n, 3)."""
    length: Floats
    """Path lengths so far [m], (n,)."""
    launch: Floats
    """Directions in which they left the sonar [1], (n, 3)."""
    solid_angle: Floats
    """That each represents [sr], (n,)."""
    left: Floats
    """Part of the energy that the mirrors have left [1], (n,)."""
    receiver_image: Floats
    """Images of the receiver in the mirrors so far, round ones as flat as they are at the hit [m], (n, 3)."""
    flat: bool = True
    """True: all reflections so far are off flat faces, so that spreading is that of a straight path."""

    def take(self, rows: Rows) -> "RayBundle":
        """Some of the rays."""
        return RayBundle(
            self.chain, self.origin[rows], self.way[rows], self.length[rows], self.launch[rows],
            self.solid_angle[rows], self.left[rows], self.receiver_image[rows], self.flat,
        )  # fmt: skip

    @property
    def family(self) -> str:
        """Name of the chain: D without reflections."""
        return self.chain or "D"


@dataclass(frozen=True, slots=True)
class RayHits:
    """Hits of the rays of one chain on one interface."""

    rays: RayBundle
    """The rays as they arrive: origin at the hit, way towards it."""
    normal: Floats
    """Unit normal into the water [1], (n, 3)."""
    contribution: str
    """Kind of interface: "seabed", "surface" or "target"."""
    object: str
    """Object: "seabed", "surface" or a target's label."""
    letter: str
    """Letter of the reflection in chains."""
    law: Law | None
    """Scattering law of the interface."""
    mirror: float
    """Share of the energy that a target's face mirrors [1]; bed and surface have coefficients of their own."""
    flat: bool = True
    """True: the mirror is flat; a round body is given from one with faces by the angles at its edges."""
