"""Claims about fields as variables: scaled to SI, missing values as NaN, codes as they are, texts cut at zeros."""

from pathlib import Path

import numpy as np
import pytest

from insonify.formats.instruments.columns import (
    DEGREE,
    Column,
    layout,
    ping_dataset,
    record_settings,
    sample_levels,
    time_dataset,
    values_of,
    variables,
)
from insonify.formats.instruments.instrument_file import MAX_VALUES, require_memory
from insonify.formats.store_description import StoreError

KIND = layout("i2 angle; u2 speed; u1 mode; f4 depth; S8 name")
ROWS = np.array([(9000, 65535, 3, 2.5, b"ab\0cd"), (-9000, 100, 255, np.inf, b"")], KIND)


def test_values_are_scaled_and_missing_ones_are_nan():
    """Hundredths of a degree to radians, the largest number as none, codes as whole numbers, odd floats as they are."""
    angle = Column("angle", "angle", "rad", "an angle", 0.01 * DEGREE)
    speed = Column("speed", "speed", "m/s", "a speed", 0.01, 65535)
    np.testing.assert_allclose(values_of(ROWS, angle), [np.pi / 2, -np.pi / 2])
    np.testing.assert_array_equal(values_of(ROWS, speed), [np.nan, 1.0])
    code = values_of(ROWS, Column("mode", "mode", "code", "a mode"))
    assert code.dtype == np.int64 and code.tolist() == [3, 255]
    assert values_of(ROWS, Column("depth", "depth", "m", "a depth", 1e300)).tolist() == [2.5e300, np.inf]


def test_big_endian_layouts_are_read():
    """Formats of other processors."""
    assert np.frombuffer(b"\1\2\0\0\0\7", layout("u2 a; u4 b", ">")).tolist() == [(258, 7)]


def test_a_setting_has_name_value_unit_and_source():
    """Texts end at the first zero; codes have the unit 1."""
    columns = (Column("title", "name", "", ""), Column("mode", "mode", "code", ""), Column("depth", "depth", "m", ""))
    made = list(record_settings(ROWS[0], columns, ("K", 40), "head "))
    assert [(s.name, s.value, s.unit) for s in made] == [
        ("head title", "ab", ""),
        ("head mode", 3, "1"),
        ("head depth", 2.5, "m"),
    ]
    assert {(s.datagram, s.offset) for s in made} == {("K", 40)}


def test_datasets_carry_time_and_number():
    """Pings with their numbers in the file; series over time; none without records."""
    found = variables([ROWS, ROWS[:1]], (Column("mode", "mode", "code", "a mode"),), ("ping", "beam"), 3)
    dataset = ping_dataset("water", [4, 7], np.array([1.0, 2.0]), found)
    assert dataset["mode"].values.tolist() == [[3, 255, -1], [3, -1, -1]] and dataset.ping.values.tolist() == [4, 7]
    assert dataset.time.attrs["units"].startswith("seconds since 1970") and dataset.attrs["group"] == "water"
    assert time_dataset([], np.empty(0), ()) is None
    series = time_dataset([ROWS, ROWS], np.arange(4.0), (Column("depth", "depth", "m", "a depth"),))
    assert series is not None and series.sizes["time"] == 4


def test_memory_is_refused_before_it_is_taken():
    """With the number of pings that fit, or the statement that none does."""
    with pytest.raises(StoreError, match=r"a\.x: 3 pings of 134217728 values are too many\. Read at most 2 at once"):
        require_memory(Path("a.x"), 3, MAX_VALUES // 2)
    with pytest.raises(StoreError, match="Read others"):
        require_memory(Path("a.x"), 1, 65_536, 65_536, 65_536)
    assert sample_levels(Path("a.x"), [], "levels").shape == (0, 0, 0)
