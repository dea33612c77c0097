"""Fast reverberation satisfies laws not built into it: sonar equations pair by pair, scales, windows, densities."""

import numpy as np
import pytest

from engines.test_fast_reverberation import CRATE, GROUND, SIDESCAN, made, quickly, thoroughly
from insonify.simulator import build_simulator
from oracles.few_of import few_of

DEPTH, SONAR, SPEED, WAVE = 10.0, 4.0, 1500.0, 0.015
FLAT = {**SIDESCAN["seabed"], "relief": None, "reflection": 0.35}
LOSSLESS = {"noise_level_db": None, "absorption_db_per_m": 0.0}


def unfolded(family):
    """Depth of the image of the sonar in the mirrors of a family, and what they leave of the energy."""
    depth, left = SONAR, 1.0
    for letter in family.replace("D", ""):
        depth, left = (-depth, left) if letter == "S" else (2 * DEPTH - depth, left * 0.35**2)
    return depth, left


def panel(ahead, down, sign):
    """Gain of a panel of 0.3 m x 8 mm, without nulls, that looks east, 20 degrees down, to launches up or down."""
    tilt = np.radians(20)
    north, east = ahead
    off = -np.sin(tilt) * east + np.cos(tilt) * sign * down
    return np.sinc(0.3 * north / WAVE) * np.sinc(0.008 * off / WAVE)


def sonar_equation(pairs, time, energy):
    """Mean intensity over a stretch of time by the sum over rings and bearings of the flat bed, in double precision.

    Both orders of a pair arrive together and in phase: twice the sum of their energies.
    """
    reach, bearing = np.arange(0.02, 75, 0.04), np.linspace(-np.pi / 2, np.pi / 2, 1001)
    r, b = reach[:, None], bearing[None, :]
    total = 0.0
    for out, back in pairs:
        patch, way = 10 ** (-2.7) * r * 0.04 * (bearing[1] - bearing[0]), 0.0
        for family in (out, back):
            depth, left = unfolded(family)
            length = np.hypot(r, DEPTH - depth)
            first_up = -1 if family.startswith("S") else 1
            ahead = r * np.sin(b) / length, r * np.cos(b) / length
            sine = (DEPTH - depth) / length
            patch = patch * left * sine / length**2 * panel(ahead, sine, first_up) ** 2
            way = way + length
        arrived = (way > SPEED * time[0]) & (way < SPEED * time[1])
        total += (patch * arrived).sum() * (4 if out != back else 1)
    return 1e22 * total * energy / (time[1] - time[0])


def received(families, time):
    """Mean intensity of fast reverberation over the flat bed, and the energy of its pulse."""
    paths = {"families": families, "max_reflections": 4, "edge_diffraction": "none", "beam_cutoff_db": -90}
    track = {**SIDESCAN["track"], "window": [time[0] - 1e-3, time[1] + 1e-3]}
    low = {"kind": "planar", "width": 0.3, "height": 0.008}
    sonar = {**SIDESCAN["sonar"], "transmit": low, "receive": low}
    simulator = build_simulator(made(seabed=FLAT, paths=paths, water=LOSSLESS, track=track, sonar=sonar))
    received = quickly(simulator)[0]
    when = (simulator.grid.time > time[0]) & (simulator.grid.time < time[1])
    fine = np.arange(simulator.pulse.start, simulator.pulse.stop, 1e-7)
    return received[when].mean(), float(np.sum(np.abs(simulator.pulse.samples(fine)) ** 2) * 1e-7)


@few_of(
    (1, 4, 7),
    "families",
    [["D"], ["S"], ["BS"], ["SBS"], ["BSBS"], ["D", "S"], ["S", "BS"], ["D", "SBS"]],
    ids="+".join,
)
def test_each_pair_is_as_strong_as_its_sonar_equation(families):
    """One family alone, and two with both of their mixed pairs in phase: within 0.05 dB of a sum over the flat bed."""
    time = (0.08, 0.095)  # all are a while past the seabed below the sonar, which BSBS reaches at 61 ms
    found, energy = received(families, time)
    pairs = [(f, f) for f in families] + ([tuple(families)] if len(families) == 2 else [])
    shift = 0.1e-3  # middle of the pulse
    expected = sonar_equation(pairs, (time[0] - shift, time[1] - shift), energy)
    assert 10 * np.log10(found / expected) == pytest.approx(0, abs=0.05)


def scaled(factor):
    """The flat scene with all lengths, times and waves longer by a factor, in water that takes nothing."""
    panel = {"kind": "planar", "width": 0.3 * factor, "height": 0.02 * factor}
    pulse = {"kind": "cw", "frequency": 1e5 / factor, "duration": 2e-4 * factor}
    band = {"bandwidth": 2e4 / factor}
    sonar = {**SIDESCAN["sonar"], "pulse": pulse, "transmit": panel, "receive": panel, "receiver": band}
    track = {
        **SIDESCAN["track"], "start": [0.0, 0.0, SONAR * factor], "window": [0.0, 0.05 * factor],
        "interval": 0.1 * factor,
    }  # fmt: skip
    crate = {**CRATE, "position": [0.0, 20.0 * factor], "size": [side * factor for side in CRATE["size"]]}
    bed = {**FLAT, "depth": DEPTH * factor}
    paths = {"max_reflections": 2, "edge_diffraction": "knife-edge"}
    return made(sonar=sonar, track=track, seabed=bed, targets=[crate], paths=paths, water=LOSSLESS)


