"""Errors of recordings of elements, and of moving sonars, that cannot be simulated."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.model import field_error
from insonify.scenario.platform_poses import platforms
from insonify.sonar.hydrophones import element_layout
from insonify.sonar.ping_geometry import ping_geometry
from insonify.sonar.platforms import Platforms
from insonify.sonar.pulse import Pulse, spectrum
from insonify.sonar.received_pulse import received_pulse
from insonify.sonar.receiver import Receiver, response
from insonify.sonar.sonar import Sonar, receiver_rotation
from insonify.sonar.track import Poses
from insonify.synthesis.waveform_basis import MAX_WAVEFORMS, WaveformBasis, waveform_basis

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

Floats = NDArray[np.float64]
MIN_PASSED_ENERGY = 0.9
"""Share of the energy that the band keeps of a standing target's echo, which it must keep of a shifted one [1]."""
_POINTS, _SEARCHED = 4096, 60

MAX_POSES = 2000
"""Pings looked at of those that bring an array within its own size of the surface or the bed [1]."""


def element_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors that keep elements from being recorded, or a moving sonar from being simulated."""
    receiver = scenario.sonar.receiver
    if receiver.record == "elements" and scenario.field == "incoherent":
        yield field_error("sonar.receiver.record", "elements", "are recorded as pressures, and field is incoherent. "
                      "Write field: coherent, or sonar.receiver.record: beams.")  # fmt: skip
    if receiver.record == "elements" and scenario.output.labels:
        yield field_error("output.labels", "true", "is for beams, and sonar.receiver.record is elements. Write labels: "
                      "false; the same scene with record: beams and sonar.receive.steer has them.")  # fmt: skip
    if receiver.sub_bands not in (1, "auto") and scenario.field == "incoherent":
        yield field_error("sonar.receiver.sub_bands", f"{receiver.sub_bands}", "are for pressures, and field is "
                      "incoherent. Leave sub_bands out, or write field: coherent.")  # fmt: skip
    if receiver.record == "elements":
        yield from _out_of_water_errors(scenario)
    if scenario.field == "coherent" and not scenario.track.stop_and_hop:
        yield from _out_of_band_errors(scenario)


def _out_of_water_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """The first element that any ping has above the surface or below the level of the bed."""
    bed = scenario.seabed.depth
    for side in scenario.sonar.side_sonars:
        for ping, row, depth in elements_out_of_water(side, platforms(scenario).receiver_poses, bed):
            where = "at or above the sea surface" if depth <= 0 else f"at or below the seabed ({bed:g} m)"
            yield field_error("sonar.receive", None, f"puts element {row} {where} at ping {ping}, at "
                              f"{depth:.4g} m. Give a smaller array, or another depth.")  # fmt: skip
            return


def elements_out_of_water(side: Sonar, poses: Poses, bed: float) -> Iterator[tuple[int, int, float]]:
    """The first element out of the water at each ping that has one there: ping, number, depth [m].

    Args:
        side: The sonar, of one side.
        poses: Poses of its receiver's platform; an array that is wholly out of the water is not looked at.
        bed: Depth of the seabed [m].
    """
    positions = element_layout(side.receive)[0]
    centres, reach = poses.offset_depths(side.receive.offset), float(np.linalg.norm(positions, axis=1).max())
    near = (centres > 0) & (centres < bed) & ((centres <= reach) | (centres >= bed - reach))
    for ping in np.flatnonzero(near)[:MAX_POSES].tolist():
        depth = centres[ping] + (positions @ receiver_rotation(side, poses.rotation(ping)))[:, 2]
        wrong = (depth <= 0) | (depth >= bed)
        if wrong.any():
            row = int(np.argmax(wrong))
            yield ping, row, float(depth[row])


def _out_of_band_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """A receiver that an echo's Doppler shift leaves, and pulses so long that no sum of shapes holds it."""
    poses, stop = platforms(scenario), scenario.track.window[1]
    moved = [
        moments[-1].offset_positions(array.offset) - moments[0].offset_positions(array.offset)
        for side in scenario.sonar.side_sonars
        for array, moments in zip(side.arrays, poses.window_poses, strict=True)
    ]
    speed = np.max([np.linalg.norm(displacement, axis=1) for displacement in moved], axis=0) / stop
    if speed.max() == 0:
        return
    bases = _waveform_bases(scenario, poses, int(np.argmax(speed)))
    if not bases:
        return
    limits = [limit for basis in bases for limit in basis.doppler_limits]
    dopplers = min(limits), max(limits)
    pulse, receiver = scenario.sonar.pulse, scenario.sonar.receiver
    turned = pulse.frequency * pulse.duration * (dopplers[1] - dopplers[0])
    if max(len(basis.doppler) for basis in bases) >= MAX_WAVEFORMS:
        yield field_error(
            "sonar.pulse.duration", f"{pulse.duration * 1e3:g} ms", "is long for a sonar that moves at "
            f"{speed.max():.3g} m/s: Doppler turns it by {turned:.0f} cycles between one direction and another. "
            "Write track.stop_and_hop: true, or give a shorter pulse or a narrower beam.",
        )  # fmt: skip
    worst = max(dopplers, key=abs)
    still, shifted = (passed_energy_fraction(pulse, receiver, factor) for factor in (0.0, worst))
    if shifted < MIN_PASSED_ENERGY * still:
        least = _min_bandwidth(pulse, receiver, worst)
        yield field_error(
            "sonar.receiver.bandwidth", f"{receiver.bandwidth / 1e3:g} kHz", f"keeps {100 * shifted:.0f} % of an echo "
            f"that a platform at {speed.max():.3g} m/s receives shifted by {worst * pulse.frequency:+.0f} Hz, and "
            f"{100 * still:.0f} % of one without Doppler. Give a band of {least / 1e3:.4g} kHz or more, or write "
            "track.stop_and_hop: true.",
        )  # fmt: skip


