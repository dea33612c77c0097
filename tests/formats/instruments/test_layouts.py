"""Claims about layouts: fields stand at the bytes that the makers' tables print, records have the printed sizes."""

import numpy as np
import pytest

from insonify.formats.instruments import kmall_layouts, kongsberg_all_layouts, xtf_layouts
from insonify.formats.instruments.columns import layout, ragged, stacked
from insonify.formats.instruments.instrument_file import DatagramError, records

XTF_OFFSETS = {
    "FILE": {
        "format": 0, "system": 1, "program": 2, "version": 10, "sonar": 18, "sonar_type": 34, "note": 36, "name": 100,
        "navigation_units": 164, "sonar_channels": 166, "bathymetry_channels": 168, "snippet_channels": 170,
        "forward_arrays": 171, "strength_channels": 172, "interferometry_channels": 174, "reference_height": 178,
        "projection": 182, "latency": 204, "origin_y": 208, "navigation_forward": 216, "navigation_starboard": 220,
        "navigation_down": 224, "navigation_yaw": 228, "motion_forward": 232, "motion_starboard": 236,
        "motion_down": 240, "motion_yaw": 244, "motion_pitch": 248, "motion_roll": 252,
    },
    "CHANNEL": {
        "kind": 0, "number": 1, "correction": 2, "unipolar": 4, "sample_size": 6, "samples": 8, "name": 12, "volts": 28,
        "frequency": 32, "along_beam_width": 36, "tilt": 40, "across_beam_width": 44, "starboard": 48, "forward": 52,
        "down": 56, "yaw": 60, "pitch": 64, "roll": 68, "beams": 72, "sample_format": 74, "spare": 75,
    },
    "PING": {
        "magic": 0, "kind": 2, "channel": 3, "channels": 4, "size": 10, "year": 14, "month": 16, "day": 17, "hour": 18,
        "minute": 19, "second": 20, "hundredths": 21, "julian_day": 22, "event": 24, "ping": 28, "sound_speed": 32,
        "tide": 36, "conductivity_frequency": 44, "temperature_frequency": 48, "pressure_frequency": 52,
        "pressure_temperature": 56, "conductivity": 60, "temperature": 64, "pressure": 68, "computed_sound_speed": 72,
        "sensors": 76, "speed_log": 112, "turbidity": 116, "ship_speed": 120, "ship_heading": 124,
        "ship_latitude": 128, "ship_longitude": 136, "ship_altitude": 144, "ship_depth": 146, "fix_hour": 148,
        "speed": 152, "kp": 156, "latitude": 160, "longitude": 168, "status": 176, "range_to_fish": 178,
        "bearing_to_fish": 180, "cable_out": 182, "layback": 184, "cable_tension": 188, "sensor_depth": 192,
        "altitude": 196, "auxiliary_altitude": 200, "pitch": 204, "roll": 208, "heading": 212, "heave": 216, "yaw": 220,
        "attitude_tag": 224, "off_track": 228, "fix_tag": 232,
    },
    "PING_CHANNEL": {
        "channel": 0, "downsampling": 2, "slant_range": 4, "ground_range": 8, "time_delay": 12, "time_duration": 16,
        "ping_interval": 20, "processing": 24, "frequency": 26, "initial_gain": 28, "gain": 30, "bandwidth": 32,
        "contact": 34, "samples": 42, "millivolts": 46, "contact2": 48, "weight": 58,
    },
    "ATTITUDE": {
        "size": 10, "microseconds": 22, "epoch": 26, "pitch": 30, "roll": 34, "heave": 38, "yaw": 42, "tag": 46,
        "heading": 50, "year": 54, "month": 56, "day": 57, "hour": 58, "minute": 59, "second": 60, "milliseconds": 61,
    },
    "NAVIGATION": {"kind": 2, "size": 10, "year": 14, "second": 20, "microseconds": 21, "epoch": 25, "tag": 29,
                   "latitude": 33, "longitude": 41, "height": 49, "flag": 57},
    "RAW_POSITION": {"size": 10, "year": 14, "second": 20, "tenths": 21, "latitude": 23, "longitude": 31, "height": 39,
                     "pitch": 47, "roll": 51, "heave": 55, "heading": 59},
}  # fmt: skip
XTF_SIZES = {"FILE": 256, "CHANNEL": 128, "PACKET": 14, "PING": 256, "PING_CHANNEL": 64, "ATTITUDE": 64,
             "NAVIGATION": 64, "RAW_POSITION": 64}  # fmt: skip
