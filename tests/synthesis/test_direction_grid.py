"""Many beams from a grid of directions: what they are one by one, at the cost of none of them."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.explanation.sample_report import SampleArrivals
from insonify.processing.beamforming import beamform_delay_sum
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator, labels, simulate, simulate_pings
from insonify.sonar import band_error
from insonify.sonar.array import LineArray
from insonify.sonar.beam import beams
from insonify.sonar.hydrophones import element_layout
from insonify.sonar.ping_geometry import MountedSonar
from insonify.sonar.shared_directions import MIN_BEAMS
from insonify.synthesis import coherent, label_accumulator
from insonify.synthesis._beam_spectra_kernel import AperturePoints, form_beams
from insonify.synthesis._direction_grid_kernel import combine_rows
from insonify.synthesis._gridding_kernel import WIDTH, tap_coefficients
from insonify.synthesis.direction_grid import direction_grid
from oracles.scenes import SCATTERED

BEAMS = tuple(np.radians(np.linspace(-60, 60, 31)))
WIDE = {"kind": "planar", "width": 0.8e-3, "height": 5e-3, "steer": (0.0,)}
LINE = {"kind": "line", "length": 0.01, "elements": 12, "steer": BEAMS}
STILL = {"kind": "static", "position": (0.0, 0.0, 3.0), "window": (4e-3, 6e-3)}
ROLLING = {
    "kind": "line", "start": (0, 0, 3.0), "speed": 2.0, "pings": 1, "interval": 0.1, "window": (4e-3, 6e-3),
    "motion": {"roll": {"rms": 0.15, "period": 1.0}},
}  # fmt: skip
THERMOCLINE = {"profile": [[0, 1520], [2, 1515], [5, 1490]], "smoothing": 0.5, "noise_level_db": None}
WORLDS = {
    "still": {},
    "moving": {"track": {k: v for k, v in ROLLING.items() if k != "motion"}},
    "rolling": {"track": ROLLING},
    "layered": {"water": THERMOCLINE},
    "sub-bands": {"receiver": {"bandwidth": 60e3, "sub_bands": 8}},
    "shaken": {"paths": {"jitter": 0.3, "amplitude_perturbation": 0.2}},
}


def imaging(*, transmit=WIDE, receive=LINE, receiver=None, paths=None, **top):
    """A 900 kHz imaging sonar 2 m above a bed, its beams spread over 120 deg."""
    return Scenario(**{
        "water": {"noise_level_db": None},
        "seabed": {"depth": 5.0, "scattering": {"law": "lambert", "strength_db": -27.0}},
        "sonar": {
            "source_level_db": 200,
            "pulse": {"kind": "lfm", "frequency": 900e3, "bandwidth": 50e3, "duration": 0.2e-3},
            "transmit": transmit,
            "receive": receive,
            "receiver": receiver or {"bandwidth": 60e3, "sub_bands": 1},
            "mounting": {"bearing": 0.0, "tilt": 0.3},
        },
        "track": STILL,
        "paths": {"max_reflections": 1, "edge_diffraction": "none", "scatterers_per_cell": 2.0,
                  "contributions": SCATTERED, **(paths or {})},
        **top,
    })  # fmt: skip


def one_by_one(scenario, monkeypatch):
    """The first ping by the grid of directions, and beam by beam."""
    assert direction_grid(build_simulator(scenario).ping_geometry(0)) is not None
    by_grid = simulate(scenario, pings=[0], threads=1).pressure.values[0]
    with monkeypatch.context() as patched:
        separate_beams(patched)
        return by_grid, simulate(scenario, pings=[0], threads=1).pressure.values[0]


def separate_beams(patched):
    """Form beams one by one, all of their patterns at so many frequencies that interpolation is as good."""
    patched.setattr(band_error, "MAX_SHARED_ERROR_DB", -100.0)
    patched.setattr(coherent, "direction_grid", lambda _: None)
    at = MountedSonar.at

    def interpolated(mounted, ping):
        geometry = at(mounted, ping)
        return replace(geometry, sub_bands=geometry.interpolated_bands)

    patched.setattr(MountedSonar, "at", interpolated)


def off_db(one, other):
    """Rms difference re rms, and the worst channel's re its own [dB]."""
    lost, whole = (np.linalg.norm(series, axis=-1) for series in (one - other, other))
    worst = np.linalg.norm(lost) / np.linalg.norm(whole), (lost / whole).max()
    return tuple(20 * np.log10(np.maximum(worst, 1e-12)))  # equal series are -240 dB apart


