"""What a moving surface does to recordings: less repeats from ping to ping, and no sound is lost."""

import numpy as np
import pytest

from insonify.simulator import arrivals, levels, simulate
from oracles.scenes import each_ping, nominal, point
from oracles.time_series import relative_rms

pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")  # winds below 3 m/s are meant
WINDY = {"reflection": "statistical", "wind_speed": 3.0}
TILTED = {"reflection": "tilted", "swell": {"height": 0.04, "length": 30.0}}


def bed(field, wind, seed=1, families=("D", "S"), **more):
    """The seabed alone, 75 to 82 m away, by some families; no wind: a mirror."""
    surface = {} if wind is None else {"reflection": "statistical", "wind_speed": wind}
    order = max(len(name) for name in families)
    return nominal(
        surface=surface, seed=seed, field=field, line={"length": 0.5}, track={"window": (0.1, 0.11)},
        paths={"max_reflections": order, "contributions": ["seabed"], "families": list(families), **more},
    )  # fmt: skip


def power(scenario):
    """Mean power of one ping."""
    sound = simulate(scenario, threads=1)
    return np.mean(
        sound["intensity"].values if scenario.field == "incoherent" else np.abs(sound["pressure"].values) ** 2
    )


def boxes(surface, families, seed=1):
    """Five pings, half a second apart, of the nominal box on its bed, from a sonar that stays."""
    return nominal(
        box={}, surface=surface, seed=seed, paths={"max_reflections": 1, "families": families},
        track={"window": (0.199, 0.206), "pings": 5, "interval": 0.5},
    )  # fmt: skip


def likeness(recording, first, last):
    """Mean correlation of the complex echoes of different pings between two times, in magnitude."""
    time, sound = recording["time"].values, recording["pressure"].values[:, 0]
    part = sound[:, (time >= first) & (time < last)]
    part /= np.linalg.norm(part, axis=1, keepdims=True)
    together = part.conj() @ part.T
    return float(np.abs(together[np.triu_indices(len(part), 1)].mean()))


def test_ghosts_change_from_ping_to_ping_and_the_target_does_not():
    """Figure 7: in the windows of ab and bb pings lose their likeness; in that of aa, before any surface path, never.

    Of 10 pairs of 5 pings, each of about 5 cells: chance leaves 0.14. Without surface paths all of it stays > 0.95.
    """
    moving = simulate(boxes(WINDY, ["D", "S"]))
    still = simulate(boxes(WINDY, ["D"]))
    windows = {"aa": (0.2, 0.2017), "ab": (0.2023, 0.2034), "bb": (0.2042, 0.2053)}
    assert likeness(moving, *windows["aa"]) > 0.95
    assert likeness(moving, *windows["ab"]) < 0.3
    assert likeness(moving, *windows["bb"]) < 0.3
    for window in windows.values():
        assert likeness(still, *window) > 0.95


def test_a_tilting_plane_turns_the_ghosts_too():
    """The paper's plane: echoes with a surface bounce differ from ping to ping, direct ones do not."""
    found = [arrivals(boxes(TILTED, ["D", "S"]), ping) for ping in (0, 3)]
    for family, same in (("D", True), ("S", False)):
        rows = [one.take((one.transmit_family == family) & (one.receive_family == family)) for one in found]
        assert np.array_equal(rows[0].delay, rows[1].delay) == same


@pytest.mark.parametrize(("wind", "memory"), [(0.5, 0.87), (5.0, 0.0)])
def test_a_rough_sea_returns_what_a_mirror_would(wind, memory):
    """D-S echoes of the bed, in wide beams: the mirror's energy within 1 dB, less what reciprocity no longer gives.

    A mirror gives 4 |A|^2 of the two orders of a pair, a sea 2 |A|^2 (1 + E[rho_out rho_back*]).
    """
    whole = {"families": ["D", "S"], "contributions": ["seabed"], "max_reflections": 1}

    def mean(surface):
        scenario = nominal(surface=surface, line={"length": 0.05}, paths=whole, track={"window": (0.1, 0.102)})
        return 10 * np.log10(
            np.mean(10 ** (levels(scenario).level_db.sel(contribution="seabed", pair="D-S").values / 10))
        )

    loss = mean({"reflection": "statistical", "wind_speed": wind}) - mean({})
    assert loss == pytest.approx(10 * np.log10((1 + memory) / 2), abs=1.0)


