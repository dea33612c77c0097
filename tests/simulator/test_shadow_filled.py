"""Shadows filled by sound that the sea reflected: many pings empty them again, unless the sea stands still.

A wall of 1 m hides the bed behind it from the direct path, from 100 to 112.7 m; sound off the surface comes down
more steeply, on all of it but the first 3 m. There only surface and surface echoes are received, as from 108 to 112 m.
"""

import numpy as np
import pytest

from insonify.processing import synthetic_aperture_image
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from oracles.scenes import BED, point

pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
APERTURE, ELEMENT, WAVELENGTH, ALTITUDE = 1.5, 0.5, 0.015, 9.0
INDEPENDENT, FROZEN = 1.0, 0.0
"""Time from ping to ping [s]; 0: as fast as a platform may go, 15 ms for the whole aperture."""
NORTH, EAST = np.arange(-2, 2.1, 0.4), np.arange(108.6, 112.0, 0.1)
"""Pixels inside the shadow and the beam [m]; cells of the image are 0.55 and 0.15 m."""
WALL = {"shape": "box", "position": (0.0, 100.0), "size": (12.0, 0.2, 1.0)}


def recorded(count, interval, seed, **more):
    """Pings over one fixed aperture abeam of the wall, under 3 m/s of wind: what the bed sends."""
    step, line = APERTURE / count, {"kind": "line", "length": ELEMENT}
    speed = step / interval if interval else 100.0
    window = tuple(2 * np.hypot(east, ALTITUDE) / 1500 for east in (108.0, 112.6))
    paths = {
        "max_reflections": 1,
        "families": ["D", "S"],
        "contributions": ["seabed"],
        "edge_diffraction": "none",
        "beam_cutoff_db": -30,
        "scatterers_per_cell": 1,
        **more.pop("paths", {}),
    }
    scenario = Scenario(**{
        "water": {"noise_level_db": None, "absorption_db_per_m": 0.0}, "seabed": BED, "seed": seed, "targets": [WALL],
        "surface": {"reflection": "statistical", "wind_speed": 3.0}, "paths": paths, "field": "coherent",
        "sonar": {"source_level_db": 220, "pulse": {"kind": "cw", "frequency": 100e3, "duration": 0.2e-3},
                  "transmit": line, "receive": line, "mounting": {"bearing": np.pi / 2},
                  "receiver": {"bandwidth": 10e3, "synthetic_aperture": APERTURE}},
        "track": {"kind": "line", "start": ((step - APERTURE) / 2, 0.0, 11.0), "speed": speed, "interval": step / speed,
                  "pings": count, "window": window, "stop_and_hop": True}, **more,
    })  # fmt: skip
    return simulate(scenario, threads=1)


def power(recording, kept, north=NORTH, east=EAST):
    """Power of the focused image of a sonar that pings less often: mean over all ways to leave out the other pings."""
    every = recording.sizes["ping"] // kept
    parts = [recording.isel(ping=slice(first, None, every)) for first in range(every)]
    images = [
        synthetic_aperture_image(part, north, east, 20.0, stop_and_hop=True, navigation="true", threads=1)
        for part in parts
    ]
    return np.mean([np.abs(image.pressure.values) ** 2 for image in images], axis=0)


@pytest.fixture(scope="module")
def still_sea():
    """Sixty-four pings in 15 ms."""
    return recorded(64, FROZEN, 0)


def fall(counts, seas):
    """How much weaker the filled shadow gets from the fewest pings to each count, re a target seen directly [dB].

    The image is a mean over pings: a direct target keeps its peak, and direct ground without grating lobes its power,
    for both gather over the aperture whatever the count; of a sea that turns each ping anew N pings leave 1 / N.
    The target is received alone: where ground is seen directly it bears surface echoes of its own.
    """
    target = recorded(max(counts), FROZEN, 0, targets=[point(0.0, 110.0, 20.0)],
                      paths={"contributions": ["target"], "families": ["D"]})  # fmt: skip
    filled = [np.mean([power(sea, count) for sea in seas]) for count in counts]
    level = 10 * np.log10(np.array(filled) / [power(target, count, [0.0], [110.0]).max() for count in counts])
    return level[0] - level[1:]


def test_a_shadow_is_filled_by_sound_off_the_sea(still_sea):
    """Without surface paths it is 30 dB darker: what is left comes round the wall by the side lobes."""
    dark = recorded(16, FROZEN, 0, paths={"families": ["D"]})
    assert power(still_sea, 16).mean() > 1e3 * power(dark, 16).mean()


def test_a_shadow_empties_with_the_pings_over_independent_seas_only(still_sea):
    """16 and 64 pings a second apart: fill 6 dB weaker within 1 dB (0.26 standard error, found of 10 such seas).

    Over a sea that hardly moves in 15 ms: as it was, within 0.3 dB (0.05 expected of grating lobes, 0.01 error).
    """
    assert fall((16, 64), [recorded(64, INDEPENDENT, 0)]) == pytest.approx(10 * np.log10(4), abs=1.0)
    assert fall((16, 64), [still_sea]) == pytest.approx(0.0, abs=0.3)


def test_too_few_pings_copy_the_fill_at_their_grating_lobes(still_sea):
    """Pings d apart over a frozen sea: power of the fill = sum of that of 64 pings, shifted by wavelength R / 2 d.

    Within 0.3 dB for 8 pings, d more than a third of an element (copies at 4.4 m: some 0.6 dB), and for 16.
    """
    wide = np.arange(-16, 16.1, 0.4)
    whole = power(still_sea, 64, wide).mean(axis=1)
    for count in (8, 16):
        lobe = WAVELENGTH * np.hypot(EAST.mean(), ALTITUDE) / (2 * APERTURE / count)
        copies = np.sum([np.interp(NORTH + order * lobe, wide, whole, 0, 0) for order in range(-3, 4)], axis=0)
        assert 10 * np.log10(power(still_sea, count).mean() / copies.mean()) == pytest.approx(0.0, abs=0.3)


@pytest.mark.validate
def test_a_shadow_empties_by_12_db_with_256_pings():
    """16, 64, 256 pings, 4 seas: 6 and 12 dB within 1 dB (0.05, 0.08 standard error).

    Over 2 frozen seas as it was, within 0.3 dB (0.05 expected of grating lobes, 0.01 error).
    """
    seas = [[recorded(256, interval, seed) for seed in range(n)] for interval, n in ((INDEPENDENT, 4), (FROZEN, 2))]
    np.testing.assert_allclose(fall((16, 64, 256), seas[0]), 10 * np.log10([4, 16]), atol=1.0)
    np.testing.assert_allclose(fall((16, 64, 256), seas[1]), 0.0, atol=0.3)
