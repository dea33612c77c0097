"""Complex weight of each arrival in a recording: source pressure, amplitude, both beam patterns and carrier phase."""

import numpy as np
from numpy.typing import NDArray

from insonify.records.arrivals import Arrivals
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.sub_bands import SubBand
from insonify.synthesis.element_arrivals import directions_at_reception, rotated_beams
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def beam_amplitudes_of_arrivals(
    arrivals: Arrivals, ping_geometry: PingGeometry, channel: int, band: int | None = None
) -> tuple[Floats, Complexes]:
    """Pressure patterns of the transmit and the receive beam in the directions of arrivals, re their axes [1].

    Args:
        arrivals: Arrivals of one ping at `channel`, n of them.
        ping_geometry: The sonar at that ping.
        channel: Index of the beam pair; for element recordings of the element, whose complex response is included in
            the receive amplitude.
        band: Index of the sub-band, see `PingGeometry.interpolated_bands`; None: the centre frequency.

    Returns:
        Amplitude of the transmit beam at each departure, shape (n,).
        Complex amplitude of the receive beam at each arrival, shape (n,).
    """
    bands = ping_geometry.interpolated_bands if band is not None else ()
    sub_band = bands[band or 0] if bands else SubBand(0.0, ping_geometry.transmit_beams, ping_geometry.receive_beams)
    pulse_middle = 0.0 if ping_geometry.is_static else ping_geometry.pulse.pulse.duration / 2
    direction = directions_at_reception(ping_geometry, arrivals.arrival, arrivals.delay + pulse_middle)
    transmit_beam, receive_beam = sub_band.transmit_beams.single_beam(channel), sub_band.receive_beams
    response = 1.0 + 0j
    if ping_geometry.elements is None:
        receive_beam = receive_beam.single_beam(channel)
    else:
        receive_beam = rotated_beams(receive_beam, float(ping_geometry.elements.orientations[channel]))
        response = complex(ping_geometry.elements.response[channel])
    return transmit_beam.gain(arrivals.departure)[0], response * receive_beam.gain(direction)[0]


def arrival_weights(
    arrivals: Arrivals, ping_geometry: PingGeometry, channel: int = 0, band: int | None = None
) -> Complexes:
    """Complex rms pressure of each arrival of a pulse of unit rms, with the phase of the carrier [uPa], shape (n,).

    Args:
        arrivals: Arrivals of one ping at `channel`, n of them.
        ping_geometry: The sonar at that ping.
        channel: Index of the beam pair; for element recordings of the element.
        band: Index of the sub-band, see `PingGeometry.interpolated_bands`; None: the centre frequency.
    """
    transmit_amplitude, receive_amplitude = beam_amplitudes_of_arrivals(arrivals, ping_geometry, channel, band)
    cycles = ping_geometry.frequency * arrivals.delay  # float64: thousands of cycles
    carrier = np.exp(-2j * np.pi * (cycles - np.rint(cycles)))
    source_pressure = float(amplitude_ratio(ping_geometry.source_level_db))
    amplitude = arrivals.amplitude if band is None else arrivals.amplitude * arrivals.band_absorption[:, band]
    return np.asarray(source_pressure * transmit_amplitude * receive_amplitude * amplitude * carrier)
