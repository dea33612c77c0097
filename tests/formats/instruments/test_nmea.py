"""Claims about NMEA positions: degrees and minutes become radians; what is wrong is none."""

import numpy as np
import pytest

from insonify.formats.instruments.nmea import position


@pytest.mark.parametrize(
    ("sentence", "expected"),
    [
        ("$GPGGA,120000,5130.0,N,00315.0,W,4,9,1,0,M,0,M,,", (51.5, -3.25, 4)),
        ("$GNGGA,,0000.6,S,17959.4,E,1,,,,,,,", (-0.01, 179.99, 1)),
        # the example of the NMEA 0183 standard's description, with its checksum
        ("$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n", (48.1173, 11.516667, 1)),
    ],
)
def test_a_fix_is_read(sentence, expected):
    """With checksum or without, of any talker, in each quadrant."""
    fix = position(sentence)
    np.testing.assert_allclose([*np.degrees(fix[:2]), fix.quality], expected, atol=1e-6)


@pytest.mark.parametrize(
    "sentence",
    [
        "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*48",  # checksum
        "$GPGGA,123519,4807.038,N,01131.000,E,0,08",  # no fix
        "$GPGGA,123519,9100.0,N,01131.000,E,1,08",  # no latitude
        "$GPGGA,123519,4807.038,Q,01131.000,E,1,08",
        "$GPGGA,123519,nan,N,01131.000,E,1,08",
        "$GPGGA,123519,4807.038,N,inf,E,1,08",
        "$GPGGA,123519,4807.038",
        "$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W",
        "",
    ],
)
def test_what_is_no_fix_is_none(sentence):
    """Checksum, quality, range of the angles, number of fields and kind of the sentence."""
    assert position(sentence) is None
