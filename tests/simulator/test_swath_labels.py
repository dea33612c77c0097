"""Labels of uneven ground come from the very points that are recorded, and state what the general path states."""

from dataclasses import fields, replace

import numpy as np
import pytest

from insonify.engines.fast_reverberation._origin_kernel import grazing_angles
from insonify.engines.parts import SerialPool
from insonify.records.labels import NO_ROW, Labels, MaskLabels, label_dataset
from insonify.scenario.scenario import Scenario
from insonify.simulator import Job, _labels, _sums, build_simulator, label_ping, simulate, simulate_job
from oracles.scenes import SCATTERED

CRATE = {"shape": "box", "label": "crate", "position": [0.0, 20.0], "size": [4.0, 2.0, 1.5]}
ROUGH = {"kind": "power-law", "hurst": 0.8, "rms": "14 cm"}
BED = {
    "depth": 10.0, "scattering": {"law": "lambert", "strength_db": -27}, "relief": {**ROUGH, "rms": "5 cm"},
}  # fmt: skip
PANEL = {"kind": "planar", "width": 0.3, "height": 0.02}


def made(order=0, **changes):
    """A sidescan 4 m deep over a bed at 10 m with 5 cm of relief; no noise."""
    whole = {
        "seed": 3, "field": "incoherent", "water": {"noise_level_db": None}, "surface": {"scattering": None},
        "seabed": BED,
        "sonar": {"source_level_db": 220, "pulse": {"kind": "cw", "frequency": "100 kHz", "duration": "0.2 ms"},
                  "transmit": PANEL, "receive": PANEL, "mounting": {"bearing": "90 deg", "tilt": "20 deg"}},
        "track": {"kind": "line", "start": [0.0, 0.0, 4.0], "heading": 0.0, "speed": "2 m/s", "pings": 2,
                  "interval": 0.1, "window": [0.0, "50 ms"]},
        "paths": {"max_reflections": order, "edge_diffraction": "none", "contributions": SCATTERED}, **changes,
    }  # fmt: skip
    return Scenario.model_validate(whole)


def by_blocks(scenario, per_cell=8.0):
    """Labels of the first ping by the general path, from many points."""
    simulator = build_simulator(scenario)
    paths = simulator.engine.path_settings.unchecked_copy(scatterers_per_cell=per_cell)
    dense = replace(simulator, engine=replace(simulator.engine, path_settings=paths),
                    scenario=scenario.model_copy(update={"paths": paths}))  # fmt: skip
    reading = dense.label_accumulator(dense.ping_geometry(0))
    return reading.time_series(_sums(dense, reading, dense.ping_geometry(0), SerialPool(), None))


@pytest.mark.parametrize("order", [0, 2])
def test_labels_hold_the_expectation_that_is_recorded(order):
    """With targets and without, direct paths or nine pairs: the labels' sum is the recording, to float64."""
    for targets in ([], [CRATE]):
        scenario = made(order, targets=targets)
        expected = label_ping(build_simulator(scenario), 0).object_intensity[:, 0]
        recorded = simulate(scenario, pings=0).intensity.values[0]
        if not targets:
            np.testing.assert_allclose(expected, recorded, rtol=1e-12)
        else:
            assert (expected <= recorded + 1e-9 * recorded.max()).all()


AFLOAT = {"label": "buoy", "shape": "point", "position": [0, 30, 6], "target_strength_db": -10}


@pytest.mark.parametrize(
    ("targets", "echoes", "bits_shared"),
    [([CRATE], (), False), ([], (), True), ([], ("boundary echo",), True), ([AFLOAT], ("boundary echo",), False)],
    ids=["past a target", "the seabed alone", "with boundary echoes", "with boundary echoes and a point"],
)
def test_the_sound_is_the_same_with_labels_and_without(targets, echoes, bits_shared):
    """One ping with labels and one without: bit by bit, taken over from the labels or not."""
    paths = {"max_reflections": 2, "edge_diffraction": "none", "contributions": ("seabed", "target", *echoes)}
    simulator = build_simulator(made(2, targets=targets, paths=paths))
    _, known = _labels(simulator, simulator.ping_geometries(1), SerialPool())
    assert [one.is_all for _, one in known] == [bits_shared] * len(known)
    if echoes and not targets:
        (_, own), alone = known[0], ground_alone(simulator)
        assert np.any(own.energies.cells != alone.cells) or np.any(own.energies.intensity != alone.intensity)
    alone, _ = simulate_job(simulator, Job(1, with_series=True, with_labels=False), SerialPool())
    beside, labels = simulate_job(simulator, Job(1, with_series=True, with_labels=True), SerialPool())
    assert labels is not None
    np.testing.assert_array_equal(alone, beside)


