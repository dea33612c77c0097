"""Sampling of wide fields at high resolution: by the area of a resolution cell, not by the least of its sides."""

import numpy as np
import pytest

from insonify.scenario.scenario import Scenario
from insonify.scene.scatterer_grid import FINEST_SCALE
from insonify.scene.scatterers import grid_scatterer_id
from insonify.simulator import build_simulator, simulate
from insonify.sonar.pulse import Pulse
from insonify.sonar.received_pulse import receive_pulse
from insonify.sonar.receiver import Receiver


def imaging(
    *,
    bandwidth=100e3,
    band=None,
    per_cell=5.0,
    stop=5e-3,
    targets=(),
    field="coherent",
    seed=1,
    contributions=("seabed", "target"),
    **sonar,
):
    """A 900 kHz imaging sonar 1.5 m above a seabed: 64 elements half a wavelength apart, transmitting over 130 deg."""
    return Scenario(
        field=field,
        seed=seed,
        water={"noise_level_db": None},
        seabed={"depth": 5.0, "scattering": {"law": "lambert", "strength_db": -27.0}},
        sonar={
            "source_level_db": 200,
            "pulse": {"kind": "lfm", "frequency": 900e3, "bandwidth": bandwidth, "duration": 0.2e-3},
            "transmit": {"kind": "planar", "width": 0.8e-3, "height": 5e-3},
            "receive": {"kind": "line", "length": 0.0533, "elements": 64},
            "receiver": {"bandwidth": 1.2 * bandwidth if band is None else band, "record": "elements"},
            "mounting": {"bearing": 0.0, "tilt": 0.35},
            **sonar,
        },
        targets=list(targets),
        track={"kind": "static", "position": (0.0, 0.0, 3.5), "window": (0.0, stop)},
        paths={
            "max_reflections": 0,
            "edge_diffraction": "none",
            "scatterers_per_cell": per_cell,
            "contributions": contributions,
        },
    )


def drawn(scenario):
    """Positions and areas of all scatterers of the first ping, and its ping_geometry."""
    simulator = build_simulator(scenario)
    found = [block() for block in simulator.engine.blocks(simulator.ping_geometry(0))]
    return (
        np.concatenate([f.position for f in found]),
        np.concatenate([f.area for f in found]),
        simulator.ping_geometry(0),
    )


@pytest.mark.parametrize(("bandwidth", "per_cell"), [(300e3, 5.0), (30e3, 60.0)])
def test_cells_finer_than_a_centimetre_have_their_scatterers(bandwidth, per_cell):
    """2 m ahead, where each represents less than 1 cm^2: as many in a cell as requested, up to a fifth more."""
    place, area, here = drawn(imaging(bandwidth=bandwidth, per_cell=per_cell, stop=3.6e-3))
    far, slant = np.hypot(place[:, 0], place[:, 1]), np.linalg.norm(place - here.transmit_position, axis=1)
    ahead = (np.abs(np.arctan2(place[:, 1], place[:, 0])) < 0.5) & (far > 2.0) & (far < 2.2)
    cell = 1500 / 2 / bandwidth * slant / far * slant * 0.886 / 32
    count = (cell / area)[ahead]
    assert area[ahead].max() < 1e-4
    assert count.min() >= 0.99 * per_cell and np.median(count) < 1.2 * per_cell
    ground = area[ahead].sum() / (0.5 * (2.2**2 - 2.0**2))
    assert ground == pytest.approx(1, abs=0.01)


def test_a_wide_field_has_as_many_scatterers_as_its_resolution_cells_request():
    """300 kHz of band over the front half: 5 for each range cell and width of the array, a third more at most."""
    place, _, here = drawn(imaging(bandwidth=300e3, stop=8e-3))
    slant = np.linalg.norm(place - here.transmit_position, axis=1)
    rows = (slant > 3) & (slant < 5.5)
    cells = (5.5 - 3) / (1500 / 2 / 300e3) * np.pi / (0.886 / 32)
    assert 0.9 * 5 * cells < rows.sum() < 1.35 * 5 * cells


def test_the_band_of_the_receiver_limits_what_can_be_resolved():
    """A sweep of 300 kHz through a filter of 20 kHz: a range cell of 1 / 25 kHz at the finest; in full, 1 / 300 kHz."""
    pulse = Pulse(kind="lfm", frequency=900e3, bandwidth=300e3, duration=0.2e-3)
    narrow, wide = (receive_pulse(pulse, Receiver(bandwidth=band)).finest_resolution(1500.0) for band in (20e3, 360e3))
    assert wide == pytest.approx(1500 / 2 / 300e3)
    assert narrow == pytest.approx(1500 / 2 / 25e3)


