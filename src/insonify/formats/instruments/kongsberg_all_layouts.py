"""Records of Kongsberg .all datagrams, in the byte order of each file.

Kongsberg (2018), EM series multibeam echo sounders, datagram formats, 850-160692/W, tables 22-48. EM 122, 302, 710,
2040, 2040C, 3002 and ME70 BO write little-endian ("Output datagrams"); earlier ones also big-endian. The highest
positive number of a field means that there is no value, unless a note of its table states otherwise.
"""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from insonify.formats.instruments.columns import Column, layout
from insonify.formats.instruments.instrument_file import records

HEADER = layout("u4 length; u1 stx; S1 kind; u2 model; u4 date milliseconds; u2 counter serial")
XYZ = layout("u2 heading sound_speed; f4 transducer_depth; u2 beams valid; f4 sample_rate; u1 scanning; S3 spare")
XYZ_BEAM = layout(
    "f4 down starboard forward; u2 window; u1 quality; i1 incidence_correction; u1 info; i1 cleaning; i2 level"
)
RANGE = layout("u2 sound_speed sectors beams valid; f4 sample_rate; u4 doppler_scale")
RANGE_SECTOR = layout(
    "i2 tilt; u2 focus_range; f4 pulse_length delay frequency; u2 absorption; u1 waveform number; f4 bandwidth"
)
RANGE_BEAM = layout(
    "i2 angle; u1 sector info; u2 window; u1 quality; i1 doppler; f4 travel_time; i2 level; i1 cleaning; u1 spare"
)
IMAGE = layout("f4 sample_rate; u2 normal_range; i2 normal_level oblique_level; u2 tx_beam_width crossover beams")
IMAGE_BEAM = layout("i1 order; u1 info; u2 sample_count centre_sample")
WATER = layout(
    "u2 parts part sectors all_beams beams sound_speed; u4 sample_rate; i2 heave; u1 tvg_exponent; i1 tvg_offset;"
    "u1 scanning; S3 spare"
)
WATER_SECTOR = layout("i2 tilt; u2 frequency; u1 number spare")
WATER_BEAM = layout("i2 angle; u2 first_sample sample_count detected; u1 sector beam")
ATTITUDE = layout("u2 milliseconds status; i2 roll pitch heave; u2 yaw")
POSITION = layout("i4 latitude longitude; u2 quality speed course heading; u1 system length")
PROFILE = layout("u4 date seconds; u2 count resolution")
PROFILE_POINT = layout("u4 depth sound_speed")
RUNTIME = layout(
    "u1 operator_status processor_status beamformer_status head_status mode filter; u2 least_depth largest_depth "
    "absorption pulse_length tx_beam_width; i1 power; u1 rx_beam_width bandwidth mode2 crossover speed_source;"
    "u2 port_swath; u1 beam_spacing port_coverage stabilisation starboard_coverage; u2 starboard_swath; i2 tilt;"
    "u1 filter2"
)
PROFILE_POINT_EARLIER = layout("u2 depth sound_speed")
EXTRA = layout(
    "u2 number version swath swath_index heading sound_speed; f4 reference_depth water_column_rate image_rate;"
    "u2 rx_array beams classes class_size alarms beam_size"
)
EXTRA_BEAM = layout(
    "f4 down starboard forward delta_latitude delta_longitude angle angle_correction travel_time time_correction;"
    "i2 level; i1 incidence_correction info; u2 spare sector window quality cleaning range_factor class confidence "
    "ifremer_quality water_column_beam; f4 water_column_angle; u2 water_column_sample sample_count"
)
DEPTH = layout("u2 heading sound_speed transducer_depth; u1 most beams depth_step step; u2 sample_rate")
DEPTH_BEAM = layout("i2 down starboard forward depression; u2 azimuth range; u1 quality window; i1 level; u1 number")
OLD_RANGE = layout("u2 sectors beams; u4 sample_rate; i4 vehicle_depth; u2 sound_speed most spare1 spare2")
OLD_RANGE_SECTOR = layout("i2 tilt; u2 focus_range; u4 pulse_length delay frequency; u2 bandwidth; u1 waveform number")
OLD_RANGE_BEAM = layout("i2 angle; u2 range; u1 sector; i1 level; u1 quality window; i2 number; u2 spare")
OLD_IMAGE = layout(
    "u2 absorption pulse_length normal_range first_range last_range; i1 normal_level oblique_level; u2 tx_beam_width;"
    "u1 crossover beams"
)
OLD_IMAGE_BEAM = layout("u1 number; i1 order; u2 sample_count centre_sample")
CLOCK = layout("u4 date milliseconds; u1 pps")
HEIGHT = layout("i4 height; u1 type")
HEADING = layout("u2 elapsed heading")
SPEED = layout("u2 elapsed sound_speed")
TIDE = layout("u4 date milliseconds; i2 tide")
TILT = layout("u2 elapsed; i2 tilt")
SINGLE_BEAM = layout("u4 date milliseconds depth; S1 source")
NETWORK_ATTITUDE = layout("u2 elapsed; i2 roll pitch heave; u2 yaw; u1 message")
_ORDERS: tuple[Literal["little"], Literal["big"]] = "little", "big"


def byte_order(content: bytes) -> str:
    """Byte order of a datagram, "<" or ">": that in which the length in front, of 64 kB at most, is the shorter."""
    little, big = (int.from_bytes(content[:4], order) for order in _ORDERS)
    return "<" if little <= big else ">"


def ordered_records(
    content: bytes, kind: np.dtype[Any], offset: int, count: int = 1, size: int | None = None
) -> NDArray[Any]:
    """Records of a datagram in its byte order, else as `instrument_file.records`."""
    kind = kind if byte_order(content) == "<" else kind.newbyteorder(">")
    return records(content, kind, offset, count, size)


def highest_is_none(kind: np.dtype[Any], columns: Sequence[Column]) -> tuple[Column, ...]:
    """Columns of a record whose highest number means that there is no value; codes and stated ones stay as they are.

    Args:
        kind: Layout of the record.
        columns: Columns of some of its fields.
    """
    return tuple(
        column._replace(missing=float(np.iinfo(kind[column.field]).max))
        if column.unit != "code" and np.isnan(column.missing) and kind[column.field].kind in "iu"
        else column
        for column in columns
    )
