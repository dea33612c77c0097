"""Echo trains of a public recording: multiples of a moored ship's hull and of the sea surface."""

import pytest

from insonify.comparison.echo_trains import EchoTrains
from insonify.comparison.frame import common_frame
from insonify.comparison.sources import samples_of
from oracles.instrument_files import DATA

EK80 = DATA / "real/ek80-zeebrugge-38-70-120-200-333khz.raw"
SECOND = {"38 kHz": -12.4, "70 kHz": -23.2, "120 kHz": -23.2, "200 kHz": -30.4, "333 kHz": -39.3}
"""Level of the second echo re the first, measured in the file by other means [dB]."""


def measured(group):
    """Numbers of the echo train of one frequency."""
    if not EK80.is_file():
        pytest.skip(f"{EK80.name}, a public recording, is not in the folder INSONIFY_DATA")
    samples = samples_of(EK80, group)
    frame = common_frame(samples, samples)
    train = EchoTrains(frame)
    values = train.estimate(train.sums(frame.first).sum(axis=0))
    return {quantity.name: value for quantity, value in zip(train.quantities, values, strict=True)}


@pytest.mark.parametrize("group", SECOND)
def test_the_second_echo_comes_at_twice_the_first_range(group):
    """Within 20 mm: two samples of 9 mm, a tenth of the pulse of 192 mm. Its level within 2 dB."""
    values = measured(group)
    assert abs(values["range of 2z (hull) less that"]) < 0.020
    assert values["level of 2z (hull) re first"] == pytest.approx(SECOND[group], abs=2.0)


@pytest.mark.parametrize("group", ["38 kHz", "120 kHz", "200 kHz"])
def test_hull_and_surface_echoes_are_distinguished(group):
    """An echo 30 dB or more below the second lies behind it by the depth of the transducer, 6.93 m, within 0.11 m."""
    values = measured(group)
    assert abs(values["range of 2z + d (surface) less that"]) < 0.11
    assert values["level of 2z + d (surface) re first"] < values["level of 2z (hull) re first"] - 30
