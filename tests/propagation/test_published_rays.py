"""Rays that others computed, and ours."""

import csv
from pathlib import Path

import numpy as np
import pytest

from insonify.ocean import SoundSpeedProfile
from insonify.propagation import eigenrays
from oracles.columns import DEPTH, NAMED, SOURCE
from oracles.layered import rays

PUBLISHED = Path(__file__).parents[1] / "published" / "propagation_150m.csv"
ROWS = list(csv.DictReader(line for line in PUBLISHED.read_text().splitlines() if not line.startswith("#")))
HALF_A_DIGIT = 0.5000001


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row['water']}-{row['family']}")
def test_the_rays_over_150_m_are_those_of_the_table(row):
    """Launch angle, delay and level to the last printed digit, by the solver and by its oracle."""
    depth, speed = NAMED[row["water"]]
    profile = SoundSpeedProfile(np.array(depth, float), np.array(speed, float))
    found = eigenrays(
        profile, water_depth=DEPTH, source_depth=SOURCE, point_depth=19.0, range=150.0, families=[row["family"]]
    )
    assert found.status.tolist() == ["ok"]
    (slow,) = rays(depth, speed, SOURCE, row["family"], 19.0, 150.0)
    for launch, delay, amplitude in (
        (found.launch_angle[0], found.delay[0], found.amplitude[0]), (slow.launch, slow.delay, slow.amplitude),
    ):  # fmt: skip
        assert np.degrees(launch) == pytest.approx(float(row["launch_deg"]), abs=HALF_A_DIGIT * 1e-3)
        assert delay * 1e3 == pytest.approx(float(row["delay_ms"]), abs=HALF_A_DIGIT * 1e-6)
        assert 20 * np.log10(amplitude) == pytest.approx(float(row["level_db"]), abs=HALF_A_DIGIT * 1e-2)


def test_the_direct_path_in_the_thermocline_ends_at_a_shadow():
    """On the seabed it reaches 162 m and no more; the table's authors found none at 175 m."""
    depth, speed = NAMED["thermo20"]
    profile = SoundSpeedProfile(np.array(depth, float), np.array(speed, float))
    reach = np.array([150.0, 161.0, 163.0, 175.0, 200.0])
    found = eigenrays(profile, water_depth=DEPTH, source_depth=SOURCE, point_depth=DEPTH, range=reach, families=["D"])
    assert found.status[:2].tolist() == ["ok", "ok"]
    assert "ok" not in found.status[2:].tolist()