@pytest.mark.parametrize("world", list(WORLDS))
def test_beams_of_a_grid_are_those_made_one_by_one(world, monkeypatch):
    """One transmit beam, 31 receive beams, 4 pairs of legs: the same sound, to -100 dB in every beam.

    Beyond the band that holds all but 1e-4 of the pulse's energy patterns of separate beams stay as they are at its
    edge, which leaves -85 dB of a sweep.
    """
    assert max(off_db(*one_by_one(imaging(**WORLDS[world]), monkeypatch))) < (-85 if world == "sub-bands" else -100)


def test_few_frequencies_serve_what_beams_have_in_common(monkeypatch):
    """A third of an octave: horizontal patterns of every frequency, four for the rest, against 20 or more of each beam.

    The sound is the same to -40 dB, where one frequency for the band is 7 dB off; an explanation's arrivals, which take
    beams at fewer frequencies, add up to a sample within a hundredth of the rms.
    """
    sweep = {"kind": "lfm", "frequency": 900e3, "bandwidth": 250e3, "duration": 0.1e-3}
    wide, carrier = (
        imaging(receiver={"bandwidth": 300e3, "sub_bands": count}).with_("sonar.pulse", sweep) for count in ("auto", 1)
    )
    ping_geometry, recorded = build_simulator(wide).ping_geometry(0), simulate(wide)
    assert len(ping_geometry.sub_bands) == 4 and len(ping_geometry.interpolated_bands) > 10
    sound = recorded.pressure.values[0]
    rms = np.sqrt(np.mean(np.abs(sound[10]) ** 2))
    for row in (60, 200, 350):
        behind = SampleArrivals(wide, 0, float(recorded.time[row]), 10)
        assert abs(behind.pressure.sum() - sound[10, row]) < 1e-2 * rms
    separate_beams(monkeypatch)
    alone = simulate(wide).pressure.values[0]
    assert off_db(sound, alone)[0] < -40 and off_db(simulate(carrier).pressure.values[0], alone)[0] > -12


def test_short_arrays_over_a_narrow_band_have_the_sub_bands_that_are_requested(monkeypatch):
    """Three elements, 1.5 kHz of band: their horizontal patterns are those of one frequency, and two are deposited."""
    short = {"kind": "line", "length": 2.5e-3, "elements": 3, "steer": BEAMS}
    pulse = {"kind": "cw", "frequency": 900e3, "duration": 5e-3}
    scene = imaging(receive=short, receiver={"bandwidth": 1.5e3, "sub_bands": 2}).with_("sonar.pulse", pulse)
    assert len(build_simulator(scene).ping_geometry(0).interpolated_bands) == 2
    assert max(off_db(*one_by_one(scene.with_("track.window", [4e-3, 9e-3]), monkeypatch))) < -80


def test_pistons_over_a_wide_band_are_as_good(monkeypatch):
    """Elements 0.8 wavelengths wide, 60 degrees off, a third of an octave: every beam to -40 dB."""
    pistons = {"kind": "line", "length": 0.016, "elements": 12, "element": "piston", "steer": BEAMS}
    sweep = {"kind": "lfm", "frequency": 900e3, "bandwidth": 250e3, "duration": 0.1e-3}
    scene = imaging(receive=pistons, receiver={"bandwidth": 300e3}).with_("sonar.pulse", sweep)
    assert max(off_db(*one_by_one(scene, monkeypatch))) < -40


def test_transmit_beams_may_be_steered_with_the_receive_beams(monkeypatch):
    """A wide transmitter steered along: direct paths to -100 dB; with unlike legs -40 dB of all, -35 dB in any beam."""
    ends = {"transmit": {**WIDE, "steer": None}, "receive": {**LINE, "length": 0.0267, "elements": 32}}
    assert max(off_db(*one_by_one(imaging(**ends, paths={"max_reflections": 0}), monkeypatch))) < -100
    whole, worst = off_db(*one_by_one(imaging(**ends), monkeypatch))
    assert whole < -40 and worst < -35