@few_of((1,), "factor", [0.5, 2.0])
def test_a_scene_of_twice_the_size_takes_twice_the_time(factor):
    """All lengths, times and the wavelength scaled: intensity by 1 / scale^2, sample by sample, shadow and all."""
    own, other = (build_simulator(scaled(one)) for one in (1.0, factor))
    here, there = quickly(own)[0], quickly(other)[0]
    assert here.size == there.size
    ratio = 10 * np.log10(there[GROUND] * factor**2 / here[GROUND])
    assert abs(ratio.mean()) < 0.02 and ratio.std() < 0.2


@pytest.mark.parametrize("order", [0, 2])
def test_ten_decibels_of_scattering_are_ten_decibels_of_sound(order):
    """A product law that is ten times as strong, over the same relief: ten times the intensity, to a millionth."""
    stronger = {**SIDESCAN["seabed"], "scattering": {"law": "lambert", "strength_db": -17}}
    base, other = (quickly(build_simulator(made(order, **changes))) for changes in ({}, {"seabed": stronger}))
    np.testing.assert_allclose(other[0, GROUND], 10 * base[0, GROUND], rtol=1e-4)


@pytest.mark.parametrize("order", [0, 2])
def test_a_later_window_receives_what_the_whole_one_does(order):
    """From 25 to 40 ms alone: over each 2 ms within 0.1 dB of those samples of the whole recording."""
    track = {**SIDESCAN["track"], "window": [0.025, 0.04]}
    whole, part = build_simulator(made(order)), build_simulator(made(order, track=track))
    first = round((part.grid.time[0] - whole.grid.time[0]) * whole.grid.sample_rate)
    received = quickly(part)[0]
    expected = quickly(whole)[0, first : first + received.size]
    runs = [x[: x.size // 50 * 50].reshape(-1, 50).mean(axis=1) for x in (received, expected)]
    assert np.abs(10 * np.log10(runs[0] / runs[1])).max() < 0.1


@pytest.mark.parametrize("order", [0, 2])
def test_twice_the_points_agree(order):
    """Two, four and eight points a cell over fractal relief: means within 0.05 dB of each other."""

    def received(count):
        paths = {"max_reflections": order, "edge_diffraction": "none", "scatterers_per_cell": count}
        return quickly(build_simulator(made(paths=paths)))[0, GROUND].mean()

    level = 10 * np.log10([received(count) for count in (2.0, 4.0, 8.0)])
    assert np.ptp(level) < 0.05


def test_levels_of_ends_add_up():
    """10 dB more source level are 10 dB more of everything but the noise: no gain depends on level."""
    stronger = {**SIDESCAN["sonar"], "source_level_db": 230}
    base, other = (quickly(build_simulator(made(2, **changes))) for changes in ({}, {"sonar": stronger}))
    np.testing.assert_allclose(other[:, GROUND], 10 * base[:, GROUND], rtol=1e-5)


@pytest.mark.parametrize("away", [3.0, 7.0])
def test_a_target_beside_the_sonar_is_the_same_by_both_engines(away):
    """A crate 3 or 7 m off, where lines are few and its shadow long: echo and shadow within 0.3 dB in the mean."""
    crate = {**CRATE, "position": [0.0, away], "size": [0.6, 0.5, 1.0]}
    simulator = build_simulator(made(1, targets=[crate]))
    for part in (slice(100, 350), GROUND):
        quick, general = quickly(simulator)[0, part], thoroughly(simulator)[0, part]
        assert abs(10 * np.log10(quick.mean() / general.mean())) < 0.3


@pytest.mark.parametrize(("roll", "pitch", "heading"), [(12.0, 0.0, 0.0), (-9.0, 4.0, 70.0), (0.0, -6.0, 200.0)])
def test_a_platform_that_leans_receives_the_same_by_both_engines(roll, pitch, heading):
    """Roll, pitch and heading turn the panel off its position: means within 0.07 dB."""
    lean = {"kind": "static", "position": [0.0, 0.0, 4.0], "heading": np.radians(heading), "roll": np.radians(roll),
            "pitch": np.radians(pitch), "window": [0.0, "50 ms"]}  # fmt: skip
    simulator = build_simulator(made(2, track=lean))
    quick, general = quickly(simulator)[0, GROUND], thoroughly(simulator)[0, GROUND]
    assert abs(10 * np.log10(quick.mean() / general.mean())) < 0.07
