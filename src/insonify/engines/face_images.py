"""Images of the sonar in smooth faces: positions and beams from which faces insonify ground outside the beams.

Legs by way of a face are straight or refracted from the image, and leave by the beams as the face reflects them. So
what the beams reach by way of a face is what those of the image reach in front of it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insonify.engines.face_reflection import face_families, faces_in_reach, lit_points
from insonify.propagation.families import DIRECT, families_reaching
from insonify.propagation.path_settings import PathSettings
from insonify.scene.flat_faces import FlatFace
from insonify.scene.scatterers import Boundary
from insonify.scene.scene import Scene
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FaceImage:
    """Image of the sonar in one face, for the scatterers of one boundary."""

    face: FlatFace
    sonar: PingGeometry
    """The sonar with its ends and beams at the image."""
    families: tuple[str, ...]
    """Families from the image that reach the boundary."""
    max_rise: float
    """Largest vertical distance that a path covers [m]."""
    origin: Floats
    """North and east of the origin of positions [m], shape (2,)."""

    def lights(self, position: Floats, depth: float, radius: Floats) -> NDArray[np.int64]:
        """Rows of the positions to whose neighbourhoods the face may reflect sound, shape (m,).

        Args:
            position: North and east about the origin [m], shape (n, 2).
            depth: Depth of the positions [m].
            radius: Radius of the neighbourhood of each [m], shape (n,).
        """
        points = np.column_stack([position + self.origin, np.full(len(position), depth)])
        lit = np.zeros(len(points), bool)
        for end in self.ends:
            lit |= lit_points(self.face, end, points, self.sonar.wavelength, max_rise=self.max_rise, radius=radius)
        return np.flatnonzero(lit)

    @property
    def ends(self) -> tuple[Floats, Floats]:
        """North, east, depth of transmitter and receiver themselves, in the world [m], shapes (3,)."""
        shift = np.array([*self.origin, 0.0])
        return (
            self.face.image(self.sonar.transmit_position + shift),
            self.face.image(self.sonar.receive_position + shift),
        )

    def about(self, origin: Floats) -> "FaceImage":
        """The image with positions about another origin (north, east) [m]."""
        shift = np.array([*(self.origin - origin), 0.0])
        ends = self.sonar.transmit_position + shift, self.sonar.receive_position + shift
        sonar = replace(self.sonar, transmit_position=ends[0], receive_position=ends[1])
        return replace(self, sonar=sonar, origin=np.asarray(origin))

    @property
    def key(self) -> tuple[bytes, ...]:
        """Key of the parameters on which a layout of points about the origin depends."""
        sonar = self.sonar
        return sonar.transmit_position.tobytes(), sonar.receive_position.tobytes(), sonar.transmit_beams.axes.tobytes()


def face_images(
    scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry, boundary: Boundary
) -> tuple[FaceImage, ...]:
    """Images of the sonar in all faces that reflect its sound to a boundary.

    Args:
        scene: The scene.
        path_settings: Path settings.
        ping_geometry: The sonar at this ping.
        boundary: Boundary of the scatterers.
    """
    reached, images = families_reaching(boundary, face_families(path_settings)), list[FaceImage]()
    for face in faces_in_reach(scene, path_settings, ping_geometry):
        families = reached if face.is_upright else tuple(name for name in reached if name == DIRECT)
        mirror = np.eye(3) - 2 * np.outer(face.axes[0], face.axes[0])
        boresight = ping_geometry.boresight @ mirror
        sonar = replace(
            ping_geometry, transmit_position=face.image(ping_geometry.transmit_position),
            receive_position=face.image(ping_geometry.receive_position), boresight=boresight,
            transmit_beams=ping_geometry.transmit_beams.rotated(ping_geometry.transmit_beams.axes @ mirror),
            receive_beams=ping_geometry.receive_beams.rotated(ping_geometry.receive_beams.axes @ mirror),
            first_beam_bearing=float(np.arctan2(boresight[1], boresight[0])),
        )  # fmt: skip
        if families:
            max_rise = scene.seabed.depth * path_settings.max_reflections
            images.append(FaceImage(face, sonar, families, max_rise, np.zeros(2)))
    return tuple(images)
