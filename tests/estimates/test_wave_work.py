"""Claims about the work of legs off explicit waves: as many bounce points, and searches, as a run has."""

import numpy as np
import pytest

import insonify
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.estimates import ping_work as ping_work_module
from insonify.estimates import unit_costs
from insonify.estimates.boundary_points import points_on_boundary
from insonify.estimates.ping_work import ping_work
from insonify.estimates.wave_work import wave_leg_seconds
from insonify.propagation import explicit_surface
from insonify.simulator import build_simulator
from oracles.few_of import few_of
from oracles.scenes import nominal

WIDE = {"transmit": {"kind": "line", "length": 0.02}, "receive": {"kind": "line", "length": 0.02}}


@few_of((0, 2), ("wind_speed", "reach"), [(2.5, 0.06), (2.5, 0.12), (5.0, 0.06)])
def test_the_work_of_waves_follows_searches_and_bounce_points(monkeypatch, wind_speed, reach):
    """Bounce points that a run evaluates, priced, are 0.4 to 1.2 of an estimate that has the search as well.

    Near scatterers, above which the surface is steep to few rays, take less.
    """
    scenario = nominal(
        surface={"reflection": "explicit", "wind_speed": wind_speed}, line={"length": 0.06},
        track={"window": (0.8 * reach, reach)},
        paths={"max_reflections": 1, "contributions": ["seabed"], "scatterers_per_cell": 0.3},
    )  # fmt: skip
    seen, search = [], explicit_surface.bounce_points

    def spied(start, ends, is_transmit, waves, water, limits, count, points):
        search(start, ends, is_transmit, waves, water, limits, count, points)
        distance = np.hypot(*(ends.position[:, :2] - start[:2]).T)
        seen.append((waves.shape[1], len(ends.first) - 1, count.mean(), count.max(), distance.mean()))

    monkeypatch.setattr(explicit_surface, "bounce_points", spied)
    insonify.simulate(scenario, pings=0)
    waves, searches, mean, most, distance = max(seen, key=lambda one: one[1])
    simulator = build_simulator(scenario)
    each = waves * unit_costs.SECONDS_PER_WAVE + unit_costs.SECONDS_PER_WAVE_NODE
    bounces = 2 * (5 * mean * each + (most - 1) * unit_costs.SECONDS_PER_BOUNCE_ROW)
    total = wave_leg_seconds(simulator, 11.0, 20.0, np.array([distance]), np.full(1, np.inf))[0]
    assert searches > 100 and 0.4 < bounces / total < 1.2
    near = wave_leg_seconds(simulator, 11.0, 20.0, np.array([distance / 4]), np.full(1, np.inf))[0]
    assert near < 0.8 * total


def test_scatterers_in_one_cell_share_a_search():
    """A thousand scatterers in each cell cost less than half of those that lie apart."""
    scenario = nominal(surface={"reflection": "explicit", "wind_speed": 3.0}, paths={"max_reflections": 1})
    simulator, distance = build_simulator(scenario), np.array([40.0])
    apart, together = (wave_leg_seconds(simulator, 11.0, 20.0, distance, np.full(1, cell)) for cell in (np.inf, 1e-4))
    assert together < apart / 2


def seconds(distance, **surface):
    """Processor time of one leg to a scatterer apart from others, at a horizontal distance [s]."""
    scenario = nominal(surface={"reflection": "explicit", **surface}, paths={"max_reflections": 1})
    return float(
        wave_leg_seconds(build_simulator(scenario), 11.0, 20.0, np.array([distance]), np.full(1, np.inf))[0]
    )  # fmt: skip


def test_a_long_low_swell_has_one_bounce_point():
    """A swell of 1 mm: the work is that of a search along a few nodes of one wave, and of one bounce point."""
    swell = {"swell": {"height": 0.001, "length": 100.0}}
    each = unit_costs.SECONDS_PER_WAVE + unit_costs.SECONDS_PER_WAVE_NODE
    assert 2 * (3 + 5) * each < seconds(50.0, **swell) < 2 * (6 + 5) * each


