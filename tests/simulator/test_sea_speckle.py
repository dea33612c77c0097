"""Beds under a moving sea speckle as much with few scatterers kept as with all of them."""

import numpy as np
import pytest

from insonify.simulator import build_simulator, simulate
from oracles.scenes import each_ping, nominal

pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")  # winds below 3 m/s are meant
RELIEF = {"relief": {"kind": "power-law", "rms": 0.05, "hurst": 0.8, "outer_scale": 10.0}}
TILTED = {"reflection": "tilted", "swell": {"height": 0.02, "length": 15.0}}
WAVES = {"reflection": "explicit", "wind_speed": 4.0, "swell": {"height": 0.1, "length": 30.0}}


def windy(wind):
    """A sea of glints."""
    return {"reflection": "statistical", "wind_speed": wind}


def bed(surface, seed=1, *, families=("D", "S"), window=(0.1, 0.11), importance_sampling=True, paths=None, **more):
    """The nominal seabed alone, under two narrow beams, by some families."""
    return nominal(
        seed=seed,
        surface=surface,
        track={"window": window},
        paths={
            "contributions": ["seabed"],
            "families": list(families),
            "importance_sampling": importance_sampling,
            **(paths or {}),
        },
        **more,
    )


def speckle(seeds, **settings):
    """Scintillation index of the sound, its level [dB] and the scatterers of a ping.

    Levels are those of all seeds over 2 ms about each time.
    """
    scenarios = [
        bed(settings["surface"], seed, **{k: v for k, v in settings.items() if k != "surface"}) for seed in seeds
    ]
    power = each_ping(scenarios, lambda s: np.abs(simulate(s, threads=1)["pressure"].values[0]) ** 2)
    mean, wide = power.mean(axis=0), power.shape[-1] // 5
    smooth = [np.convolve(np.pad(one, wide // 2, "edge"), np.ones(wide) / wide, "same") for one in mean]
    relative = power / np.array(smooth)[:, wide // 2 :][:, : power.shape[-1]]
    simulator = build_simulator(scenarios[0])
    count = sum(len(block().area) for block in simulator.engine.blocks(simulator.ping_geometry(0)))
    return np.mean(relative**2) / np.mean(relative) ** 2, 10 * np.log10(power.mean()), count


def test_a_windy_bed_speckles_as_much_as_with_every_scatterer():
    """3 m/s, D and S, 1.5 m arrays: index and level of 12 beds within 20 % and 0.55 dB, by less than half the points.

    N = 600 cells; both readings have most of their scatterers in common.
    """
    thin, full = (speckle(range(12), surface=windy(3.0), importance_sampling=one) for one in (True, False))
    assert thin[0] == pytest.approx(full[0], rel=0.2)
    assert thin[1] == pytest.approx(full[1], abs=0.55)
    assert thin[2] < 0.5 * full[2]


@pytest.mark.validate
@pytest.mark.parametrize(
    "settings",
    [
        {"surface": windy(2.5)}, {"surface": windy(4.0)},
        {"surface": windy(3.0), "families": ("D", "S", "B", "SB", "BS")},
        {"surface": windy(3.0), "families": ("D", "S", "BS"), "seabed": RELIEF},
        {"surface": windy(3.0), "transmit": {"length": 0.1}, "receive": {"length": 3.0, "steer": (-0.2, 0.0, 0.3)}},
        {"surface": TILTED}, {"surface": WAVES, "window": (0.1, 0.103)},
    ],
)  # fmt: skip
def test_beds_under_any_sea_speckle_as_much_as_with_every_scatterer(settings):
    """Winds, orders, relief, several beams, a swell's plane, drawn waves: index within 10 %, level within 0.25 dB.

    96 beds; both readings have most of their scatterers in common.
    """
    thin, full = (speckle(range(96), importance_sampling=one, **settings) for one in (True, False))
    assert thin[0] == pytest.approx(full[0], rel=0.1)
    assert thin[1] == pytest.approx(full[1], abs=0.25)
    assert thin[2] < full[2]


@pytest.mark.parametrize("families", [("D",), ("D", "S")])
def test_what_does_not_bounce_off_a_moving_surface_has_the_scatterers_of_a_calm(families):
    """By D alone the recording is bit-identical under a sea; by D and S a sea keeps all that a mirror keeps."""
    sea, calm = (bed(surface, families=families) for surface in (windy(4.0), {}))
    if families == ("D",):
        np.testing.assert_array_equal(simulate(sea)["pressure"].values, simulate(calm)["pressure"].values)
        return
    keys = []
    for one in (sea, calm):
        simulator = build_simulator(one)
        blocks = [block() for block in simulator.engine.blocks(simulator.ping_geometry(0))]
        keys.append(np.concatenate([block.scatterer_id for block in blocks]))
    assert np.isin(keys[1], keys[0]).mean() > 0.98
    assert len(keys[0]) > 3 * len(keys[1])


@pytest.mark.parametrize("shading", ["uniform", "hann"])
def test_ground_off_a_beam_without_side_lobes_is_received_by_glints(shading):
    """Expectation by S alone under 3 m/s: down to -50 dB of the beam as down to -110 dB, within 0.1 dB."""
    level = [
        10 * np.log10(simulate(bed(
            windy(3.0), families=("S",), field="incoherent", line={"shading": shading, "length": 0.75},
            paths={"beam_cutoff_db": floor}, window=(0.1, 0.102),
        ))["intensity"].values.mean())
        for floor in (-50.0, -110.0)
    ]  # fmt: skip
    assert level[0] == pytest.approx(level[1], abs=0.1)
