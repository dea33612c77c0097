"""Arrivals: the two-way paths of one ping, one row each (the spike array)."""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from insonify.records.legs import ray_name
from insonify.records.pairs import Pairs
from insonify.units import level_db

Floats = NDArray[np.float64]
ChannelArrivals = Callable[[int], tuple[Floats, Floats, Floats, Floats, Floats]]

MAX_ROWS_LISTED = 40
"""Most paths that are printed row by row."""
ROWS_OF_SHORT_LIST, ROWS_OF_LONG_LIST, MAX_KINDS_LISTED = 20, 10, 20
"""Rows printed of a short list, strongest rows printed of a long one, and its kinds."""


@dataclass(frozen=True, slots=True)
class Arrivals:
    """Two-way paths of one ping, as columns of equal length n.

    Example:
        >>> changes = {"paths.contributions": ["target"], "paths.families": ["D", "S"]}
        >>> insonify.arrivals(insonify.load_scenario("sidescan.yaml").with_(changes), ping=40)  # of a buoy to port
        Arrivals: 4 paths, 36.2-54.2 ms; levels in dB re the source at 1 m, before beams
          row       delay      level    phase  object         out    back
            1    36.173 ms   -69.2 dB     0 deg  buoy           D      D
            2    45.206 ms   -73.1 dB   180 deg  buoy           S      D
            3    45.215 ms   -73.1 dB   180 deg  buoy           D      S
            4    54.249 ms   -77.1 dB     0 deg  buoy           S      S
    """

    delay: Floats
    """Two-way travel time from the start of transmission to the selected channel [s], shape (n,)."""
    amplitude: NDArray[np.complex64]
    """Pressure re the source at 1 m at the centre of the band, phase of reflections and of the scatterer only [1],
    shape (n,)."""
    band_absorption: NDArray[np.float32]
    """Pressure ratio by absorption at each frequency of `sonar.receiver.sub_bands`, from the lowest, re that at the
    centre of the band [1], shape (n, bands); one column of 1 where there is one frequency."""
    spreading: Floats
    """Pressure ratio by geometric spreading, both legs [1], shape (n,)."""
    absorption: Floats
    """Pressure ratio by absorption, both legs [1], shape (n,)."""
    reflection_coefficient: NDArray[np.complex128]
    """Product of all reflection coefficients, both legs [1], shape (n,)."""
    scattering_amplitude: Floats
    """Pressure scattered to 1 m re incident pressure [m], shape (n,)."""
    group: NDArray[np.int64]
    """Number of the coherent group: a scatterer, or a deterministic target; one group interferes in the mean, shape
    (n,)."""
    transmit_family: NDArray[np.str_]
    """Family of the transmit leg, shape (n,); of a boundary echo that of its whole path, from the transmitter on."""
    receive_family: NDArray[np.str_]
    """Family of the receive leg, named from the sonar outwards too, shape (n,); empty for a boundary echo."""
    transmit_branch: NDArray[np.uint8]
    """Number of the transmit ray within its family, from 0, by launch angle, shape (n,)."""
    receive_branch: NDArray[np.uint8]
    """Number of the receive ray within its family, from 0, by launch angle, shape (n,)."""
    caustics: NDArray[np.uint8]
    """Caustics touched by both legs; each advances the phase by 90 degrees, shape (n,)."""
    object: NDArray[np.str_]
    """Object that returns the echo: "seabed", "surface", "water", "boundary echo" or the label of a target or a patch,
    shape (n,)."""
    position: Floats
    """Position of the scatterer: north, east, depth [m], shape (n, 3)."""
    departure: Floats
    """Unit vector of travel at the transmitter, shape (n, 3)."""
    arrival: Floats
    """Unit vector from the receiver towards the arriving sound, shape (n, 3)."""
    transmit_grazing: Floats
    """Grazing angle of the transmit leg at the scatterer [rad], shape (n,)."""
    receive_grazing: Floats
    """Grazing angle of the receive leg at the scatterer [rad], shape (n,)."""
    doppler: Floats
    """Doppler factor less one, d(emission) / d(arrival) - 1 [1], shape (n,)."""

    def __post_init__(self) -> None:
        """Refuse columns of unequal length."""
        for column in fields(self):
            rows = len(getattr(self, column.name))
            if rows != self.delay.size:
                raise ValueError(f"Arrivals.{column.name} has {rows} rows; delay has {self.delay.size}")

    def __len__(self) -> int:
        """Number of paths."""
        return int(self.delay.size)

    @property
    def bounces(self) -> NDArray[np.int64]:
        """Specular reflections off surface and bottom, both legs together, shape (n,)."""
        names = np.char.replace(self.transmit_family, "D", ""), np.char.replace(self.receive_family, "D", "")
        return np.asarray(np.char.str_len(names[0]) + np.char.str_len(names[1]))

    def ray_names(self, row: int) -> tuple[str, str]:
        """Names of the transmit and receive ray of one path: families, with numbers where a family has several rays."""
        transmit = ray_name(str(self.transmit_family[row]), int(self.transmit_branch[row]))
        return transmit, ray_name(str(self.receive_family[row]), int(self.receive_branch[row]))

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64] | slice) -> "Arrivals":
        """The arrivals of some rows."""
        return Arrivals(*(getattr(self, column.name)[rows] for column in fields(self)))

    def __repr__(self) -> str:
        """Summary: a short list row by row, a long one by kind of path, with its strongest rows."""
        if not len(self):
            return "Arrivals: no paths"
        span = f"{self.delay.min() * 1e3:.1f}-{self.delay.max() * 1e3:.1f} ms"
        count = f"{len(self)} path{'s' * (len(self) != 1)}"
        head = f"Arrivals: {count}, {span}; levels in dB re the source at 1 m, before beams"
        order = np.argsort(self.delay, kind="stable")
        if len(self) <= MAX_ROWS_LISTED:
            more = [f"  ... and {len(self) - ROWS_OF_SHORT_LIST} more"] if len(self) > ROWS_OF_SHORT_LIST else []
            return "\n".join([head, *self._path_rows(order, np.arange(len(self))[:ROWS_OF_SHORT_LIST]), *more])
        strongest = np.argsort(-self._level()[order], kind="stable")[:ROWS_OF_LONG_LIST]
        strongest_rows = [
            f"  the {ROWS_OF_LONG_LIST} strongest, in order of arrival:",
            *self._path_rows(order, np.sort(strongest)),
        ]
        return "\n".join([head, *self._kind_rows(), *strongest_rows])

    def _level(self) -> Floats:
        """Level of each path [dB re the source at 1 m]."""
        return level_db(np.abs(self.amplitude) ** 2)

    def _path_rows(self, order: NDArray[np.int64], ranks: NDArray[np.int64]) -> list[str]:
        """Printed rows of some paths, by their ranks in the order of arrival."""
        level, phase = self._level(), np.degrees(np.angle(self.amplitude))
        lines = ["  row       delay      level    phase  object         out    back"]
        for rank, row in zip(ranks, order[ranks], strict=True):
            transmit_ray, receive_ray = self.ray_names(row)
            lines.append(
                f"{rank + 1:5d} {self.delay[row] * 1e3:9.3f} ms {level[row]:7.1f} dB {phase[row]:5.0f} deg  "
                f"{self.object[row]:<14s} {transmit_ray:<6s} {receive_ray}"
            )
        return lines

    def _kind_rows(self) -> list[str]:
        """Printed rows of kinds (object and unordered pair of families), the strongest first."""
        legs = np.stack([self.transmit_family, self.receive_family])
        names, leg = np.unique(legs, return_inverse=True)
        objects, object_row = np.unique(self.object, return_inverse=True)
        low, high = np.sort(leg.reshape(legs.shape), axis=0)
        kinds, kind = np.unique((object_row * len(names) + low) * len(names) + high, return_inverse=True)
        count = np.bincount(kind)
        first, last, highest = np.full(kinds.size, np.inf), np.full(kinds.size, -np.inf), np.full(kinds.size, -np.inf)
        np.minimum.at(first, kind, self.delay * 1e3)
        np.maximum.at(last, kind, self.delay * 1e3)
        np.maximum.at(highest, kind, self._level())
        lines = [f"  {'object':<14s} {'legs':<9s} {'paths':>8s} {'delays':>20s} {'strongest':>12s}"]
        for row in np.argsort(-highest, kind="stable")[:MAX_KINDS_LISTED]:
            code, b = divmod(int(kinds[row]), len(names))
            k, a = divmod(code, len(names))
            leg_names = "-".join(sorted(filter(None, (str(names[a]), str(names[b]))), key=_fewest_bounces))
            span = f"{first[row]:.2f}-{last[row]:.2f} ms"
            lines.append(f"  {objects[k]:<14s} {leg_names:<9s} {count[row]:8d} {span:>20s} {highest[row]:9.1f} dB")
        return lines + (
            [f"  ... and {kinds.size - MAX_KINDS_LISTED} weaker kinds"] if kinds.size > MAX_KINDS_LISTED else []
        )


