"""Figures 1, 8 and 9: the profile as it is held, what it makes of the returns, and what it moves."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from insonify.paper import figure1, figure8, figure9
from insonify.paper.checked_numbers import CheckedNumber
from insonify.paper.thermocline_model import PROFILE, WARM_LAYER, layered, replica_sum, scene


def by_name(rows: list[CheckedNumber]) -> dict[str, float]:
    """Values of a figure's numbers by name."""
    return {row.name: row.value for row in rows}


def test_the_profile_comes_back_as_it_was_written() -> None:
    """Figure 1: knots of scenario file and table are exact, and so is the line between them."""
    rows = figure1.numbers()
    assert len(rows) == 2 * len(PROFILE) + 3
    assert all(row.holds is not False for row in rows)
    assert layered().water.layered and figure1.profile_read_from_yaml() == figure1.profile_read_from_table()


def test_the_edge_of_the_shadow_is_a_published_162_metres() -> None:
    """The reference solution has no direct ray to the bed beyond about 162 m; the closed form states where and when."""
    reach, delay = figure8.shadow_edge()
    assert reach == pytest.approx(162, abs=0.5)
    # the mean speed along the way lies between the slowest and the fastest
    assert 2 * np.hypot(reach, 9) / 1510 < delay < 2 * np.hypot(reach, 9) / 1490 * 1.01


@pytest.mark.parametrize("profile", [True, False])
def test_the_series_is_the_sum_of_its_replicas_without_a_perturbation_too(profile: bool) -> None:
    """In both waters, with the random amplitude switched off: 1e-6 of the rms, in a window about the target."""
    from insonify.simulator import simulate

    scenario = scene(profile, {"paths.amplitude_perturbation": 0.0, "track.window": (0.199, 0.204)})
    series = simulate(scenario)["pressure"].values[0, 0]
    whole = replica_sum(scenario)
    assert np.linalg.norm(series - whole) < 1e-6 * np.linalg.norm(whole)


def test_every_number_of_figure_9_holds() -> None:
    """Shifts and spreading of all spikes equal those of exact eigenrays: 1e-9 s and 0.02 dB for each of two legs."""
    rows = figure9.numbers()
    assert sum(row.holds is True for row in rows) == 1 + 2 * 3
    for row in rows:
        assert row.holds is not False, (row.name, row.value)


def test_the_profile_moves_more_than_the_surface() -> None:
    """Against the paper: target and bed 0.6 to 0.8 ms later and stronger, the surface over a millisecond earlier."""
    numbers = by_name(figure9.numbers())
    assert 0.64 < numbers["box at 150 m: later by, least"] < numbers["box at 150 m: later by, most"] < 0.79
    assert numbers["seabed at 150 m: later by"] == pytest.approx(0.778, abs=2e-3)
    assert -1.2 < numbers["surface at 150 m: later by"] < -1.17
    assert (
        numbers["echo of the target: more energy"] > 3
        and numbers["seabed at 150 m: level higher by, mean of the spikes"] > 10
    )
    assert numbers["seabed over direct paths, farthest"] == pytest.approx(162.03, abs=0.1)


def test_a_warm_layer_above_the_sonar_moves_the_surface_only() -> None:
    """As the paper concludes: surface returns 0.7 ms earlier, the arrivals of bed and target the same to 1e-9 s."""
    numbers = by_name(figure9.numbers())
    assert numbers["surface at 150 m under a warm layer: later by"] == pytest.approx(-0.71, abs=0.02)
    for name in ("seabed", "box"):
        assert abs(numbers[f"{name} at 150 m under a warm layer: later by"]) < 1e-6
    layer = figure9.profile_effect("surface", WARM_LAYER)
    assert np.abs(layer.shift - layer.exact).max() < 2e-9


def test_shifts_are_of_the_same_places() -> None:
    """Hundreds of places on each boundary, and every one of the box, stand alike in both waters."""
    for object_name, most in (("seabed", 162.1), ("surface", 187.0)):
        found = figure9.profile_effect(object_name)
        assert found.distance.size > 1000 and found.distance.max() < most
        assert np.all(np.isfinite(found.exact))
    box = figure9.profile_effect("box")
    assert box.distance.min() == pytest.approx(150.0, abs=1e-6) and box.distance.max() < 151.0


def test_panels_of_figure_8_share_the_window() -> None:
    """Spikes, levels and series over the same 35 ms; every axis has a unit."""
    figure = Figure(figsize=(8, 8))
    figure8.panels(figure, scene(True))
    profile, rays, spikes, energy, series = figure.get_axes()
    assert spikes.get_xlim() == energy.get_xlim() == series.get_xlim() == pytest.approx((195, 230))
    assert profile.get_xlabel() == "sound speed [m/s]" and rays.get_xlabel() == "horizontal range [m]"
    assert series.get_xlabel().endswith("[ms]")
    assert [t.get_text() for t in spikes.get_legend().get_texts()] == ["seabed", "surface", "target"]
    assert "no direct path" in [t.get_text() for t in rays.get_legend().get_texts()]