def kernel_at(distance):
    """Gridding kernel at a distance from a row [rows], by its polynomials."""
    taps, cell = tap_coefficients().astype(float), -np.floor(distance + 0.5).astype(np.int64)
    number, y = cell + (WIDTH - 1) // 2, distance + cell
    inside = (number >= 0) & (number < WIDTH)
    values = np.polynomial.polynomial.polyval(y, taps[:, np.where(inside, number, 0)], tensor=False)
    return np.where(inside, values, 0.0)


ARRAYS = {
    "a line": LineArray(length=0.01, steer=BEAMS),
    "elements": LineArray(length=0.01, elements=12, steer=BEAMS),
    "an odd number of elements": LineArray(length=0.01, elements=11, steer=BEAMS),
    "shaded elements": LineArray(length=0.0267, elements=32, shading="taylor", steer=BEAMS),
}


@pytest.mark.parametrize("name", list(ARRAYS))
def test_patterns_of_all_beams_come_back_with_their_side_lobes(name):
    """A point at 300 directions in turn, taken through the rows, at the carrier and 3 % above and below it.

    The gain of 31 beams is within 3e-6 of their axes', as from their patterns at each of these frequencies.
    """
    array, speed = ARRAYS[name], 1500.0
    scene = imaging(receive=array.model_dump(exclude={"offset"}), receiver={"bandwidth": 60e3})
    fan = direction_grid(build_simulator(scene).ping_geometry(0))
    across = np.random.default_rng(1).uniform(-0.99, 0.99, 300)
    first, step = fan.rows[0][:2]
    rows = kernel_at((across[:, None] - first) / step - np.arange(fan.row_count)).T.astype(complex, order="C")
    directions = np.stack([np.sqrt(1 - across**2), across, np.zeros(300)], axis=-1)
    for ratio in (0.97, 1.0, 1.03):
        found = np.zeros((len(BEAMS), 300), complex)
        form_beams(rows, fan.row_cosines, step, fan.steer, fan.points, ratio, 0.0, found)
        expected = replace(beams(array, ratio * 900e3, speed), element=0).gain(directions)
        np.testing.assert_allclose(found, expected, atol=3e-6)
        if ratio == 1.0:
            np.testing.assert_allclose(fan.row_weights @ rows, fan.scale[0][:, None] * found, atol=1e-6)


def test_phasors_advance_from_frequency_to_frequency():
    """Random rows at 150 frequencies: the same beams as with the sums of phasors of each frequency written out."""
    random, ratio, increment = np.random.default_rng(5), 0.9, 1.5e-3
    rows = random.normal(size=(9, 150)) + 1j * random.normal(size=(9, 150))
    row_cosine, steer = np.linspace(-0.8, 0.8, 9), np.array([-0.5, 0.0, 0.3])
    position, weight = np.array([0.0, 1.5, 4.0]), np.array([0.2, 0.5, 0.3])
    for column in (position, weight):  # those of a fan are, and the same machine code serves both
        column.setflags(write=False)
    found = np.zeros((3, 150), complex)
    form_beams(rows, row_cosine, 0.2, steer, AperturePoints(position, weight, np.array([1.0, 0.5])), ratio, increment,
               found)  # fmt: skip
    at = ratio + increment * np.arange(150)
    turns = at[:, None, None, None] * position * (row_cosine[:, None] - steer[:, None, None])  # frequency, beam, row
    response = 1 + 0.5 * (at[:, None] * position * 0.2) ** 2
    expected = np.einsum("fbrj,fj,j,rf->bf", np.cos(2 * np.pi * turns), response, weight, rows)
    np.testing.assert_allclose(found, expected, atol=1e-10)


def test_elements_summed_with_delays_are_the_beams_of_the_grid():
    """Three points 8 m off, 64 elements, nine sub-bands: beams formed afterwards are within -40 dB of the peak."""
    targets = [
        {"shape": "point", "label": f"{n}", "position": place, "target_strength_db": -30}
        for n, place in enumerate([(8.0, 0.6, 4.0), (5.0, 6.0, 3.5), (6.5, -5.0, 3.0)])
    ]
    line, paths = (
        {"kind": "line", "length": 0.0533, "elements": 64},
        {"contributions": ["target"], "max_reflections": 0},
    )
    common = {"targets": targets, "paths": paths, "track": {**STILL, "window": (9e-3, 12e-3)}}
    every = tuple(np.radians(np.arange(-60, 61, 2.0)))
    bands = {"bandwidth": 60e3, "sub_bands": 9}
    recorded_beams = simulate(imaging(receive={**line, "steer": every}, receiver=bands, **common)).pressure.values[0]
    recorded = imaging(receive=line, receiver={**bands, "record": "elements"}, **common)
    sound = simulate(recorded)
    look = np.stack([np.cos(every), np.sin(every), np.zeros(len(every))], axis=-1)
    formed = beamform_delay_sum(sound.pressure.values[0], element_layout(recorded.sonar.receive)[0], sound.time.values,
                                look, centre_frequency=900e3)  # fmt: skip
    inside = slice(10, -10)
    assert np.abs(formed - recorded_beams)[:, inside].max() < 1e-2 * np.abs(recorded_beams).max()