def test_keys_of_small_cells_are_their_own():
    """All levels from the finest to 15, cells near and far: no two keys alike, none of another stream."""
    level, along, across = (
        part.ravel() for part in np.meshgrid(np.arange(FINEST_SCALE, 16), [-9, 0, 70000], [-70000, 0, 5])
    )
    keys = np.concatenate([grid_scatterer_id(stream, level, along, across) for stream in (0, 1, 3)])
    assert len(np.unique(keys)) == 3 * level.size
    assert set((grid_scatterer_id(3, level, along, across) >> np.uint64(59)).tolist()) == {3}


BLOCKS = [
    {"shape": "box", "position": (3.5, 0.3), "size": (0.5, 1.0, 0.7), "heading": 0.3},
    {"shape": "cylinder", "position": (3.5, -1.0), "length": 1.0, "diameter": 0.4, "heading": 1.2},
]


def on_targets(scenario):
    """Position, normal and area of all points of each target at the first ping, by label; the sonar's position."""
    simulator, found = build_simulator(scenario), {}
    here = simulator.ping_geometry(0)
    for block in (block() for block in simulator.engine.blocks(here)):
        if block.boundary == "target":
            found.setdefault(block.object, []).append(np.c_[block.position, block.normal, block.area])
    return {label: np.concatenate(parts) for label, parts in found.items()}, here.transmit_position


def test_bodies_have_the_points_that_fill_resolution_cells():
    """Two bodies at 3.5 m: each point represents a fifth of 2.5 mm by 9 cm at its nearest, at most 15 % less.

    Of bodies with so many points only those towards the sonar are kept: front, side and top of the box are whole, and
    of the cylinder, half of its round and of its ends in sight, nine tenths. None past the window.
    """
    found, here = on_targets(imaging(bandwidth=300e3, stop=6e-3, targets=BLOCKS))
    assert set(found) == {"box", "cylinder"}
    for points in found.values():
        nearest = np.linalg.norm(points[:, :3] - here, axis=1).min()
        cell = 1500 / 2 / 300e3 * nearest * 0.886 / 32
        assert 0.85 * cell / 5 < points[:, 6].min() and points[:, 6].max() <= cell / 5
        assert (np.sum((here - points[:, :3]) * points[:, 3:6], axis=1) > 0).mean() > 0.98
    assert found["box"][:, 6].sum() == pytest.approx(1.0 * 0.7 + 0.5 * 0.7 + 0.5 * 1.0, rel=1e-9)
    assert found["cylinder"][:, 6].sum() == pytest.approx(np.pi / 2 * 0.4, rel=0.1)
    far = {**BLOCKS[0], "position": (12.0, 0.0)}
    assert not on_targets(imaging(bandwidth=300e3, stop=6e-3, targets=[far]))[0]


def test_fewer_points_on_a_body_return_the_same_energy():
    """Direct echoes of a box in 11 beams, 17 k points for 880 k, 6 draws of 0.4 dB of spread: expected to 0.5 dB."""
    beams = {"kind": "line", "length": 0.0533, "elements": 64, "steer": tuple(np.radians(np.arange(-20, 21, 4)))}

    def energy(field, seed):
        scenario = imaging(
            bandwidth=50e3, stop=6e-3, targets=BLOCKS[:1], field=field, seed=seed, receiver={"bandwidth": 60e3},
                       receive=beams, contributions=("target",))  # fmt: skip
        series = simulate(scenario, threads=1)
        return float(np.sum(series.intensity if field == "incoherent" else np.abs(series.pressure.values) ** 2))

    drawn_mean = np.mean([energy("coherent", seed) for seed in range(6)])
    assert 10 * np.log10(drawn_mean / energy("incoherent", 0)) == pytest.approx(0, abs=0.4)


def test_speckle_of_a_wide_and_fine_sonar_is_rayleigh():
    """9 beams over 120 deg, some 5000 cells 40 times as wide as long: expected mean to 0.2 dB, index 2.0 to 0.15."""
    beams = {"kind": "line", "length": 0.0533, "elements": 64, "steer": tuple(np.radians(np.arange(-60, 61, 15)))}
    receiver = {"bandwidth": 220e3, "matched_filter": True}
    common = {"bandwidth": 200e3, "stop": 7e-3, "receive": beams, "receiver": receiver}
    drawn_series, expected = (
        simulate(imaging(field=field, **common), threads=1) for field in ("coherent", "incoherent")
    )
    late = drawn_series.time.values > 4e-3
    power = np.abs(drawn_series.pressure.values[0][:, late]) ** 2 / expected.intensity.values[0][:, late]
    assert 10 * np.log10(power.mean()) == pytest.approx(0, abs=0.2)
    assert np.mean(power**2) / np.mean(power) ** 2 == pytest.approx(2, abs=0.15)
