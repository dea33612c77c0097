"""The tracer under a statistical surface: facets against integrals, and pairs against the eigenray engine."""

import numpy as np
import pytest

from insonify.engines.tracer import engine as tracer_engine
from insonify.engines.tracer import facet_scattering
from insonify.scattering.bubbles import bubble_loss_db
from insonify.simulator import build_simulator, levels, simulate
from oracles.few_of import few_of
from oracles.scenes import nominal
from oracles.traced import BOX, apart_db, curves, scene

LOW = {"sonar": {"pulse": {"frequency": 20e3, "duration": 1e-3}}}
PATHS = {"max_reflections": 1, "contributions": ["seabed"]}


def sea(wind):
    """A statistical surface under a wind [m/s]."""
    return {"reflection": "statistical", "wind_speed": wind}


def facets_of(wind, **changes):
    """Facets of the tracer's surface in the nominal scene."""
    simulator = build_simulator(scene("tracer", surface=sea(wind), **changes))
    return simulator.tracer.ping(simulator.ping_geometry(0)).facets


def mean_curves(engine, seeds, **changes):
    """Mean over seeds of the curves of each pair."""
    runs = [curves(scene(engine, seed=seed, **changes)) for seed in range(1, seeds + 1)]
    return {key: np.mean([run[key] for run in runs], axis=0) for key in runs[0]}