def _fewest_bounces(family: str) -> tuple[bool, int, bool]:
    """Sort key of the two names of a pair: direct, then few bounces, then surface first."""
    return family != "D", len(family), not family.startswith("S")


def expand_arrivals(
    pairs: Pairs, first_group: int, factors: dict[tuple[str, str], NDArray[np.complex128]],
    channel_arrivals: ChannelArrivals | None = None,
) -> Arrivals:  # fmt: skip
    """Write out every path of a block of scatterers, row by row; missing paths are left out.

    Args:
        pairs: Block of scatterers with their legs and strengths.
        first_group: Number of the block's first group.
        factors: Perturbation of each ordered pair of rays (`Pairs.rays`), where there is one, each of shape (n,).
        channel_arrivals: Function from the row of an ordered pair to the arrivals at a channel: delays [s], (n,),
            factors on pressure [1], (n, bands), Doppler factors less one [1], (n,), directions [1], (n, 3); None: a
            channel at the centre of a stationary sonar.
    """
    n = len(pairs.scatterers)
    group = np.arange(first_group, first_group + n) if pairs.scatterers.has_random_phase else np.full(n, first_group)
    rows = [
        _rows(pairs, row, int(i), int(j), group, factors.get(names), channel_arrivals)
        for row, ((i, j), names) in enumerate(zip(pairs.pair, pairs.rays(), strict=True))
    ]
    arrivals = concatenate_arrivals(rows) if rows else no_arrivals()
    return arrivals.take(np.abs(arrivals.amplitude) > 0)


