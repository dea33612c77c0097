"""Small EK80 file, written from the published layout: a channel of each type of samples, with all its settings."""

import struct

import numpy as np

START, PINGS, SAMPLES = 1_700_000_000.0, 3, 12
CHANNELS = {
    "tone 4": ("38000", "1", 'Frequency="38000"', 4, 8),
    "sweep 3": ("70000", "17", 'PulseForm="1" FrequencyStart="60000" FrequencyEnd="90000"', 3, 4),
    "power": ("120000", "1", 'Frequency="120000"', 0, 3),
    "twin": ("38000", "1", 'Frequency="38000"', 4, 8),
}
"""Nominal frequency, type of beam, pulse, number of sectors and bits of the type of samples of each channel."""
FILTERS = {1: (np.array([0.25, 0.5, 0.25j], "<c8"), 3), 2: (np.array([1, 1j], "<c8"), 2)}
XML = '<?xml version="1.0" encoding="utf-8"?>'


def datagram(kind: bytes, seconds: float, body: bytes) -> bytes:
    """One datagram with its length at both ends."""
    ticks = round((START + seconds) * 1e7) + 116_444_736_000_000_000
    content = kind + struct.pack("<Q", ticks) + body
    return struct.pack("<I", len(content)) + content + struct.pack("<I", len(content))


def configuration(entities: str = "") -> bytes:
    """Configuration of the channels; before it, perhaps, definitions of entities."""
    rows = "".join(
        f'<Transceiver SerialNumber="{row}" Impedance="5400" RxSampleFrequency="600000"><Channels>'
        f'<Channel ChannelID="{name}" PulseDuration="0.0001;0.0002" PulseDurationFM="0.0002;0.0004">'
        f'<Transducer TransducerName="T{row}" SerialNumber="9" Frequency="{frequency}" BeamType="{beam}" Gain="20;25" '
        'SaCorrection="0;-0.5" EquivalentBeamAngle="-20" BeamWidthAlongship="7" BeamWidthAthwartship="8" '
        'AngleSensitivityAlongship="23" AngleSensitivityAthwartship="20" AngleOffsetAlongship="0.5" '
        'AngleOffsetAthwartship="0"><FrequencyPar Frequency="90000" Gain="28" Impedance="75" />'
        '<FrequencyPar Frequency="60000" Gain="26" Impedance="75" /></Transducer></Channel></Channels></Transceiver>'
        for row, (name, (frequency, beam, *_)) in enumerate(CHANNELS.items())
    )
    mounting = 'TransducerName="T0" TransducerSerialNumber="9" TransducerOffsetX="7.5"'
    mounting = f"<Transducers><Transducer {mounting} /></Transducers>"
    text = (
        f'{XML}{entities}<Configuration><Header ApplicationName="EK80" /><Transceivers>{rows}</Transceivers>{mounting}'
    )
    return f"{text}</Configuration>".encode()


def volts(ping: int, sectors: int) -> np.ndarray:
    """Complex samples of one ping, shape (sample, sector): whole numbers, which half precision holds too."""
    real = np.arange(SAMPLES * sectors).reshape(SAMPLES, sectors) + ping
    return (real - 1j * real[::-1]).astype(np.complex64)


def samples(name: str, ping: int, count: int = SAMPLES) -> bytes:
    """Body of the samples of one ping."""
    sectors, contents = CHANNELS[name][3:]
    head = struct.pack("<128sHHii", name.encode(), contents | sectors << 8, 0, 2, count)
    if contents == 3:
        power = (-256 * np.arange(SAMPLES) - ping).astype("<i2").tobytes()
        return head + power + np.stack([np.full(SAMPLES, 64), np.arange(SAMPLES)], 1).astype("<i1").tobytes()
    return head + volts(ping, sectors).view(np.float32).astype("<f4" if contents == 8 else "<f2").tobytes()


def parameter(name: str) -> bytes:
    """Settings of a ping of one channel."""
    pulse = f'ChannelID="{name}" {CHANNELS[name][2]} PulseDuration="0.0002" SampleInterval="1e-05" Slope="0.1"'
    return f'{XML}<Parameter><Channel {pulse} TransmitPower="250" SoundVelocity="1500" /></Parameter>'.encode()


def ek80(head: bytes | None = None) -> bytes:
    """EK80 file: configuration, filters, water, sensors, three pings of each channel."""
    parts = [datagram(b"XML0", 0, configuration() if head is None else head)]
    for stage, (taps, decimation) in FILTERS.items():
        body = struct.pack("<hh128shh", stage, 0, b"tone 4", taps.size, decimation) + taps.tobytes()
        parts.append(datagram(b"FIL1", 0, body))
    water = (
        'Depth="10" Acidity="8" Salinity="35" SoundSpeed="1501" Temperature="12" SoundVelocityProfile="0;1500;20;1490"'
    )
    parts.append(datagram(b"XML0", 0, f"{XML}<Environment {water} />\0\0".encode()))
    for ping in range(PINGS):
        for quality in (1, 4, 4):
            body = f"GPGGA,120000,5130.0,N,00315.0,W,{quality},9,1,0,M,0,M,,"
            check = 0
            for letter in body:
                check ^= ord(letter)
            parts.append(datagram(b"NME0", ping, f"${body}*{check ^ (quality == 1):02X}\r\n\0".encode()))
        parts.append(datagram(b"MRU0", ping, struct.pack("<4f", 0.5, 1.0, -2.0, 180.0)))
        for name in CHANNELS:
            parts += [datagram(b"XML0", ping, parameter(name)), datagram(b"RAW3", ping, samples(name, ping))]
    return b"".join(parts)
