"""Arrivals: the paths of one ping out and back, one row each: the paper's spike array."""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from insonify.records.legs import ray_name
from insonify.records.pairs import Pairs
from insonify.units import level_db

Floats = NDArray[np.float64]
ChannelArrivals = Callable[[int], tuple[Floats, Floats, Floats, Floats]]

MAX_ROWS_LISTED = 40
"""Paths up to which a printed list goes row by row."""
ROWS_OF_SHORT_LIST, ROWS_OF_LONG_LIST, MAX_KINDS_LISTED = 20, 10, 20
"""Rows printed of a short list, rows of a long one, and its kinds."""


@dataclass(frozen=True, slots=True)
class Arrivals:
    """Paths of one ping, as columns of equal length n."""

    delay: Floats
    """Two-way travel time from the start of transmission, as heard by the channel asked for [s], shape (n,)."""
    amplitude: NDArray[np.complex64]
    """Pressure re the source at 1 m, phase of reflections and of the place only [1], shape (n, bands): at the centre of
    the band, or at each frequency that `sonar.receiver.sub_bands` asks for, from the lowest."""
    spreading: Floats
    """Pressure ratio by spreading, out and back [1], shape (n,)."""
    absorption: Floats
    """Pressure ratio by absorption, out and back [1], shape (n,)."""
    reflection_coefficient: NDArray[np.complex128]
    """Product of all reflection coefficients, out and back [1], shape (n,)."""
    scattering_amplitude: Floats
    """Pressure scattered to 1 m re incident pressure [m], shape (n,)."""
    group: NDArray[np.int64]
    """Arrivals of one group interfere in the mean: a place, or a deterministic target, shape (n,)."""
    transmit_family: NDArray[np.str_]
    """Family of the leg out, shape (n,)."""
    receive_family: NDArray[np.str_]
    """Family of the leg back, named from the sonar outward too, shape (n,)."""
    transmit_branch: NDArray[np.uint8]
    """Which of the family's rays to that place the leg out is, from 0, by launch angle, shape (n,)."""
    receive_branch: NDArray[np.uint8]
    """Which of them the leg back is, shape (n,)."""
    caustics: NDArray[np.uint8]
    """Caustics touched, out and back; each turns the phase by +90 degrees, shape (n,)."""
    object: NDArray[np.str_]
    """What echoed: "seabed", "surface", "water" or the label of a target or a patch, shape (n,)."""
    position: Floats
    """Where: north, east, depth [m], shape (n, 3)."""
    departure: Floats
    """Unit vector of travel at the transmitter, shape (n, 3)."""
    arrival: Floats
    """Unit vector from the receiver towards where the sound comes from, shape (n, 3)."""
    transmit_grazing: Floats
    """Grazing angle at the scatterer of the leg out [rad], shape (n,)."""
    receive_grazing: Floats
    """Grazing angle at the scatterer of the leg back [rad], shape (n,)."""
    doppler: Floats
    """Part by which the echo is quicker than what was sent, d(emission) / d(arrival) - 1 [1], shape (n,)."""

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
        """Mirror bounces off surface and bottom, out and back together, shape (n,)."""
        names = np.char.replace(self.transmit_family, "D", ""), np.char.replace(self.receive_family, "D", "")
        return np.asarray(np.char.str_len(names[0]) + np.char.str_len(names[1]))

    def ray_names(self, row: int) -> tuple[str, str]:
        """Names of the rays out and back of one path: their families, and numbers where a family has several."""
        out = ray_name(str(self.transmit_family[row]), int(self.transmit_branch[row]))
        return out, ray_name(str(self.receive_family[row]), int(self.receive_branch[row]))

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64] | slice) -> "Arrivals":
        """The arrivals of some rows."""
        return Arrivals(*(getattr(self, column.name)[rows] for column in fields(self)))

    def __repr__(self) -> str:
        """A page of a lab notebook: a short list row by row, a long one by kind, with its strongest rows."""
        if not len(self):
            return "Arrivals: no paths"
        span = f"{self.delay.min() * 1e3:.1f}-{self.delay.max() * 1e3:.1f} ms"
        head = f"Arrivals: {len(self)} paths, {span}; levels in dB re the source at 1 m, before beams"
        order = np.argsort(self.delay, kind="stable")
        if len(self) <= MAX_ROWS_LISTED:
            more = [f"  ... and {len(self) - ROWS_OF_SHORT_LIST} more"] if len(self) > ROWS_OF_SHORT_LIST else []
            return "\n".join([head, *self._lines(order, np.arange(len(self))[:ROWS_OF_SHORT_LIST]), *more])
        strongest = np.argsort(-self._level()[order], kind="stable")[:ROWS_OF_LONG_LIST]
        told = [f"  the {ROWS_OF_LONG_LIST} strongest, in order of arrival:", *self._lines(order, np.sort(strongest))]
        return "\n".join([head, *self._kinds(), *told])

    @property
    def _central(self) -> NDArray[np.complex64]:
        """Amplitude at the middle of the band, shape (n,)."""
        return self.amplitude[:, self.amplitude.shape[1] // 2]

    def _level(self) -> Floats:
        """Level of each path [dB re the source at 1 m]."""
        return level_db(np.abs(self._central) ** 2)

    def _lines(self, order: NDArray[np.int64], ranks: NDArray[np.int64]) -> list[str]:
        """Some paths line by line, by their ranks in the order of arrival."""
        level, phase = self._level(), np.degrees(np.angle(self._central))
        lines = ["  row       delay      level    phase  who            out    back"]
        for rank, row in zip(ranks, order[ranks], strict=True):
            out, back = self.ray_names(row)
            lines.append(
                f"{rank + 1:5d} {self.delay[row] * 1e3:9.3f} ms {level[row]:7.1f} dB {phase[row]:5.0f} deg  "
                f"{self.object[row]:<14s} {out:<6s} {back}"
            )
        return lines

    def _kinds(self) -> list[str]:
        """Who echoed by which pair of families, in either order: how often, when, how loud; the loudest kind first."""
        legs = np.stack([self.transmit_family, self.receive_family])
        names, leg = np.unique(legs, return_inverse=True)
        owners, owner = np.unique(self.object, return_inverse=True)
        low, high = np.sort(leg.reshape(legs.shape), axis=0)
        kinds, kind = np.unique((owner * len(names) + low) * len(names) + high, return_inverse=True)
        count = np.bincount(kind)
        first, last, loudest = np.full(kinds.size, np.inf), np.full(kinds.size, -np.inf), np.full(kinds.size, -np.inf)
        np.minimum.at(first, kind, self.delay * 1e3)
        np.maximum.at(last, kind, self.delay * 1e3)
        np.maximum.at(loudest, kind, self._level())
        lines = [f"  {'who':<14s} {'legs':<9s} {'paths':>8s} {'delays':>20s} {'strongest':>12s}"]
        for row in np.argsort(-loudest, kind="stable")[:MAX_KINDS_LISTED]:
            code, b = divmod(int(kinds[row]), len(names))
            who, a = divmod(code, len(names))
            legs_told = "-".join(sorted((str(names[a]), str(names[b])), key=_fewest_bounces))
            span = f"{first[row]:.2f}-{last[row]:.2f} ms"
            lines.append(f"  {owners[who]:<14s} {legs_told:<9s} {count[row]:8d} {span:>20s} {loudest[row]:9.1f} dB")
        return lines + (
            [f"  ... and {kinds.size - MAX_KINDS_LISTED} fainter kinds"] if kinds.size > MAX_KINDS_LISTED else []
        )


def _fewest_bounces(family: str) -> tuple[bool, int, bool]:
    """Order of the two names of a pair: direct, then few bounces, then surface first."""
    return family != "D", len(family), not family.startswith("S")


def expand_arrivals(
    pairs: Pairs, first_group: int, factors: dict[tuple[str, str], NDArray[np.complex128]], channel_arrivals: ChannelArrivals | None = None
) -> Arrivals:  # fmt: skip
    """Write out every path of a block of scatterers, row by row; paths that are not there are left out.

    Args:
        pairs: The block.
        first_group: Number of the block's first group.
        factors: Perturbation of each ordered pair of rays (`Pairs.rays`), where there is one, each of shape (n,).
        channel_arrivals: Of the row of an ordered pair: delays [s], (n,), factors on pressures [1], (n, bands), Doppler factors
            less one [1], (n,), and directions [1], (n, 3), as a channel hears them; None: a channel at the centre of a
            sonar that stands.
    """
    n = len(pairs.scatterers)
    group = np.arange(first_group, first_group + n) if pairs.scatterers.has_random_phase else np.full(n, first_group)
    rows = [
        _rows(pairs, row, int(i), int(j), group, factors.get(names), channel_arrivals)
        for row, ((i, j), names) in enumerate(zip(pairs.pair, pairs.rays(), strict=True))
    ]
    whole = concatenate_arrivals(rows) if rows else no_arrivals()
    return whole.take(np.abs(whole.amplitude[:, 0]) > 0)


def _rows(pairs: Pairs, row: int, i: int, j: int, group: NDArray[np.int64],
          factor: NDArray[np.complex128] | None, heard: ChannelArrivals | None) -> Arrivals:  # fmt: skip
    """The paths of one ordered pair of families."""
    out, back, points = pairs.out, pairs.back, pairs.scatterers
    amplitude = out.amplitude[i] * back.amplitude[j] * pairs.strength[row] * points.phase
    if factor is not None:
        amplitude = amplitude * factor
    n = len(points)
    delay, bands, doppler, towards = (
        (out.delay[i] + back.delay[j], np.ones((n, 1)), np.zeros(n), back.departure[j]) if heard is None else heard(row)
    )
    return Arrivals(
        delay=delay,
        amplitude=(amplitude[:, None] * bands).astype(np.complex64),
        spreading=out.spreading[i] * back.spreading[j],
        absorption=out.absorption[i] * back.absorption[j],
        reflection_coefficient=out.reflection_coefficient[i] * back.reflection_coefficient[j],
        scattering_amplitude=np.abs(pairs.strength[row]),
        group=group,
        transmit_family=np.full(n, out.families[i]),
        receive_family=np.full(n, back.families[j]),
        transmit_branch=np.full(n, out.branch[i], np.uint8),
        receive_branch=np.full(n, back.branch[j], np.uint8),
        caustics=out.caustics[i] + back.caustics[j],
        object=np.full(n, points.object),
        position=points.position,
        departure=out.departure[i],
        arrival=towards,
        transmit_grazing=out.grazing[i],
        receive_grazing=back.grazing[j],
        doppler=doppler,
    )


def concatenate_arrivals(parts: list[Arrivals]) -> Arrivals:
    """Several lists of arrivals as one."""
    if not parts:
        return no_arrivals()
    return Arrivals(*(np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(Arrivals)))


def no_arrivals() -> Arrivals:
    """No arrivals."""
    column, vector, name, few = np.zeros(0), np.zeros((0, 3)), np.zeros(0, "<U1"), np.zeros(0, np.uint8)
    return Arrivals(
        column, np.zeros((0, 1), np.complex64), column, column, column.astype(complex), column,
        np.zeros(0, np.int64), name, name, few, few, few, name, vector, vector, vector, column, column, column,
    )  # fmt: skip
