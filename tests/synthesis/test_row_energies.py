"""Energies of path pairs on rows of directions, against sums over pairs written out."""

from itertools import pairwise

import numpy as np
import pytest

from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE
from insonify.synthesis._row_energies_kernel import (
    APART,
    COMPACT,
    PairEnergies,
    RowGrid,
    RowLegs,
    deposit_pairs_on_rows,
    mean_gain_product,
)

PAIRS = np.array([(i, j) for i in range(2) for j in range(2)])
RATE, ROW_PHASE, SUPPORT = 1e4, np.pi / 8, 2e-3


def deposited(second_delay, second_row, *, interference_factor=1.0, mean_energy=1.0, is_dense=False):
    """Rows, groups and omitted points of one point with two legs, the first of 10 ms at row 10."""
    legs = RowLegs(
        np.array([[0.01], [second_delay]]), np.array([[0.01], [second_delay]]), np.array([[1.0 + 0j], [0.5j]]),
        np.array([[2.0 + 0j], [1.0j]]), np.array([[10.0], [second_row]]),
    )  # fmt: skip
    energies = PairEnergies(PAIRS, np.ones((4, 1)), SUPPORT, interference_factor, mean_energy)
    cells = np.zeros((64, 400 + CELLS_PER_SPIKE), np.float32)
    *groups, left_out = deposit_pairs_on_rows(cells, RowGrid(0.0, RATE, ROW_PHASE), legs, energies, is_dense)
    spike = np.zeros_like(cells)  # one unit of energy on row 0
    alone = RowLegs(*(np.full((1, 1), value) for value in (0.01, 0.01, 1 + 0j, 1 + 0j, 0.0)))
    one = PairEnergies(PAIRS[:1], np.ones((1, 1)), SUPPORT, 1.0, 1.0)
    deposit_pairs_on_rows(spike, RowGrid(0.0, RATE, ROW_PHASE), alone, one, False)
    return cells.sum(axis=1) / spike.sum(), groups, left_out


@pytest.mark.parametrize(("together", "mean"), [(1.0, 1.0), (0.6, 1.1), (0.0, 1.0)])
def test_reciprocal_pairs_have_their_energies_and_their_interference_half_way(together, mean):
    """DD 4 at row 10, DS 1 at row 14 and SD 1 at row 10, SS 0.25 at row 14; 2 Re(DS SD*) at row 12 less its loss."""
    rows, groups, left_out = deposited(0.02, 14.0, interference_factor=together, mean_energy=mean)
    assert len(left_out) == sum(len(some.row) for some in groups) == 0
    excess = 2 * together * np.sinc(4 / 8)
    assert mean_gain_product(ROW_PHASE, 4.0) == pytest.approx(np.sinc(4 / 8), rel=1e-12)
    expected = np.zeros(64)
    expected[[10, 12, 14]] = mean * 5.0, excess, mean * 1.25
    np.testing.assert_allclose(rows, expected, atol=2e-5)


def test_a_direction_between_two_rows_is_shared_by_them():
    """Row 14.25 keeps three quarters in row 14; directions further apart than three lobes do not interfere."""
    rows, *_ = deposited(0.02, 10.0 + APART + 0.25)
    expected = np.zeros(64)
    expected[[10, 10 + int(APART), 11 + int(APART)]] = 5.0, 0.75 * 1.25, 0.25 * 1.25
    np.testing.assert_allclose(rows, expected, atol=2e-5)


@pytest.mark.parametrize(("distance", "groups", "omitted"), [(COMPACT, [4], 0), (APART, [2, 2], 0), (8.0, [], 1)])
def test_replicas_that_overlap_are_grouped_by_direction(distance, groups, omitted):
    """Replicas 1 ms apart: one group from one direction, two from directions apart, none between; nothing deposited."""
    rows, (found, *interference), left_out = deposited(0.0105, 10.0 + distance)
    assert not rows.any() and not any(len(some.row) for some in interference)
    assert len(left_out) == omitted
    assert np.diff(found.first).tolist() == groups
    if len(groups) == 1:
        np.testing.assert_allclose(found.delay, [0.02, 0.0205, 0.0205, 0.021])
        np.testing.assert_allclose(found.row, 10 + distance * 1.25 / 6.25)
    if len(groups) == 2:
        np.testing.assert_allclose(found.row, [10, 10 + distance])
        assert sorted(abs(found.weight)) == pytest.approx([0.5, 1, 1, 2])


@pytest.mark.parametrize("distance", [4.0, 12.0])
def test_of_dense_points_directions_between_interfere_half_way(distance):
    """DD, SD from row 10 and DS, SS from another: each alone, and 2 Re(A B*) times the mean product of the gains."""
    rows, (by_direction, added, subtracted), left_out = deposited(0.0105, 10.0 + distance, is_dense=True)
    assert not rows.any() and len(left_out) == 0
    np.testing.assert_allclose(by_direction.row, [10, 10 + distance])

    def powers(groups):
        """Power of the sum of each group at some frequencies, which determine it as times do."""
        phases = np.exp(2j * np.pi * np.arange(7)[:, None] * 131.0 * groups.delay)
        return [np.abs(phases[:, a:b] @ groups.weight[a:b]) ** 2 for a, b in pairwise(groups.first)]

    replicas = [(0.020, 2.0 + 0j), (0.0205, 1.0j), (0.0205, 1.0j), (0.021, -0.5 + 0j)]
    sums = [sum(w * np.exp(2j * np.pi * np.arange(7) * 131.0 * tau) for tau, w in some)
            for some in ([replicas[0], replicas[2]], [replicas[1], replicas[3]])]  # fmt: skip
    np.testing.assert_allclose(sorted(map(sum, powers(by_direction))), sorted((np.abs(one) ** 2).sum() for one in sums))
    cross = np.sinc(distance / 8) * 2 * (sums[0] * np.conj(sums[1])).real
    np.testing.assert_allclose(sum(powers(added)) - sum(powers(subtracted)), cross, atol=1e-12)
    np.testing.assert_allclose([*added.row, *subtracted.row], 10 + distance / 2)