def test_many_waves_take_longer_than_one():
    """Those of wind have 192 directions and lengths, a swell one."""
    assert seconds(50.0, wind_speed=3.0) > 10 * seconds(50.0, swell={"height": 0.2, "length": 60.0})


def test_work_grows_with_the_distance():
    """Grazing rays reflect off more of the surface: each doubling of the distance takes longer."""
    work = [seconds(distance, wind_speed=2.5) for distance in (10.0, 20.0, 40.0, 80.0)]
    assert work == sorted(work) and work[-1] > 2 * work[0]


def test_legs_off_waves_are_part_of_the_time_of_a_run():
    """Without a reflection off the surface a run takes less, by the time of the legs to its scatterers."""
    track, surface = {"window": (0.05, 0.06)}, {"reflection": "explicit", "wind_speed": 2.5}
    calm, wavy = (
        ping_work(build_simulator(nominal(
            surface=surface, sonar=WIDE, track=track, paths={"max_reflections": order, "contributions": ["seabed"]}
        ))) for order in (0, 1)
    )  # fmt: skip
    assert wavy.seconds - calm.seconds > 0.3 * wavy.points * seconds(40.0, wind_speed=2.5) / 2


def test_platforms_apart_search_for_each_end():
    """Two platforms need legs of their own to each scatterer: more time for each than with one."""
    shared = {
        "surface": {"reflection": "explicit", "wind_speed": 2.5},
        "sonar": WIDE,
        "track": {"window": (0.05, 0.06)},
        "paths": {"max_reflections": 1, "contributions": ["seabed"]},
    }
    one = ping_work(build_simulator(nominal(**shared)))
    two = ping_work(build_simulator(nominal(receiver_track={"kind": "static", "position": (3.0, 2.0, 12.0)}, **shared)))
    assert two.seconds / two.points > 1.2 * one.seconds / one.points


def test_scatterers_between_two_platforms_have_the_area_of_the_engines():
    """Mean area for each scatterer, by which neighbours share a search: that of a ping's, to a third."""
    simulator = build_simulator(nominal(
        receiver_track={"kind": "static", "position": (3.0, 2.0, 12.0)}, sonar=WIDE, track={"window": (0.03, 0.04)},
        paths={"max_reflections": 0, "contributions": ["seabed"]},
    ))  # fmt: skip
    here, engine, scenario = simulator.ping_geometry(0), simulator.engine, simulator.scenario
    resolution = ping_scatterers(engine.scene, engine.path_settings, 1, here, engine.rays).resolution
    counted = points_on_boundary(here, 20.0, engine.rays, ("D",), resolution, scenario, 0.0, ())
    area = np.concatenate([block().area for block in engine.blocks(here)])
    assert counted.number @ counted.cell / counted.number.sum() == pytest.approx(area.mean(), rel=1 / 3)


@pytest.mark.parametrize(("frequency", "wind_speed"), [(20e3, 3.0), (200e3, 6.0)], ids=["smooth", "rough"])
def test_pairs_of_glints_are_counted(frequency, wind_speed):
    """Pairs of legs to random points in the water, with coherent parts where these are left: the engine's, to 20 %."""
    simulator = build_simulator(nominal(
        surface={"reflection": "statistical", "wind_speed": wind_speed}, track={"window": (0.02, 0.04)},
        water={"volume_strength_db": -60.0, "noise_level_db": None},
        sonar={**WIDE, "pulse": {"kind": "cw", "frequency": frequency, "duration": 1e-3}},
        paths={"max_reflections": 2, "contributions": ["water"], "scatterers_per_cell": 0.5},
    ))  # fmt: skip
    here, kept = simulator.ping_geometry(0), simulator.scenario.paths.followed_families
    points = simulator.engine.blocks(here)[0]().take(slice(500))
    pairs = simulator.engine.pairs(here, lambda: points)
    distance = np.hypot(*(points.position[:, :2] - here.transmit_position[:2]).T)
    each = ping_work_module._pairs_of_glints(simulator, here, "water", kept, distance, points.position[:, 2])
    assert len(pairs.pair) > 1.5 * len(kept) ** 2
    assert each.mean() * len(kept) ** 2 == pytest.approx(len(pairs.pair), rel=0.2)
