"""Records of the tracer: the geometry of one ping, ray bundles, and their hits."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer.facet_scattering import FacetSurface
from insonify.engines.tracer.launch_sampling import LaunchSampler
from insonify.engines.tracer.tracing_scene import RayIntersector
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.scene.scatterers import Law
from insonify.scene.scene import Scene
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]
Rows = NDArray[np.bool_] | NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class TracedPing:
    """One ping in the scatterer grid's frame: scene, beams, laws and sampler common to all its rays."""

    scene: Scene
    path_settings: PathSettings
    ping_geometry: PingGeometry
    intersector: RayIntersector
    launch_sampler: LaunchSampler
    transmit: Floats
    """Position of the transmitter in the frame of the rays [m], (3,)."""
    receive: Floats
    """Position of the receiver in the frame of the rays [m], (3,)."""
    transmit_beams: Beams
    receive_beams: Beams
    laws: Mapping[int, Law | None]
    """Scattering laws of seabed and surface, by `BED` and `SURFACE`."""
    attenuation: float
    """Absorption coefficient of intensity: it falls as exp(-attenuation x path length) [1/m]."""
    propagation_model: PropagationModel | None = None
    """Propagation model of layered water; None in water of one sound speed."""
    facets: FacetSurface | None = None
    """Facets of a moving surface; None: it is flat."""
    is_reversed: bool = False
    """True: transmitter and receiver are exchanged, and rays leave the receiver."""

    @property
    def longest_path(self) -> float:
        """Length of the longest path from transmitter to receiver that is recorded [m]."""
        return self.scene.water.max_sound_speed * max(self.ping_geometry.recorded_delays[1], 0.0)

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
    """Rays with one chain of specular reflections, n of them, in the scatterer grid's frame."""

    chain: str
    """Letters of the reflections so far, in order: S surface, s a facet of a moving surface, B seabed, T a target's
    face."""
    origin: Floats
    """Positions [m], (n, 3)."""
    direction: Floats
    """Unit vectors along the rays [1], (n, 3)."""
    length: Floats
    """Path lengths from the sonar, so far [m], (n,)."""
    delay: Floats
    """One-way travel times from the sonar, so far [s], (n,)."""
    launch: Floats
    """Unit vectors in which they left the sonar [1], (n, 3)."""
    solid_angle: Floats
    """Solid angle that each represents [sr], (n,)."""
    energy_fraction: Floats
    """Fraction of the energy that remains after the reflections so far, without absorption [1], (n,)."""
    receiver_image: Floats
    """Images of the receiver in the reflecting planes so far, curved faces by their tangent planes [m], (n, 3)."""
    last_facet: Floats
    """Last reflection by a facet of a moving surface, 0 for none: travel time to it [s], mean rate of the phase there
    [rad/s] and its variance [rad^2/s^2], and position [m], (n, 6)."""
    is_flat: bool = True
    """True: no reflection so far is at a curved face, so that spreading is that of a straight path."""

    def take(self, rows: Rows) -> "RayBundle":
        """The rays of some rows."""
        return RayBundle(
            self.chain, self.origin[rows], self.direction[rows], self.length[rows], self.delay[rows],
            self.launch[rows], self.solid_angle[rows], self.energy_fraction[rows], self.receiver_image[rows],
            self.last_facet[rows], self.is_flat,
        )  # fmt: skip

    @property
    def family(self) -> str:
        """Letters of the chain in capitals, D without reflections; see the glossary's family."""
        return self.chain.upper() or "D"


class ReceiverPaths(NamedTuple):
    """Paths from n positions to the receiver by a chain of flat faces and boundaries."""

    leaving_hit: Floats
    """Directions in which they leave the positions [1], (n, 3)."""
    receiver_direction: Floats
    """Directions at the receiver, from it towards the last reflection [1], (n, 3)."""
    length: Floats
    """Lengths [m], (n,)."""
    delay: Floats
    """One-way travel times [s], (n,)."""
    spreading: Floats
    """Intensity by spreading re 1 m [1], (n,)."""
    energy_fraction: Floats
    """Fraction of the energy that remains after the reflections [1], (n,)."""
    is_clear: NDArray[np.bool_]
    """True where the path reaches the receiver unobstructed, by the reflections of the chain, (n,)."""


@dataclass(frozen=True, slots=True)
class RayHits:
    """Hits of the rays of one chain on one interface."""

    rays: RayBundle
    """The rays as they arrive: origin at the hit, direction towards it."""
    normal: Floats
    """Unit normal into the water [1], (n, 3)."""
    contribution: str
    """Kind of interface: "seabed", "surface" or "target"."""
    object: str
    """Object that is hit: "seabed", "surface" or a target's label."""
    letter: str
    """Letter of a reflection at this interface in chains: B, S or T."""
    law: Law | None
    """Scattering law of the interface."""
    specular_fraction: float
    """Fraction of the energy that a target's face reflects specularly [1]; 0 for seabed and surface."""
    is_flat: bool = True
    """True: the reflecting face is flat, see `tracing_scene.has_flat_faces`."""