def test_beams_that_share_too_little_are_made_one_by_one():
    """Few beams, a narrow transmitter steered along, recorded elements: no grid; many beams of a wide one: a grid."""
    few = {**LINE, "steer": BEAMS[: MIN_BEAMS - 1]}
    alike = {**LINE, "steer": None}
    for scenario in (imaging(receive=few), imaging(transmit=alike), imaging(receiver={"record": "elements"})):
        assert direction_grid(build_simulator(scenario).ping_geometry(0)) is None
    assert direction_grid(build_simulator(imaging()).ping_geometry(0)).row_count <= 3 * len(BEAMS)


def test_more_beams_lay_no_more_echoes_down():
    """Four times the beams in one sector: as many rows, and the beams that both have are the same to -85 dB."""
    more = {**LINE, "steer": tuple(np.radians(np.linspace(-60, 60, 121)))}
    paths = {"importance_sampling": False, "beam_cutoff_db": -120}
    scenarios = [imaging(receive=one, paths=paths) for one in (LINE, more)]
    counts = {direction_grid(build_simulator(one).ping_geometry(0)).row_count for one in scenarios}
    assert len(counts) == 1
    few, many = (next(iter(simulate_pings(build_simulator(one), [0], 1)))[1] for one in scenarios)
    assert max(off_db(many[::4], few)) < -85


@pytest.mark.parametrize(("order", "world", "rms_db"), [(0, "moving", 0.06), (1, "still", 0.15)])
def test_labels_of_many_beams_are_those_one_by_one(order, world, rms_db, monkeypatch):
    """Past a box, by rows an eighth of a lobe apart: intensities to so many dB rms, masks but for edges.

    Positions to 3 cm, a twentieth of a beam's width.
    """
    crate = {"shape": "box", "label": "crate", "position": (3.0, 0.5), "size": (0.4, 0.4, 0.4)}
    fine = LINE | {"steer": tuple(np.radians(np.linspace(-60, 60, 45)))}
    scene = imaging(receive=fine, paths={"max_reflections": order}, targets=[crate], **WORLDS[world])
    together = labels(scene)
    monkeypatch.setattr(label_accumulator, "direction_powers", lambda *_: None)
    apart = labels(scene)
    strong = apart.expected_intensity.values > 1e-5 * apart.expected_intensity.values.max()
    error = 10 * np.log10(together.expected_intensity.values[strong] / apart.expected_intensity.values[strong])
    assert 0 < np.sqrt(np.mean(error**2)) < rms_db and abs(np.mean(error)) < rms_db / 3
    assert apart.shadow.values.any() and apart.highlight.values.any()
    for name in ("highlight", "shadow", "ghost", "strongest_object"):
        assert np.mean(together[name].values != apart[name].values) < 5e-3, name
    away = np.linalg.norm(together.position.values - apart.position.values, axis=-1)
    assert np.nanpercentile(away, 95) < 0.03


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("count", [1, 7, 8, 20])
def test_empty_parts_are_left_out_of_the_product(count, kind):
    """Weighted sums of rows are the matrix product, for any number of beams and wherever rows are empty."""
    random = np.random.default_rng(3)
    rows, weights = random.normal(size=(13, 900)).astype(kind), random.random((count, 13)).astype(np.float32)
    rows[4:9, :600] = rows[:, 256:512] = rows[12] = 0
    rows[2, :899] = 0  # its last column, beyond whole tiles
    sums = np.full((count, 900), np.nan, np.float32)
    combine_rows(rows, weights, sums)
    np.testing.assert_allclose(sums, weights.astype(float) @ rows, atol=2e-6)
