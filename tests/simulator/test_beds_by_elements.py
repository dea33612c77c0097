"""Claims about ground that an array receives element by element: summed with delays it is what beams receive."""

import numpy as np

from insonify.processing import beam_recording
from insonify.simulator import simulate
from oracles.scenes import nominal
from synthesis.oracle import relative_rms

COUNT = 16
SIZE = COUNT * 0.0075


LINE = {"kind": "line", "length": SIZE}
POINT = {"kind": "point", "element": "omni"}


def ground(record, transmit, sub_bands, importance_sampling):
    """Flat ground 45 to 48 m away by direct paths, a line of 0.12 m."""
    return nominal(
        water={"noise_level_db": None},
        line={"length": None},
        transmit=transmit,
        receive={"kind": "line", "length": SIZE, "elements": COUNT, "element": "baffled"},
        sonar={
            "pulse": {"kind": "cw", "frequency": 100e3, "duration": 0.5e-3},
            "receiver": {"bandwidth": 8e3, "record": record, "sub_bands": sub_bands},
        },
        paths={"contributions": ["seabed"], "max_reflections": 0, "importance_sampling": importance_sampling},
        track={"window": (0.059, 0.065)},
    )


def apart_db(transmit, sub_bands, *, importance_sampling):
    """Delay and sum of the elements less the beam, re the beam, in the middle of the window [dB]."""
    received = simulate(ground("elements", transmit, sub_bands, importance_sampling), threads=1)
    summed = beam_recording(received, [np.pi / 2]).pressure.values[0, 0]
    beam = simulate(ground("beams", transmit, sub_bands, importance_sampling), threads=1).pressure.values[0, 0]
    inner = slice(10, len(beam) - 10)
    return 20 * np.log10(relative_rms(summed[inner], beam[inner]))


def test_ground_summed_over_elements_is_that_of_the_beam():
    """With every scatterer drawn, insonified all around: -40 dB with three sub-bands, where one is 25 to 30 dB off.

    What one lacks is what a line's side lobes do within the band (seen: -48 and -27 dB).
    """
    assert apart_db(POINT, 3, importance_sampling=False) < -40
    assert apart_db(LINE, 3, importance_sampling=False) < -40
    assert -30 < apart_db(POINT, 1, importance_sampling=False) < -25


def test_in_side_lobes_elements_have_other_scatterers_than_beams():
    """As drawn: a beam's share falls with its own side lobes, an element's does not; two like lines are 20 dB off."""
    assert -40 < apart_db(LINE, 1, importance_sampling=True) < -20