ALL_SIZES = {"HEADER": 20, "XYZ_BEAM": 20, "RANGE_SECTOR": 24, "RANGE_BEAM": 16, "IMAGE_BEAM": 6, "ATTITUDE": 12,
             "PROFILE_POINT": 8, "WATER_SECTOR": 6, "WATER_BEAM": 10}  # fmt: skip
"""Repeat cycles as the tables print them (20*N, 24*Ntx, 16*Nrx, 6*N, 12*N, 8*N), others by their formats."""
ALL_HEADS = {"XYZ": "2U 2U 4F 2U 2U 4F 1U 3U", "RANGE": "2U 2U 2U 2U 4F 4U", "IMAGE": "4F 2U 2S 2S 2U 2U 2U",
             "WATER": "2U 2U 2U 2U 2U 2U 4U 2S 1U 1S 1U 3U", "PROFILE": "4U 4U 2U 2U",
             "POSITION": "4S 4S 2U 2U 2U 2U 1U 1U", "XYZ_BEAM": "4F 4F 4F 2U 1U 1S 1U 1S 2S",
             "RANGE_SECTOR": "2S 2U 4F 4F 4F 2U 1U 1U 4F", "RANGE_BEAM": "2S 1U 1U 2U 1U 1S 4F 2S 1S 1U",
             "IMAGE_BEAM": "1S 1U 2U 2U", "WATER_SECTOR": "2S 2U 1U 1U", "WATER_BEAM": "2S 2U 2U 2U 1U 1U",
             "ATTITUDE": "2U 2U 2S 2S 2S 2U", "PROFILE_POINT": "4U 4U",
             "RUNTIME": "1U 1U 1U 1U 1U 1U 2U 2U 2U 2U 2U 1S 1U 1U 1U 1U 1U 2U 1U 1U 1U 1U 2U 2S 1U",
             }  # fmt: skip
"""Formats of the fields as the tables print them: bytes, and U unsigned, S signed, F floating."""
KMALL_SIZES = {"HEADER": 20, "PARTITION": 4, "BODY": 12, "SECTOR": 48, "RX": 32, "SOUNDING": 120, "WATER_TX": 12,
               "WATER_SECTOR": 16, "WATER_RX": 16, "WATER_BEAM": 16, "ATTITUDE_INFO": 12, "ATTITUDE": 132, "SENSOR": 8,
               "POSITION": 40, "PROFILE": 28, "PROFILE_POINT": 20}  # fmt: skip
"""Sizes that the structures of EMdgmFormat.h have, packed to 4 bytes."""
KMALL_OFFSETS = {
    "PING": {"ping_rate": 4, "beam_spacing": 8, "pulse_form": 13, "frequency_mode": 16, "absorption": 40,
             "port_metres": 60, "stabilisation": 64, "pipe": 68, "tx_beam_width": 72, "ramp_up": 84, "yaw_angle": 88,
             "sectors": 92, "heading": 96, "sound_speed": 100, "transducer_depth": 104, "water_level": 108,
             "position_method": 120, "latitude": 124, "longitude": 132, "ellipsoid_height": 140},
    "SOUNDING": {"sector": 2, "type": 3, "method": 4, "range_factor": 12, "quality": 16, "water_column_beam": 36,
                 "water_column_sample": 38, "level1": 48, "level2": 52, "tvg": 68, "angle": 72, "travel_time": 80,
                 "delta_latitude": 88, "down": 96, "starboard": 100, "forward": 104, "first_sample": 114,
                 "centre_sample": 116, "sample_count": 118},
    "ATTITUDE": {"seconds": 8, "status": 16, "latitude": 20, "roll": 40, "pitch": 44, "yaw": 48, "heave": 52,
                 "roll_rate": 56, "velocity_north": 68, "acceleration_down": 116, "delayed_seconds": 120,
                 "delayed_heave": 128},
}  # fmt: skip


