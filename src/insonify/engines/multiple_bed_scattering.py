"""Paths scattered by the seabed several times, counted once.

A path may be scattered near the specular direction by the seabed's roughness at several bounces: a second bottom echo,
b-H-b, at two. One of them is the scatterer of the sampled seabed, and glints are the others. Each bounce may be the
scatterer, so the same path is in several pairs: in D-BH with the second bounce as scatterer, in BH-D with the first.
The energy of a pair is divided by the number of its incoherent bounces that some pair has as its scatterer.

Bounces are incoherent with probability 1 - exp(-nu) each, nu the mean number of quanta of a bounce, on the condition
that a glint leg has one quantum. Scattering by more than a third of the sound's wavenumber, and in the sediment, is of
the law alone, and counted once already.
"""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import bounce_sequence
from insonify.propagation.wind_waves import SLOPE_CUT
from insonify.records.legs import Legs
from insonify.scattering.compiled_law import CompiledLaw

Floats = NDArray[np.float64]


def counted_once(
    section: Floats, transmit: Legs, receive: Legs, pair: NDArray[np.int64], normal: Floats, interface: CompiledLaw
) -> Floats:
    """Cross sections of pairs at the seabed, so that each path scattered several times counts once [1], shape (p, n).

    Args:
        section: Cross sections by the whole law [1], shape (p, n).
        transmit: Transmit legs, some of them reflected by glints of the seabed.
        receive: Receive legs.
        pair: Row of the transmit and of the receive leg of each ordered pair, shape (p, 2).
        normal: Normals of the seabed at the scatterers, shape (n, 3).
        interface: Law of the sediment's surface alone.
    """
    if transmit.glints is None or transmit.glints.bed_quanta is None:
        return section
    if receive.glints is None or receive.glints.bed_quanta is None:
        return section
    followed = {bounce_sequence(name) for name in transmit.families}
    result = section.copy()
    for row, (i, j) in enumerate(pair):
        first, second = (
            legs.glints is not None and legs.glints.bounce_id[at] >= 0 for legs, at in ((transmit, i), (receive, j))
        )
        scatterer_counts = other_scatterers(transmit.families[i], receive.families[j], followed)
        if not (first and scatterer_counts[0]) and not (second and scatterer_counts[1]):
            continue
        points = _near_specular(transmit, receive, i, j)
        if not len(points):
            continue
        counts = [
            incoherent_bounces(legs, at, number, points)
            for legs, at, number in zip((transmit, receive), (i, j), scatterer_counts, strict=True)
        ]
        repeated = sum(
            sent * received / (1 + m + k) for m, sent in enumerate(counts[0]) for k, received in enumerate(counts[1])
        )
        surface = interface.cross_section(
            transmit.arrival[i, points].T, -receive.arrival[j, points].T, normal[points].T
        )
        result[row, points] -= np.minimum(surface, section[row, points]) * (1 - repeated)
    return result


def without_face_echoes(
    section: Floats, transmit: Legs, receive: Legs, pair: NDArray[np.int64], normal: Floats, interface: CompiledLaw,
    target_families: Iterable[str],
) -> Floats:  # fmt: skip
    """Cross sections of pairs at the seabed without paths that are also echoes of smooth faces [1], shape (p, n).

    A path that the seabed scatters near the specular direction and a face reflects, D-F, is also the echo of that face
    by a bottom bounce, B-D: its coherent part and its glints have all of the reflected energy.

    Args:
        section: Cross sections [1], shape (p, n).
        transmit: Transmit legs, some of them by way of faces.
        receive: Receive legs.
        pair: Row of the transmit and of the receive leg of each ordered pair, shape (p, 2).
        normal: Normals of the seabed at the scatterers, shape (n, 3).
        interface: Law of the sediment's surface alone.
        target_families: Families that reach targets; none where targets return no sound.
    """
    followed, result = {bounce_sequence(name) for name in target_families}, section.copy()
    for row, (i, j) in enumerate(pair):
        if is_face_echo(transmit.families[i], receive.families[j], followed):
            points = _near_specular(transmit, receive, i, j)
            surface = interface.cross_section(
                transmit.arrival[i, points].T, -receive.arrival[j, points].T, normal[points].T
            )
            result[row, points] -= np.minimum(surface, section[row, points])
    return result


def is_face_echo(transmit: str, receive: str, followed: set[str]) -> bool:
    """True for a pair at the seabed whose path is also the echo of a face, by two families that reach it.

    Args:
        transmit: Family of the transmit leg.
        receive: Family of the receive leg.
        followed: Families that reach targets, as letters of their bounces.

    Example:
        >>> is_face_echo("D", "F", {"", "B"}), is_face_echo("D", "F", {""}), is_face_echo("D", "FS", {"", "B"})
        (True, False, False)
    """
    legs = bounce_sequence(transmit), bounce_sequence(receive)
    for leg, other in (legs, legs[::-1]):
        before, face, after = leg.partition("F")
        if face and before in followed and other + "B" + after[::-1] in followed:
            return True
    return False


def _near_specular(transmit: Legs, receive: Legs, i: int, j: int) -> NDArray[np.int64]:
    """Points at which a pair of legs is as near the specular direction of the flat seabed as glints are, shape (k,)."""
    change = np.hypot(*(transmit.arrival[i, :, :2] + receive.arrival[j, :, :2]).T)
    return np.flatnonzero(change < 1 / SLOPE_CUT)


def other_scatterers(transmit: str, receive: str, followed: Iterable[str]) -> tuple[int, int]:
    """Numbers of bottom bounces of a pair's legs at which the same path has its scatterer in another pair.

    Args:
        transmit: Family of the transmit leg.
        receive: Family of the receive leg.
        followed: Families that reach the seabed, as letters of their bounces.

    Example:
        >>> other_scatterers("BH", "D", {"", "BH"})
        (1, 0)
    """

    def count(leg: str, other_leg: str) -> int:
        bounces = (at for at, letter in enumerate(leg) if letter == "B")
        return sum(leg[:at] in families and other_leg + "B" + leg[:at:-1] in families for at in bounces)

    families, legs = set(followed), (bounce_sequence(transmit), bounce_sequence(receive))
    return count(*legs), count(*legs[::-1])


def incoherent_bounces(legs: Legs, row: int, number: int, points: NDArray[np.int64]) -> list[Floats]:
    """Probabilities that 0, 1, ... of some bottom bounces of a leg are incoherent [1], each of shape (k,).

    Args:
        legs: Legs with glints of the seabed.
        row: One row of them.
        number: Number of its bottom bounces that count.
        points: Columns, k of them.
    """
    assert legs.glints is not None
    assert legs.glints.bed_quanta is not None
    if legs.glints.bounce_id[row] < 0:
        return [np.ones(len(points))]
    single, every = legs.glints.bed_quanta[:, row, points]
    coherent, any_quantum = np.exp(-single), np.maximum(-np.expm1(-every), 1e-12)
    bounces = [
        math.comb(number, m) * (1 - coherent) ** m * coherent ** (number - m) / any_quantum for m in range(number + 1)
    ]
    bounces[0] = np.maximum(1 - sum(bounces[1:], np.zeros(len(points))), 0.0)
    return bounces
