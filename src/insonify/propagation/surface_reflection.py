"""Legs reflected by a moving surface, by the models of `Surface.reflection`, and by a rough seabed."""

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.explicit_surface import explicit_surface_legs
from insonify.propagation.glints import GLINT_BITS, SonarEnd, glint_surface
from insonify.propagation.tilted_reflection import tilted_legs
from insonify.records.legs import Legs
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

__all__ = ["SonarEnd", "apply_surface_reflection", "repeated_glint_weight"]


def apply_surface_reflection(
    legs: Legs, scene: Scene, seed: int, scatterers: Scatterers, frequency: float, sonar_end: SonarEnd,
    *, follow_bed: bool = True,
) -> tuple[Legs, Legs]:  # fmt: skip
    """Legs of one end of the sonar reflected by a moving surface and a rough seabed.

    Args:
        legs: Legs reflected by flat boundaries, f families to n points.
        scene: The scene.
        seed: Seed of the scenario.
        scatterers: Ends of the legs.
        frequency: Frequency of the sound [Hz].
        sonar_end: End of the sonar at which the legs begin, and its time.
        follow_bed: False: the seabed counts as smooth.

    Returns:
        Transmit legs and receive legs: of the same families, of which those reflected by a rough boundary may
        have further rows. They are the given legs where no boundary changes them.

    Example:
        >>> from insonify.propagation.image_sources import image_legs
        >>> from insonify.scene.scene import Scene, point_scatterer
        >>> from insonify.scene.target import PointTarget
        >>> scene = Scene(seabed={"depth": 35}, surface={"reflection": "statistical", "wind_speed": 5})
        >>> sonar, point = np.array([0.0, 0.0, 10.0]), point_scatterer(PointTarget(position=(40, 0, 20)))
        >>> calm = image_legs(scene, sonar, point, ("D", "S"), 100e3)
        >>> rough, _ = apply_surface_reflection(calm, scene, 1, point, 100e3, SonarEnd(sonar, ping_time=0.0))
        >>> power = np.sum(abs(rough.amplitude[1:]) ** 2) / abs(calm.amplitude[1, 0]) ** 2
        >>> print(rough.ray_names, (10 * np.log10(power)).round(1))  # glints, less what bubbles absorb [dB]
        ('D', 'S2', 'S3', 'S4', 'S5', 'S6', 'S7') -0.5
    """
    if scene.surface.reflection == "tilted":
        return tilted_legs(legs, scene, scatterers, sonar_end)
    if scene.surface.reflection == "explicit":
        return explicit_surface_legs(legs, scene, seed, scatterers, frequency, sonar_end)
    return glint_surface(scene, seed, frequency, follow_bed=follow_bed).legs(legs, scatterers, sonar_end)


def repeated_glint_weight(transmit_legs: Legs, receive_legs: Legs, pair: NDArray[np.int64]) -> NDArray[np.float64]:
    """Weight on the pressure of pairs of two glints of one ray [1], shape (p,): 1 for all other pairs.

    M glints stand for very many, hardly any of which reflects both legs: pairs of the same glint are left out,
    and the M (M - 1) others carry the power of M^2. Each two of them are reciprocal and interfere while they keep their
    phases, so that E|rho_t rho_r|^2 is 1 + |E[rho_t rho_r*]|^2, as for a circular Gaussian rho.

    Args:
        transmit_legs: Transmit legs.
        receive_legs: Receive legs.
        pair: Row of the transmit and the receive leg of each ordered pair, shape (p, 2).

    Example:
        >>> from insonify.propagation.image_sources import image_legs
        >>> from insonify.scene.scene import Scene, point_scatterer
        >>> from insonify.scene.target import PointTarget
        >>> scene = Scene(seabed={"depth": 35}, surface={"reflection": "statistical", "wind_speed": 5})
        >>> sonar, point = np.array([0.0, 0.0, 10.0]), point_scatterer(PointTarget(position=(40, 0, 20)))
        >>> calm = image_legs(scene, sonar, point, ("D", "S"), 100e3)
        >>> legs = apply_surface_reflection(calm, scene, 1, point, 100e3, SonarEnd(sonar, ping_time=0.0))
        >>> repeated_glint_weight(*legs, np.array([(0, 0), (2, 2), (2, 3)])).round(3).tolist()
        [1.0, 0.0, 1.095]
    """
    weight = np.ones(len(pair))
    if transmit_legs.glints is None or receive_legs.glints is None:
        return weight
    for row, (i, j) in enumerate(pair):
        transmit_bounce, receive_bounce = transmit_legs.glints.bounce_id[i], receive_legs.glints.bounce_id[j]
        if transmit_bounce >= 0 and transmit_bounce >> GLINT_BITS == receive_bounce >> GLINT_BITS:
            ray = transmit_bounce >> GLINT_BITS
            count = len({glint for glint in transmit_legs.glints.bounce_id if glint >> GLINT_BITS == ray})
            weight[row] = 0.0 if transmit_bounce == receive_bounce else np.sqrt(count / (count - 1))
    return weight