@pytest.mark.parametrize("row", [14, 18, 22])
def test_slopes_of_facets_are_those_of_the_sea(row):
    """Density of slopes at three grazing angles: integral 1 to 1e-4, variances of the waves both ways to 3 %.

    Slopes of either sign are equally likely: glints are drawn with a random phase.
    """
    facets = facets_of(3.0)
    table = facet_scattering.slope_densities(3.0, facets.wavenumber, facets.waves.wavenumber[-1])[row]
    step = 2 * facet_scattering.MAX_SLOPE / facet_scattering.CELLS
    slope = (np.arange(facet_scattering.CELLS) - facet_scattering.CELLS // 2) * step
    assert table.sum() * step**2 == pytest.approx(1, abs=1e-4)
    for axis in (0, 1):
        square = np.sum(table.sum(axis=1 - axis) * slope**2) * step**2
        assert square == pytest.approx(facets.waves.slope_moments[axis, -1], rel=0.03)
    np.testing.assert_allclose(table[1:, 1:], table[:0:-1, :0:-1], atol=1e-6 * table.max())


@few_of((0,), "grazing", [30.0, 60.0])
@pytest.mark.parametrize(("wind", "changes"), [(3.0, {}), (1.0, LOW)], ids=["rough", "partly coherent"])
def test_a_moving_surface_returns_all_but_what_bubbles_take(grazing, wind, changes):
    """Coherent part and integral of the facets' cross section over the hemisphere: 1 less bubble loss, to 3 %.

    Random facets return the same, to 2 % of 20 000.
    """
    facets, dip = facets_of(wind, **changes), np.radians(grazing)
    incoming = np.array([0.0, np.cos(dip), -np.sin(dip)])
    u, v = np.meshgrid(*2 * (np.linspace(-1, 1, 601),))
    down = np.sqrt(np.maximum(1 - u**2 - v**2, 0.0))
    some = down > 0.01
    out = np.stack([u[some], v[some], down[some]], axis=-1)
    scattered = facets.scattered_per_steradian(np.tile(incoming, (len(out), 1)), out)
    diffuse = np.sum(scattered / out[:, 2]) * (1 / 300) ** 2
    sine, lost = np.array([np.sin(dip)]), bubble_loss_db(wind, facets.frequency, dip)
    whole = (diffuse + facets.coherent_intensity(sine)[0]) * 10 ** (lost / 10)
    assert whole == pytest.approx(1, abs=0.03)
    n, launch = 20_000, np.random.default_rng(3).uniform(0.1, 1, (20_000, 3))
    _, fraction = facets.reflected(np.tile(incoming, (n, 1)), launch, np.zeros(n, np.int64), 0)
    assert fraction.mean() == pytest.approx(diffuse, rel=0.02)


@few_of(
    (0, 3),
    ("wind", "changes", "grazing", "tolerance"),
    [(8.0, {}, 12.0, 0.02), (8.0, {}, 24.0, 0.02), (1.0, LOW, 20.0, 0.05), (1.0, LOW, 40.0, 0.05)],
)
def test_random_facets_reflect_in_the_directions_of_the_cross_section(wind, changes, grazing, tolerance):
    """Energy in bands of outgoing grazing angle and of bearing: integral of the cross section, to 2 %.

    Of a rough sea with many quanta. Slopes of a smooth one are those of single waves, whose density the tables smooth
    over cells: to 5 %, in wider bands.
    """
    facets, dip, n = facets_of(wind, **changes), np.radians(grazing), 400_000
    incoming, launch = np.array([0.0, np.cos(dip), -np.sin(dip)]), np.random.default_rng(3).uniform(0.1, 1, (n, 3))
    reflected, fraction = facets.reflected(np.tile(incoming, (n, 1)), launch, np.zeros(n, np.int64), 0)
    up, bearing = (np.radians(np.arange(*limits)) for limits in ((0.1, 90, 0.2), (-179.75, 180, 0.5)))
    up, bearing = (angle.ravel() for angle in np.meshgrid(up, bearing, indexing="ij"))
    out = np.stack([np.cos(up) * np.sin(bearing), np.cos(up) * np.cos(bearing), np.sin(up)], axis=-1)
    scattered = facets.scattered_per_steradian(np.tile(incoming, (len(out), 1)), out) * np.cos(up)
    expected, turned = np.radians(0.2) * np.radians(0.5) * scattered, np.arctan2(reflected[:, 0], reflected[:, 1])
    bands = [
        (np.arcsin(reflected[:, 2]), up, np.radians([8, 20, 28, 60] if changes else [8, 16, 20, 24, 28, 36, 60])),
        (np.abs(turned), np.abs(bearing), np.radians([0, 10, 20] if changes else [0, 1, 3, 6, 10, 15])),
    ]
    for angle, quadrature_angle, edges in bands:
        drawn, _ = np.histogram(angle, edges, weights=fraction / n)
        integral, _ = np.histogram(quadrature_angle, edges, weights=expected)
        np.testing.assert_allclose(drawn, integral, rtol=tolerance)


def test_glints_overhead_return_what_a_flat_surface_returns():
    """Boundary echo S to point arrays: its energy off a flat surface, facets and all, within 0.1 dB of 40 000 rays."""
    point = {"kind": "point", "length": None}
    paths = {"families": ["D", "S"], "contributions": ["boundary echo"]}
    water, found = {"noise_level_db": None, "absorption_db_per_m": 0.0}, []
    for surface in ({}, sea(3.0)):
        changes = {"surface": surface, "transmit": point, "receive": point, "water": water}
        level = levels(scene("tracer", window=(0.01, 0.025), paths=paths, **changes), threads=1).level_db
        found.append(10 ** (level.sel(contribution="boundary echo", pair="S").values / 10))
    lost = bubble_loss_db(3.0, 100e3, np.pi / 2)
    assert apart_db(found[1], found[0]) == pytest.approx(-lost, abs=0.1)


@pytest.mark.parametrize("apart", [0.0, -0.1])
@pytest.mark.parametrize(("rays", "tolerances"), [
    (20_000, {"D-S": 0.03, "S-S": 0.15}), pytest.param(400_000, {"D-S": 0.02, "S-S": 0.06}, marks=pytest.mark.validate),
])  # fmt: skip
def test_partly_coherent_surface_paths_interfere_as_the_engine_has_it(apart, rays, tolerances):
    """1 m/s at 20 kHz, arrays together and 0.1 m apart: D-S and S-S have the coherence of glints.

    Within four standard errors of one run of 20 000 rays, 0.006 and 0.037 dB; twelve of the engine, 0.002 and 0.006.
    """
    changes = {"surface": sea(1.0), "paths": PATHS, "receive": {"offset": (0.0, 0.0, apart)}, **LOW}
    ours, theirs = mean_curves("tracer", 1, rays=rays, **changes), mean_curves("eigenrays", 12, **changes)
    for pair, tolerance in tolerances.items():
        assert apart_db(ours["seabed", pair], theirs["seabed", pair]) == pytest.approx(0, abs=tolerance), pair


def profile(*knots):
    """Layered water without noise."""
    return {"water": {"profile": knots, "noise_level_db": None}}


def test_nearly_uniform_water_sounds_as_uniform_water_under_a_moving_sea():
    """2 mm/s over the depth, refracted legs for straight ones, rays alike: 1 m/s at 20 kHz, pairs within 0.01 dB."""
    changes = {"surface": sea(1.0), "paths": PATHS, "receive": {"offset": (0.0, 0.0, -0.1)}, "rays": 10_000, **LOW}
    straight, refracted = (
        curves(scene("tracer", **changes, **profile((0, 1500.0), (20, speed)))) for speed in (1500.0, 1500.002)
    )
    for pair in ("D-S", "S-S", "all"):
        assert apart_db(refracted["seabed", pair], straight["seabed", pair]) == pytest.approx(0, abs=0.01), pair


@few_of(
    (0,), ("knots", "apart"), [(((0, 1500.0), (20, 1470.0)), -0.1), (((0, 1500.0), (8, 1510.0), (20, 1525.0)), 0.0)]
)
def test_a_moving_sea_over_layered_water_returns_what_the_engine_has(knots, apart):
    """1 m/s at 20 kHz, 2 % of refraction down or up, arrays apart or together: D-S within 0.03 dB, S-S within 0.12 dB.

    Four standard errors of 20 000 rays and of four seeds of the engine, added to 0.02 and 0.06 dB, by which 80 000 rays
    and eight seeds differ.
    """
    changes = {"surface": sea(1.0), "paths": PATHS, "receive": {"offset": (0.0, 0.0, apart)}, **LOW, **profile(*knots)}
    ours, theirs = mean_curves("tracer", 1, rays=20_000, **changes), mean_curves("eigenrays", 4, **changes)
    for pair, tolerance in {"D-S": 0.03, "S-S": 0.12}.items():
        assert apart_db(ours["seabed", pair], theirs["seabed", pair]) == pytest.approx(0, abs=tolerance), pair


@pytest.mark.parametrize(("tracers", "engines", "tolerance"), [
    (1, 4, 1.5), pytest.param(8, 24, 0.5, marks=pytest.mark.validate),
])  # fmt: skip
def test_glints_turn_sound_out_of_a_narrow_beam_as_the_engine_has_it(tracers, engines, tolerance):
    """3 m/s at 100 kHz, where D-S falls by 13 dB: within four standard errors, 0.35 dB a tracer, 0.28 dB an engine."""
    changes = {"surface": sea(3.0), "paths": PATHS}
    ours, theirs = mean_curves("tracer", tracers, **changes), mean_curves("eigenrays", engines, **changes)
    flat = curves(scene("eigenrays", paths=PATHS))
    assert apart_db(theirs["seabed", "D-S"], flat["seabed", "D-S"]) < -12
    assert apart_db(ours["seabed", "D-S"], theirs["seabed", "D-S"]) == pytest.approx(0, abs=tolerance)


@pytest.mark.validate
@pytest.mark.parametrize("wind", [3.0, 8.0])
def test_pairs_off_a_rough_sea_are_those_of_the_engine(wind):
    """D-S, S-S and a box: 24 seeds of the engine with 20 scatterers a cell, 8 of the tracer, within 0.25 dB."""
    changes = {"surface": sea(wind), "paths": {"max_reflections": 1}, "targets": [{**BOX, "position": (0.0, 65.5)}]}
    theirs = mean_curves("eigenrays", 24, **{**changes, "paths": {"max_reflections": 1, "scatterers_per_cell": 20.0}})
    ours = mean_curves("tracer", 8, rays=60_000, **changes)
    for key in (("seabed", "D-S"), ("seabed", "S-S"), ("seabed", "all"), ("target", "D-S"), ("target", "all")):
        assert apart_db(ours[key], theirs[key]) == pytest.approx(0, abs=0.25), key


def test_launch_directions_are_planned_once_for_each_end(monkeypatch):
    """Two samplers for the rays of a ping, from the transmitter and from the receiver, however many parts they have."""
    planned, plan = [], tracer_engine.launch_sampler
    monkeypatch.setattr(tracer_engine, "launch_sampler", lambda *given: planned.append(given) or plan(*given))
    simulate(scene("tracer", rays=100, surface=sea(3.0), paths=PATHS, receive={"offset": (0.0, 0.0, -0.1)}))
    assert len(planned) == 2


def test_threads_do_not_change_a_bit_under_a_moving_sea():
    """One thread or two: the same bits, with a box."""
    scenario = scene("tracer", rays=1000, surface=sea(3.0), targets=[BOX], paths={"max_reflections": 2})
    one, two = (simulate(scenario, threads=n).intensity.values for n in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_a_weak_wind_leaves_a_flat_surface():
    """0.3 m/s at 20 kHz: every pair of D and S within 0.02 dB of those off a flat surface."""
    flat, moving = (curves(scene("tracer", rays=2000, paths=PATHS, surface=one, **LOW))
                    for one in ({}, sea(0.3)))  # fmt: skip
    for pair in ("D-S", "S-S", "all"):
        assert apart_db(moving["seabed", pair], flat["seabed", pair]) == pytest.approx(0, abs=0.02), pair


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"surface": {"reflection": "explicit", "wind_speed": 3.0}}, "flat or statistical"),
        ({"surface": sea(3.0), "targets": [{"shape": "point", "position": (0.0, 75.0, 15.0)}]}, "point targets"),
    ],
)  # fmt: skip
def test_surfaces_that_the_tracer_lacks_are_refused_with_a_remedy(changes, message):
    """Explicit waves, and glints of point targets under a moving sea, are the other engine's."""
    with pytest.raises(ValueError, match=f"(?s){message}.*eigenrays"):
        nominal(**{"field": "incoherent", "paths": {"engine": "tracer"}, **changes})
