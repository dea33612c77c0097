"""Legs off a moving surface, by the models of `Surface.reflection`, and off a rough seabed."""

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
    """Legs of one end of the sonar off a moving surface and a rough seabed.

    Args:
        legs: Legs off a flat surface, f families to n points.
        scene: The scene.
        seed: Seed of the scenario.
        scatterers: Ends of the legs.
        frequency: Frequency of the sound [Hz].
        sonar_end: End of the sonar at which the legs begin, and its time.
        follow_bed: False: bottom bounces are left as they are.

    Returns:
        Transmit legs and receive legs: of the same families, of which those reflected by a rough boundary may
        have further rows.
    """
    if scene.surface.reflection == "tilted":
        return tilted_legs(legs, scene, scatterers, sonar_end)
    if scene.surface.reflection == "explicit":
        return explicit_surface_legs(legs, scene, seed, scatterers, frequency, sonar_end)
    return glint_surface(scene, seed, frequency, follow_bed=follow_bed).legs(legs, scatterers, sonar_end)


def repeated_glint_weight(transmit_legs: Legs, receive_legs: Legs, pair: NDArray[np.int64]) -> NDArray[np.float64]:
    """Weight of pairs of two glints of one ray [1], shape (p,): 1 for all other pairs.

    M glints stand for very many, hardly any of which reflects both legs: pairs of the same glint are left out,
    and the M (M - 1) others carry the power of M^2. Each two of them are reciprocal and interfere while they keep their
    phases, so that E|rho_t rho_r|^2 is 1 + |E[rho_t rho_r*]|^2, as for a circular Gaussian rho.

    Args:
        transmit_legs: Transmit legs.
        receive_legs: Receive legs.
        pair: Row of the transmit and the receive leg of each ordered pair, shape (p, 2).
    """
    weight = np.ones(len(pair))
    if transmit_legs.glints is None or receive_legs.glints is None:
        return weight
    for row, (i, j) in enumerate(pair):
        transmit_bounce, receive_bounce = transmit_legs.glints.bounce_id[i], receive_legs.glints.bounce_id[j]
        if transmit_bounce >= 0 and transmit_bounce >> GLINT_BITS == receive_bounce >> GLINT_BITS:
            ray = transmit_bounce >> GLINT_BITS
            count = len({label for label in transmit_legs.glints.bounce_id if label >> GLINT_BITS == ray})
            weight[row] = 0.0 if transmit_bounce == receive_bounce else np.sqrt(count / (count - 1))
    return weight