def _rows(pairs: Pairs, row: int, i: int, j: int, group: NDArray[np.int64],
          factor: NDArray[np.complex128] | None, channel_arrivals: ChannelArrivals | None) -> Arrivals:  # fmt: skip
    """Paths of one ordered pair of families."""
    transmit, receive, points = pairs.transmit_legs, pairs.receive_legs, pairs.scatterers
    amplitude = transmit.amplitude[i] * receive.amplitude[j] * pairs.strength[row] * points.phase
    if factor is not None:
        amplitude = amplitude * factor
    n = len(points)
    delay, channel_factor, band_absorption, doppler, direction = (
        (transmit.delay[i] + receive.delay[j], np.ones(n), np.ones((n, 1)), np.zeros(n), receive.departure[j])
        if channel_arrivals is None
        else channel_arrivals(row)
    )
    return Arrivals(
        delay=delay, amplitude=(amplitude * channel_factor).astype(np.complex64),
        band_absorption=band_absorption.astype(np.float32),
        spreading=transmit.spreading[i] * receive.spreading[j],
        absorption=transmit.absorption[i] * receive.absorption[j],
        reflection_coefficient=transmit.reflection_coefficient[i] * receive.reflection_coefficient[j],
        scattering_amplitude=np.abs(pairs.strength[row]), group=group, transmit_family=np.full(n, transmit.families[i]),
        receive_family=np.full(n, receive.families[j]), transmit_branch=np.full(n, transmit.branch[i], np.uint8),
        receive_branch=np.full(n, receive.branch[j], np.uint8), caustics=transmit.caustics[i] + receive.caustics[j],
        object=np.full(n, points.object), position=pairs.positions(row), departure=transmit.departure[i],
        arrival=direction,
        transmit_grazing=np.arcsin(transmit.grazing_sine[i]), receive_grazing=np.arcsin(receive.grazing_sine[j]),
        doppler=doppler,
    )  # fmt: skip


def concatenate_arrivals(parts: list[Arrivals]) -> Arrivals:
    """Join several lists of arrivals."""
    parts = [part for part in parts if len(part)] or parts[:1]  # of no path, the number of bands is not known
    if not parts:
        return no_arrivals()
    return Arrivals(*(np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(Arrivals)))


def no_arrivals() -> Arrivals:
    """Arrivals without rows."""
    # as many bands as a receiver may have: any of them can be selected
    column, vector, name, few = np.zeros(0), np.zeros((0, 3)), np.zeros(0, "<U1"), np.zeros(0, np.uint8)
    return Arrivals(
        column, column.astype(np.complex64), np.ones((0, 32), np.float32), column, column, column.astype(complex),
        column,
        np.zeros(0, np.int64), name, name, few, few, few, name, vector, vector, vector, column, column, column,
    )  # fmt: skip
