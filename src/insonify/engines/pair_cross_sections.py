"""Cross sections of the ordered pairs of legs at scatterers under any law but separable ones and smooth faces."""

import numpy as np
from numpy.typing import NDArray

from insonify.records.legs import Legs
from insonify.scattering.compiled_law import CompiledLaw
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Law, Scatterers

Floats = NDArray[np.float64]


def cross_sections(
    scatterers: Scatterers, law: Law, transmit_legs: Legs, receive_legs: Legs, pair: NDArray[np.int64],
    amplitude_weight: NDArray[np.float32] | None = None,
) -> Floats:  # fmt: skip
    """Cross section of each ordered pair, per area on boundaries and faces [1], of point targets [m^2], shape (p, n).

    Values for legs that do not exist and pairs that are not evaluated are undefined; they get zero weight later.
    """
    i, j = pair.T
    if transmit_legs.arrival is receive_legs.arrival:
        # every law is reciprocal: the two orders of a pair are evaluated once
        unique, inverse = np.unique(np.sort(pair, axis=1), axis=0, return_inverse=True)
        if len(unique) < len(pair):
            unique_weight = (
                None if amplitude_weight is None else amplitude_weight[np.unique(inverse.ravel(), return_index=True)[1]]
            )
            return cross_sections(scatterers, law, transmit_legs, receive_legs, unique, unique_weight)[inverse.ravel()]
    if isinstance(law, CompiledLaw):
        return _compiled_sections(law, scatterers.normal, transmit_legs, receive_legs, pair, amplitude_weight)
    if isinstance(law, PointTargetLaw):
        return np.broadcast_to(law.cross_section(*np.zeros((3, 1))), (len(pair), len(scatterers)))
    # On a flat boundary all legs to and from one position share one bearing.
    is_flat = scatterers.boundary != "target" and bool(np.all(scatterers.normal[:, :2] == 0))
    if transmit_legs is receive_legs and is_flat:
        azimuth = np.array(np.pi)
    else:  # pair by pair, which saves the memory of vectors for all
        azimuths = [_azimuth(scatterers.normal, transmit_legs.arrival[a], receive_legs.arrival[b]) for a, b in pair]
        azimuth = np.array(azimuths).reshape(len(pair), len(scatterers))
    incident, scattered = (np.arcsin(np.abs(legs.grazing_sine)) for legs in (transmit_legs, receive_legs))
    return np.asarray(law.cross_section(incident[i], scattered[j], azimuth))


def _compiled_sections(
    law: CompiledLaw, normal: Floats, transmit_legs: Legs, receive_legs: Legs, pair: NDArray[np.int64],
    amplitude_weight: NDArray[np.float32] | None,
) -> Floats:  # fmt: skip
    """Cross sections by a compiled law, 0 where a pair is not evaluated [1], shape (p, n)."""
    sections = np.zeros((len(pair), len(normal)))
    for row, (i, j) in enumerate(pair):
        columns = (
            slice(None)
            if amplitude_weight is None or amplitude_weight[row].all()
            else np.flatnonzero(amplitude_weight[row])
        )
        sections[row, columns] = law.cross_section(
            transmit_legs.arrival[i, columns].T, -receive_legs.arrival[j, columns].T, normal[columns].T
        )
    return sections


def _azimuth(normal: Floats, transmit_arrival: Floats, receive_arrival: Floats) -> Floats:
    """Bistatic azimuth of two legs in the plane of the interface, pi for backscatter [rad], by their arrivals."""
    arrivals = transmit_arrival, receive_arrival
    a, b = (ray - np.sum(ray * normal, axis=-1, keepdims=True) * normal for ray in arrivals)
    cross = np.sum(np.cross(a, b) * normal, axis=-1)
    return np.asarray(np.pi - np.abs(np.arctan2(cross, np.sum(a * b, axis=-1))))
