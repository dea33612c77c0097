"""Soundings, ranges, seabed image and profile of Kongsberg multibeams before 2005, as the records of later ones.

EM 120, 300, 1002, 2000, 3000 and 3002 write datagrams D, f, S and V in place of X, N, Y and U, with integers of less
range, of which the highest means that there is no value. Kongsberg (2018), 850-160692/W, "Multibeam data", tables 22,
23, 28 and 30; units of f by its note: two-way travel time R / (4 F).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.formats.instruments import kongsberg_all_layouts as layouts
from insonify.formats.instruments.columns import ragged
from insonify.formats.instruments.instrument_file import DatagramError
from insonify.formats.instruments.kongsberg_all_layouts import ordered_records

HEAD, _TRAILER = layouts.HEADER.itemsize, 3
_UNSIGNED = (120, 300)  # models whose depths have no sign
_EQUAL_HEADS, _SECOND_HEAD = 3002, 128  # the model whose heads have one depth; number of the second head's first beam
_PHASE = 0x80  # bit of the quality of a phase detection
DUAL_HEADS = range(3002, 3009)
"""Model numbers of the EM 3000D, which has the beams of both heads in one datagram."""
NO_QUALITY = 255
"""Quality of a sounding that states none in the unit of later ones."""
NO_METHOD = 15
"""Information byte of a beam of a seabed image, which states no method of detection."""


def soundings(content: bytes) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Header, settings and beams of a D datagram, as those of an X datagram."""
    head, stated = ordered_records(content, layouts.HEADER, 0)[0], ordered_records(content, layouts.DEPTH, HEAD)[0]
    old = ordered_records(content, layouts.DEPTH_BEAM, HEAD + layouts.DEPTH.itemsize, int(stated["beams"]))
    at = HEAD + layouts.DEPTH.itemsize + old.nbytes
    multiplier = int(ordered_records(content, np.dtype("i1"), at)[0])
    ping, beams = np.zeros((), layouts.XYZ), np.zeros(old.size, layouts.XYZ_BEAM)
    for name in ("heading", "sound_speed", "beams", "sample_rate"):
        ping[name] = stated[name]
    ping["transducer_depth"] = (65536 * multiplier + int(stated["transducer_depth"])) * 0.01
    down = old["down"].astype(np.int16)
    beams["down"] = _metres(down.view(np.uint16) if head["model"] in _UNSIGNED else down, stated["depth_step"])
    if head["model"] in DUAL_HEADS:  # the field of the rate states the depth of the second head re the first
        second, deeper = old["number"] >= _SECOND_HEAD, int(stated["sample_rate"].astype(np.int16))
        beams["down"][second] += 0.01 * deeper * (head["model"] != _EQUAL_HEADS)
        ping["sample_rate"] = np.nan  # each head has its own
    for name in ("starboard", "forward"):
        beams[name] = _metres(old[name], stated["step"])
    beams["level"], beams["quality"] = _finer(old["level"], 5), NO_QUALITY
    beams["window"], beams["info"] = old["window"], (old["quality"] & _PHASE) > 0
    return head, ping, beams


def ranges(content: bytes) -> tuple[NDArray[Any], NDArray[Any]]:
    """Transmit sectors and beams of an f datagram, as those of an N datagram."""
    stated, offset = ordered_records(content, layouts.OLD_RANGE, HEAD)[0], HEAD + layouts.OLD_RANGE.itemsize
    old = ordered_records(content, layouts.OLD_RANGE_SECTOR, offset, int(stated["sectors"]))
    received = ordered_records(content, layouts.OLD_RANGE_BEAM, offset + old.nbytes, int(stated["beams"]))
    if not stated["sample_rate"]:
        raise DatagramError("a sample rate of 0 is stated")
    sectors, beams = np.zeros(old.size, layouts.RANGE_SECTOR), np.zeros(received.size, layouts.RANGE_BEAM)
    for name in ("tilt", "focus_range", "waveform", "number", "frequency"):
        sectors[name] = old[name]
    sectors["pulse_length"], sectors["delay"] = old["pulse_length"] * 1e-6, old["delay"] * 1e-6
    sectors["bandwidth"] = 10.0 * old["bandwidth"]
    beams["angle"], beams["sector"] = received["angle"], received["sector"]
    beams["travel_time"] = received["range"] / (4 * (stated["sample_rate"] * 0.01))
    return sectors, beams


def image(content: bytes) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[np.float32]]:
    """Header, settings, beams and levels (beam, sample) [dB] of an S datagram, as those of a Y datagram."""
    stated, offset = ordered_records(content, layouts.OLD_IMAGE, HEAD)[0], HEAD + layouts.OLD_IMAGE.itemsize
    old = ordered_records(content, layouts.OLD_IMAGE_BEAM, offset, int(stated["beams"]))
    counts = old["sample_count"].astype(np.int64)
    offset += old.nbytes
    if offset + int(counts.sum()) + _TRAILER > len(content):
        raise DatagramError(f"{counts.sum()} samples are stated from byte {offset} of {len(content)}")
    ping, beams = np.zeros((), layouts.IMAGE), np.zeros(old.size, layouts.IMAGE_BEAM)
    for name in ("normal_range", "tx_beam_width", "crossover", "beams"):
        ping[name] = stated[name]
    ping["sample_rate"], beams["info"] = np.nan, NO_METHOD  # the rate is that of the soundings
    for name in ("normal_level", "oblique_level"):
        ping[name] = _finer(stated[name], 10)
    for name in ("order", "sample_count", "centre_sample"):
        beams[name] = old[name]
    level = ragged(content, "i1", (offset + np.cumsum(counts) - counts).tolist(), counts.tolist(), 0.5)
    return ordered_records(content, layouts.HEADER, 0)[0], ping, beams, level


def _metres(whole: NDArray[Any], step: int) -> NDArray[np.float64]:
    """Lengths of whole steps of some centimetres [m], NaN where there is none."""
    return np.where(whole == np.iinfo(whole.dtype).max, np.nan, whole * (0.01 * step))


def _finer(whole: NDArray[Any], steps: int) -> NDArray[np.int16]:
    """Bytes in steps of 16 bit, as many to each of theirs; the highest of 16 bit where there is none."""
    none = whole == np.iinfo(whole.dtype).max
    return np.where(none, np.iinfo(np.int16).max, steps * whole.astype(np.int16)).astype(np.int16)