def _waveform_bases(scenario: ScenarioParts, poses: Platforms, ping: int) -> list[WaveformBasis]:
    """Waveforms of each side at the fastest ping; none where its beams are at fault."""
    pulse, bases = received_pulse(scenario.sonar), []
    for side in scenario.sonar.side_sonars:
        try:
            geometry = ping_geometry(side, poses.single_ping(ping), 0, window=scenario.track.window, pulse=pulse,
                          water=scenario.water, seed=scenario.seed)  # fmt: skip
        except ValueError:
            return []
        bases.append(waveform_basis(geometry))
    return bases


def passed_energy_fraction(pulse: Pulse, receiver: Receiver, doppler: float) -> float:
    """Share of the energy of an echo that the receiver's band passes [1].

    Args:
        pulse: The transmitted pulse.
        receiver: Receiver of the echo.
        doppler: Part by which the echo is quicker, d(emission) / d(arrival) - 1 [1].
    """
    edge = receiver.sample_rate / 2
    # far enough for all of a tone, whose lobes are 1 / duration wide, and for all of a sweep
    reach = max(edge, pulse.bandwidth + 20 / pulse.duration + abs(doppler) * pulse.frequency)
    offset = np.linspace(-reach, reach, _POINTS * max(1, int(np.ceil(reach * pulse.duration / 256))))
    sent = np.abs(spectrum(pulse, (offset - doppler * pulse.frequency) / (1 + doppler))) ** 2
    return float(np.sum(sent * response(receiver, offset) ** 2) / np.sum(sent))


def _min_bandwidth(pulse: Pulse, receiver: Receiver, doppler: float) -> float:
    """Least band that keeps what it must of a shifted echo [Hz], to two digits upwards."""
    low, high = receiver.bandwidth, receiver.bandwidth + 4 * abs(doppler) * pulse.frequency + pulse.bandwidth
    for _ in range(_SEARCHED):
        middle = (low + high) / 2
        wider = receiver.unchecked_copy(bandwidth=middle)
        enough = passed_energy_fraction(pulse, wider, doppler) >= MIN_PASSED_ENERGY * passed_energy_fraction(
            pulse, wider, 0.0
        )
        low, high = (low, middle) if enough else (middle, high)
        if high - low < 0.002 * high:
            break
    step = 10 ** np.floor(np.log10(high) - 2)
    return float(np.ceil(high / step) * step)