@pytest.mark.parametrize(
    ("module", "table"), [(xtf_layouts, XTF_OFFSETS), (kmall_layouts, KMALL_OFFSETS)], ids=["xtf", "kmall"]
)
def test_fields_stand_where_the_tables_state(module, table):
    """Triton (2016), tables C-J and P; Kongsberg (2021), EMdgmFormat.h: byte offsets."""
    for name, offsets in table.items():
        fields = getattr(module, name).fields
        assert {field: fields[field][1] for field in offsets} == offsets, name


@pytest.mark.parametrize(
    ("module", "sizes"),
    [(xtf_layouts, XTF_SIZES), (kmall_layouts, KMALL_SIZES), (kongsberg_all_layouts, ALL_SIZES)],
    ids=["xtf", "kmall", "all"],
)
def test_records_have_the_printed_sizes(module, sizes):
    """Bytes of each record."""
    assert {name: getattr(module, name).itemsize for name in sizes} == sizes


@pytest.mark.parametrize("name", ALL_HEADS)
def test_all_fields_have_the_printed_formats(name):
    """Kongsberg (2018), tables 24, 29, 31, 32, 34, 39, 43, 46: bytes, sign and kind of every field in order."""
    made = getattr(kongsberg_all_layouts, name)
    letters = {"u": "U", "i": "S", "f": "F", "S": "U"}
    found = [f"{made[field].itemsize}{letters[made[field].kind]}" for field in made.names]
    assert found == ALL_HEADS[name].split()


def test_records_of_other_sizes_are_read_as_far_as_they_are_known():
    """Longer records: the rest is skipped; shorter ones: floats are NaN, whole numbers 0; none beyond the datagram."""
    kind = layout("u2 count; f4 depth speed; u2 last")
    content = np.array([(1, 2.0, 3.0, 4), (5, 6.0, 7.0, 8)], kind).tobytes()
    assert records(content, kind, 0, 2).tolist() == [(1, 2.0, 3.0, 4), (5, 6.0, 7.0, 8)]
    (longer,) = records(content, layout("u2 count; f4 depth"), 12, 1, 12)
    assert longer.tolist() == (5, 6.0)
    short = records(content, kind, 0, 2, 7)
    assert short["count"].tolist()[0] == 1 and short["depth"][0] == 2.0
    assert np.isnan(short["speed"]).all() and short["last"].tolist() == [0, 0]
    for offset, count, size in ((0, 3, 12), (-1, 1, 12), (0, -1, 12), (0, 1, 0), (24, 1, 12), (0, 10**9, 12)):
        with pytest.raises(DatagramError):
            records(content, kind, offset, count, size)
    assert records(content, kind, 24, 0, 12).size == 0


def test_rows_of_different_lengths_are_padded():
    """Floats with NaN, whole numbers with -1, samples of beams where they begin."""
    np.testing.assert_array_equal(stacked([np.array([1.0]), np.array([2.0, 3.0])]), [[1, np.nan], [2, 3]])
    np.testing.assert_array_equal(stacked([np.array([1]), np.array([], np.int64)], 3), [[1, -1, -1], [-1, -1, -1]])
    np.testing.assert_array_equal(stacked([np.float64(4), np.float64(5)]), [4, 5])
    found = ragged(bytes([9, 2, 254, 9, 6]), "i1", [1, 4], [2, 1], 0.5)
    np.testing.assert_array_equal(found, [[1, -1], [3, np.nan]])
    assert found.dtype == np.float32 and stacked([]).size == 0 and ragged(b"", "i1", [], [], 1.0).shape == (0, 0)
