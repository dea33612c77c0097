"""Tables and arrays seen from both ends: reciprocity, heave without jumps, and centres that may be chosen freely."""

import numpy as np
import pytest

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation._eigenray_kernel import AMPLITUDE, CAUSTICS, DELAY, LENGTH, SIN_ARRIVAL, SIN_LAUNCH
from insonify.propagation.eigenray_table import MAX_AMPLITUDE_ERROR, MAX_DELAY_ERROR, eigenray_table
from insonify.propagation.sound_speed_layers import sound_speed_layers

BED, FARTHEST = 20.0, 60.0
PROFILES = {
    "falling": SoundSpeedProfile([0.0, 20.0], [1510.0, 1495.0]),
    "thermocline": SoundSpeedProfile([0.0, 8.0, 14.0, 20.0], [1510.0, 1510.0, 1490.0, 1490.0]),
}
WATERS = {name: sound_speed_layers(profile, BED) for name, profile in PROFILES.items()}
SPAN = (10.0, 11.0)


@pytest.fixture(scope="module")
def tables():
    """Tables whose sources and points lie in one span of depths, each made once."""
    made = {}

    def of(name, family):
        if (name, family) not in made:
            made[name, family] = eigenray_table(
                WATERS[name], family, source_depths=SPAN, point_depths=SPAN, max_range=FARTHEST
            )
        return made[name, family]

    return of


@pytest.mark.parametrize("name", WATERS)
@pytest.mark.parametrize(("family", "back"), [("S", "S"), ("B", "B"), ("SB", "BS")])
def test_a_table_read_from_its_far_end_gives_the_same(tables, name, family, back):
    """Reciprocity: ends exchanged, letters in reverse: delay, length and level alike, both angles exchanged."""
    rng = np.random.default_rng(1)
    one, other = tables(name, family), tables(name, back)
    ranges = np.sort(rng.uniform(5, FARTHEST, 40))
    for here, there in ((10.13, 10.87), (10.0, 10.5), (10.42, 10.42)):
        out, count, _ = one.rays(here, np.full(40, there), ranges)
        home, again, _ = other.rays(there, np.full(40, here), ranges)
        np.testing.assert_array_equal(count, again)
        only = count == 1
        assert only.sum() > 30
        out, home = out[only, 0], home[only, 0]
        np.testing.assert_allclose(out[:, DELAY], home[:, DELAY], rtol=0, atol=2 * MAX_DELAY_ERROR)
        np.testing.assert_allclose(out[:, LENGTH], home[:, LENGTH], rtol=2 * MAX_AMPLITUDE_ERROR)
        np.testing.assert_allclose(out[:, AMPLITUDE], home[:, AMPLITUDE], rtol=2 * MAX_AMPLITUDE_ERROR)
        np.testing.assert_allclose(out[:, SIN_LAUNCH], -home[:, SIN_ARRIVAL], rtol=0, atol=2e-4)
        np.testing.assert_array_equal(out[:, CAUSTICS], home[:, CAUSTICS])


@pytest.mark.parametrize("name", WATERS)
@pytest.mark.parametrize("family", ["S", "SB"])
def test_a_heaving_sonar_crosses_no_step(tables, name, family):
    """Down in steps of 5 mm, through every plane of the table: delays change by -sin(launch) dz / c, and by no more.

    Fermat at the source's end; the launch angles of the same rows state by how much.
    """
    table = tables(name, family)
    depths = np.arange(SPAN[0], SPAN[1] + 1e-9, 0.005)
    ranges = np.array([8.0, 21.0, 47.0])
    read = np.array([table.rays(float(z), np.full(3, 10.3), ranges)[0][:, 0] for z in depths])
    speed = np.interp(depths, WATERS[name].depth, WATERS[name].speed)[:, None]
    slope = -read[:, :, SIN_LAUNCH] / speed
    expected = (slope[1:] + slope[:-1]) / 2 * 0.005
    assert np.abs(np.diff(read[:, :, DELAY], axis=0) - expected).max() < 2 * MAX_DELAY_ERROR
    # over the whole metre the errors do not add up
    total = read[-1, :, DELAY] - read[0, :, DELAY]
    np.testing.assert_allclose(expected.sum(axis=0), total, rtol=0, atol=1e-7)
    assert np.abs(total).min() > 1e-5
    level = 20 * np.log10(read[1:, :, AMPLITUDE] / read[:-1, :, AMPLITUDE])
    assert np.abs(level).max() < 0.04


def test_a_table_states_which_depths_it_was_made_for(tables):
    """For a plane beyond its span, it names the span and the fix; `covers` reports it before."""
    table = tables("falling", "S")
    assert table.covers(10.0) and table.covers(11.0) and not table.covers(11.01) and not table.covers(9.99)
    with pytest.raises(ValueError, match=r"table of S is for sources at 10 to 11 m; 12.5 m is outside.*whole track"):
        table.plane_at(12.5)


@pytest.mark.parametrize("order", [[2, 0, 1], [1, 2, 0]])
def test_the_order_of_questions_changes_no_bit(tables, order):
    """Points read together, in another order, or one by one."""
    table = tables("thermocline", "S")
    depth, ranges = np.array([10.1, 10.9, 10.5]), np.array([30.0, 12.0, 55.0])
    rays = table.rays(10.37, depth, ranges)[0][:, 0]
    np.testing.assert_array_equal(table.rays(10.37, depth[order], ranges[order])[0][:, 0], rays[order])
    alone = np.array([table.rays(10.37, depth[k : k + 1], ranges[k : k + 1])[0][0, 0] for k in range(3)])
    np.testing.assert_array_equal(alone, rays)