@pytest.mark.validate
def test_one_scatterer_repeats_in_the_mean():
    """Mean |echo|^2 of a point target over 300 seas = the incoherent reading's mean over 60, both by D and S.

    Error 0.1 dB; at 0.6 m/s nearly half of the surface leg's power is in glints.
    """

    def echo(field, seed):
        return nominal(
            targets=[point(0.0, 75.0, 19.5)], surface={"reflection": "statistical", "wind_speed": 0.6}, seed=seed,
            field=field, line={"length": 0.05}, track={"window": (0.1, 0.106)},
            paths={"max_reflections": 1, "contributions": ["target"], "families": ["D", "S"]},
        )  # fmt: skip

    coherent = each_ping([echo("coherent", seed) for seed in range(300)], power)
    incoherent = each_ping([echo("incoherent", seed) for seed in range(60)], power)
    assert 10 * np.log10(coherent.mean() / incoherent.mean()) == pytest.approx(0.0, abs=0.3)


@pytest.mark.validate
@pytest.mark.parametrize(
    ("wind", "families"), [(1.0, ("S",)), (0.3, ("D", "S")), (0.6, ("D", "S")), (3.0, ("D", "S")), (0.6, ("S", "BS"))]
)
def test_the_mean_of_coherent_pings_is_the_incoherent_reading(wind, families):
    """<|coherent|^2> = incoherent within 0.25 dB: 60 seeds of about 50 cells (0.08 dB) against 12 (0.04 dB)."""
    coherent = each_ping([bed("coherent", wind, seed, families) for seed in range(60)], power)
    incoherent = each_ping([bed("incoherent", wind, seed, families) for seed in range(12)], power)
    assert 10 * np.log10(coherent.mean() / incoherent.mean()) == pytest.approx(0.0, abs=0.25)


def test_a_calm_is_a_mirror():
    """Under a wind of 1 cm/s recordings are those of a mirror: sample by sample, and the expectation in the mean."""
    calm, mirror = (simulate(bed("coherent", wind))["pressure"].values for wind in (0.01, None))
    assert relative_rms(calm, mirror) < 2e-3
    assert power(bed("incoherent", 0.01)) == pytest.approx(power(bed("incoherent", None)), rel=0.02)


@pytest.mark.parametrize("surface", [WINDY, TILTED])
def test_a_scene_turned_and_moved_as_a_whole_sounds_the_same(surface):
    """Scene, waves, sonar and lattice turned by 70 degrees and moved by kilometres: the same recording."""
    turn, shift = np.radians(70.0), np.array([1500.0, -800.0])

    def received(angle, move):
        c, s = np.cos(angle), np.sin(angle)
        north, east = np.array([[c, -s], [s, c]]) @ [3.0, 75.0] + move
        return simulate(
            nominal(
                targets=[point(north, east, 19.5)],
                surface={**surface, "wave_direction": 0.4 + angle},
                seabed={"scatterer_grid": {"origin": tuple(move), "heading": angle}},
                line={"length": 0.5},
                paths={"max_reflections": 2},
                track={"position": (*move, 11.0), "heading": angle, "window": (0.1, 0.106)},
            )
        )["pressure"].values

    assert relative_rms(received(turn, shift), received(0.0, np.zeros(2))) < 1e-4


def test_a_moving_surface_sounds_the_same_on_any_number_of_cores():
    """Bit for bit, and from ping to ping in any order."""
    scenario = boxes(WINDY, ["D", "S"])
    together = simulate(scenario, pings=[4, 1], threads=2)["pressure"].values
    alone = simulate(scenario, pings=[1], threads=1)["pressure"].values
    np.testing.assert_array_equal(together[1], alone[0])


def test_time_not_the_number_of_the_ping_moves_the_sea():
    """Ping 2 at intervals of 1 s receives what ping 4 at 0.5 s receives."""

    def track(interval):
        return {"window": (0.199, 0.206), "pings": 6, "interval": interval}

    slow, fast = (nominal(box={}, surface=WINDY, paths={"max_reflections": 1}, track=track(dt)) for dt in (1.0, 0.5))
    one, other = simulate(slow, pings=[2])["pressure"].values, simulate(fast, pings=[4])["pressure"].values
    np.testing.assert_array_equal(one, other)
