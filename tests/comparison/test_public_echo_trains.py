"""Echo trains of a public recording: multiples of a moored ship's hull and of the sea surface."""

import pytest

import insonify
from oracles.instrument_files import DATA

EK80 = DATA / "real/ek80-zeebrugge-38-70-120-200-333khz.raw"
SECOND = {"38 kHz": -12.4, "70 kHz": -23.2, "120 kHz": -23.2, "200 kHz": -30.4, "333 kHz": -39.3}
"""Level of the second echo re the first, measured in the file by other means [dB]."""


@pytest.mark.skipif(not EK80.is_file(), reason="the public recording is absent")
@pytest.mark.parametrize("group", SECOND)
def test_the_second_echo_comes_at_twice_the_first_range(group):
    """Within 20 mm, of a pulse 192 mm long: 2 samples of 9 mm, one tenth of the pulse; its level within 1.5 dB."""
    found = insonify.compare(EK80, EK80, group=group)
    values = {value.name: value.real for value in found.finding("echo trains").values}
    assert abs(values["range of 2z (hull) less that"]) < 0.020
    assert values["level of 2z (hull) re first"] == pytest.approx(SECOND[group], abs=1.5)


@pytest.mark.skipif(not EK80.is_file(), reason="the public recording is absent")
def test_hull_and_surface_echoes_are_told_apart():
    """At 38 kHz an echo lies 6.93 m behind the second, where the file's mounting has the surface, within 0.1 m."""
    found = insonify.compare(EK80, EK80, group="38 kHz")
    values = {value.name: value.real for value in found.finding("echo trains").values}
    assert abs(values["range of 2z + d (surface) less that"]) < 0.1
    assert values["level of 2z + d (surface) re first"] < values["level of 2z (hull) re first"] - 30