@pytest.mark.parametrize(
    ("order", "edges", "field"),
    [
        (0, "none", "incoherent"),
        (0, "knife-edge", "incoherent"),
        (2, "knife-edge", "incoherent"),
        (1, "none", "coherent"),
    ],
)
def test_masks_and_intensities_are_the_same_without_positions(order, edges, field):
    """A target over relief: each variable that both kinds of labels have, bit for bit; masks are not empty."""
    paths = {"max_reflections": order, "edge_diffraction": edges, "contributions": SCATTERED}
    simulator = build_simulator(made(order, targets=[CRATE], paths=paths, field=field))
    masks, _ = _labels(replace(simulator, with_positions=False), simulator.ping_geometries(0), SerialPool())
    whole = label_ping(simulator, 0, threads=1)
    assert type(masks) is MaskLabels and isinstance(whole, Labels)
    assert masks.highlight.any() and masks.shadow.any() and masks.shadowing_object.min() < NO_ROW
    for column in fields(MaskLabels):
        np.testing.assert_array_equal(getattr(masks, column.name), getattr(whole, column.name), err_msg=column.name)
    dataset = label_dataset([masks], simulator.label_names, simulator.grid.time, np.array([0]))
    assert set(dataset.data_vars) == {column.name for column in fields(MaskLabels)}


def ground_alone(simulator):
    """Energies of the seabed in the labels of one side of ping 1."""
    side = simulator.ping_geometry(1)
    accumulator = simulator.label_accumulator(side)
    sums = _sums(simulator, accumulator, side, SerialPool(), simulator.label_reverberation(side))
    return sums.curves["seabed", "all"]


@pytest.mark.parametrize("edges", ["none", "knife-edge"])
def test_masks_and_places_are_those_of_the_general_path(edges):
    """Ridges and a crate that cast shadows: masks agree in 98 % of samples, places to 2 cm in the median."""
    scenario = made(
        targets=[CRATE], paths={"max_reflections": 0, "edge_diffraction": edges}, seabed={**BED, "relief": ROUGH}
    )
    simulator = build_simulator(scenario)
    assert simulator.label_reverberation(simulator.ping_geometry(0)) is not None
    quick, general = label_ping(simulator, 0), by_blocks(scenario)
    for name in ("highlight", "shadow", "ghost", "shadowing_object", "strongest_object", "strongest_pair"):
        assert np.mean(getattr(quick, name) == getattr(general, name)) > 0.98, name
    assert 0.05 < quick.shadow.mean() < 0.6
    assert len(np.unique(quick.shadowing_object)) == 3  # the seabed, the crate, none
    off = np.linalg.norm(quick.position - general.position, axis=-1)
    assert np.nanmedian(off) < 0.02 and np.nanquantile(off, 0.9) < 0.15
    bright = ~np.isnan(quick.grazing) & ~np.isnan(general.grazing)
    assert np.median(np.abs(quick.grazing - general.grazing)[bright]) < 0.01
    assert np.nanmedian(np.abs(quick.distance - general.distance)) < 0.01


def test_a_coherent_recording_has_labels_of_fewer_points():
    """Past a crate: 0.3 dB rms and 0.02 dB in the mean from the incoherent recording's labels, masks in 99 %."""
    one, other = (
        label_ping(build_simulator(made(0, targets=[CRATE], field=field)), 0) for field in ("coherent", "incoherent")
    )
    strong = other.expected_intensity > 1e-3 * other.expected_intensity.max()
    ratio = 10 * np.log10(one.expected_intensity[strong] / other.expected_intensity[strong])
    assert np.sqrt(np.mean(ratio**2)) < 0.3 and abs(ratio.mean()) < 0.02
    for name in ("highlight", "shadow", "shadowing_object", "strongest_object"):
        assert np.mean(getattr(one, name) == getattr(other, name)) > 0.99, name


def test_pairs_share_out_what_does_not_interfere():
    """Nine pairs over relief: pairs sum to the expectation where their delays are far apart; D-D is a direct run's."""
    both, direct = (label_ping(build_simulator(made(order)), 0) for order in (2, 0))
    whole = both.expected_intensity > 1e-4 * both.expected_intensity.max()
    ratio = 10 * np.log10(both.pair_intensity.sum(axis=1)[whole] / both.expected_intensity[whole])
    assert abs(np.mean(ratio)) < 0.1
    straight = 10 * np.log10(both.pair_intensity[:, 0][whole] / direct.expected_intensity[whole])
    assert abs(np.median(straight)) < 0.1


def test_grazing_angles_are_the_arcsine():
    """Facets that face up, rays from level to steep: to 1e-6 rad of the library's arcsine."""
    sine = np.linspace(0, 1, 1001)
    arrival = np.stack([np.sqrt(1 - sine**2), 0 * sine, sine])[None].astype(np.float32)
    normal = np.stack([0 * sine, 0 * sine, -np.ones_like(sine)]).astype(np.float32)
    grazing = np.empty((1, len(sine)), np.float32)
    grazing_angles(arrival, normal, grazing)
    np.testing.assert_allclose(grazing[0], np.arcsin(arrival[0, 2].astype(float)), atol=1e-6)
