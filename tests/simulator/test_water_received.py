"""Claims about what the water itself sends back: the sonar equation for a volume, at its delays, by every path."""

import numpy as np
import pytest

from insonify.simulator import arrivals, build_simulator, labels, levels, simulate
from oracles.few_of import few_of
from oracles.scenes import each_ping, nominal
from oracles.sonar_equation import pulse_energy

ALPHA = 0.035
SILENT = {"noise_level_db": None, "absorption_db_per_m": ALPHA}
ENERGY = pulse_energy(duration=0.2e-3, fraction=0.2, band=20e3)
POINT = {"kind": "point", "length": None}
DEPTH, BOTTOM, SPEED = 11.0, 20.0, 1500.0
FEW = {"scatterers_per_cell": 1}


def murky(strength=-70.0, *, window=(0.02, 0.06), families=("D",), water=None, paths=None, **top):
    """The nominal sonar in water that scatters, and nothing else received."""
    paths = {"max_reflections": 2, "families": families, "contributions": ["water"], **(paths or {})}
    return nominal(water={**SILENT, "volume_strength_db": strength, **(water or {})}, track={"window": window},
                   paths=paths, **top)  # fmt: skip


def pressure(scenario):
    """One ping, one channel."""
    return simulate(scenario, threads=1).pressure.values[0, 0]


def intensity(scenario):
    """Expected intensity of one ping, one channel."""
    return simulate(scenario.model_copy(update={"field": "incoherent"}), threads=1).intensity.values[0, 0]


def closed_form(time, strength=-70.0, layer=(0.0, BOTTOM)):
    """Urick's volume reverberation, SL - 40 log R - 2 alpha R + S_v + 10 log V, V = c T / 2 Psi R^2 [uPa^2].

    Psi, the integral of the two-way power over the part of the sphere that lies in the layer, by quadrature over equal
    heights: d(Omega) = d(azimuth) dz / R.
    """
    slant = SPEED * (time - 0.1e-3) / 2
    height = layer[0] + (np.arange(800) + 0.5) / 800 * (layer[1] - layer[0]) - DEPTH
    cosines = np.linspace(1e-3, 1, 100)
    azimuth = np.linspace(-np.pi / 2, np.pi / 2, 8001)
    widths = np.trapezoid(np.sinc(100 * cosines[:, None] * np.sin(azimuth)) ** 4, azimuth, axis=-1)
    sine = height / slant[:, None]
    inside = np.abs(sine) < 1
    width = np.where(inside, np.interp(np.sqrt(np.maximum(1 - sine**2, 0)), cosines, widths), 0)
    angle = width.sum(axis=1) * (layer[1] - layer[0]) / 800 / slant
    volume = SPEED * ENERGY / 2 * angle * slant**2
    return 10 ** ((220 + strength) / 10) * volume / slant**4 / 10 ** (2 * ALPHA * slant / 10)


def test_the_expected_echo_of_the_water_is_the_sonar_equation():
    """15 to 45 m: within 0.05 dB over all and 0.1 dB in each sixth, single samples within 0.5 dB."""
    ratio = intensity(murky()) / closed_form(build_simulator(murky()).grid.time)
    assert 10 * np.log10(ratio.mean()) == pytest.approx(0, abs=0.05)
    for part in np.array_split(ratio, 6):
        assert 10 * np.log10(part.mean()) == pytest.approx(0, abs=0.1)
    assert np.abs(10 * np.log10(ratio)).max() < 0.5


def test_the_mean_coherent_echo_of_the_water_is_the_sonar_equation_and_speckles():
    """16 waters of 260 cells, N = 4200: level within 0.2 dB (three standard errors), index 2.0 + 0.75 / 5 within 0.3.

    0.75 / N for N points of one strength in a cell; here at least 5 of them, 7 on average.
    """
    scenario = murky(window=(0.03, 0.06))
    waters = [scenario.model_copy(update={"seed": seed}) for seed in range(16)]
    power = np.abs(each_ping(waters, pressure)) ** 2 / closed_form(build_simulator(scenario).grid.time)
    assert 10 * np.log10(power.mean()) == pytest.approx(0, abs=0.2)
    assert np.mean(power**2) / power.mean() ** 2 == pytest.approx(2.1, abs=0.3)


def test_a_layer_is_received_at_its_own_delays():
    """Water that scatters from 2 to 4 m only, sonar at 11 m.

    Nothing before 7 m of slant range, then the sonar equation.

    Within 0.1 dB beyond the first metre; nothing before but the ringing of the receiver's filter.
    """
    scenario = murky(((2.0, -60.0), (4.0, None)), window=(0.004, 0.02))
    time = build_simulator(scenario).grid.time
    received = intensity(scenario)
    expected = closed_form(time, -60.0, (2.0, 4.0))
    begin = 2 * 7.0 / SPEED
    assert np.all(received[time < begin - 0.3e-3] < 1e-5 * received.max())
    late = time > 2 * 10.0 / SPEED + 0.2e-3
    assert 10 * np.log10(np.mean(received[late] / expected[late])) == pytest.approx(0, abs=0.1)
    drawn = np.abs(pressure(scenario)) ** 2
    assert drawn[time < begin - 0.3e-3].max() < 1e-5 * drawn.max()


def test_two_layers_scatter_as_both_alone():
    """Expected intensities add, point by point of the same shells: within 1 % in the mean."""
    rows = ((0.0, -70.0), (8.0, -60.0), (15.0, None))
    both, upper, lower = (
        intensity(murky(part, window=(0.03, 0.04), paths=FEW))
        for part in (rows, ((0.0, -70.0), (8.0, None)), ((8.0, -60.0), (15.0, None)))
    )
    assert np.mean(both / (upper + lower)) == pytest.approx(1, abs=1e-9)


@few_of((0,), "families", [("D", "S"), pytest.param(("D", "B", "BS"), marks=pytest.mark.slow)])
def test_both_readings_of_the_water_agree_by_every_path(families):
    """Reciprocal pairs interfere: 6 waters of 90 cells and more, N = 540; within 0.62 dB, three standard errors."""
    scenario = murky(window=(0.02, 0.03), families=families, paths={"scatterers_per_cell": 2})
    waters = [scenario.model_copy(update={"seed": seed}) for seed in range(6)]
    power = np.mean(np.abs(each_ping(waters, pressure)) ** 2, axis=0)
    assert 10 * np.log10(np.mean(power / intensity(scenario))) == pytest.approx(0, abs=0.62)


def test_the_surface_is_worth_six_times_the_direct_paths():
    """A sonar that receives all directions alike, far out: D and S are alike in level.

    {D} alone is 1, {S} 1, and the pair D-S, arriving with S-D, 4 |A|^2 = 4: together 6, 7.8 dB, above {D}; 75 m from a
    sonar at 6 m the fringes between them average out over the depth of the water. Within 0.3 dB.
    """
    received = []
    for families in (("D",), ("D", "S")):
        made = murky(families=families, window=(0.1, 0.102), transmit=POINT, receive=POINT)
        track = made.track.model_copy(update={"position": (0.0, 0.0, 6.0)})
        received.append(intensity(made.model_copy(update={"track": track})).mean())
    assert 10 * np.log10(received[1] / received[0]) == pytest.approx(10 * np.log10(6), abs=0.3)


def test_exchanging_the_ends_changes_nothing():
    """Transmitter 0.6 m above the receiver or below it, with surface and bottom paths: the same sound to 1e-4."""
    up, down = {"offset": (0.3, 0.0, -0.3)}, {"offset": (0.0, 0.0, 0.3)}
    families = ("D", "S", "B", "SB")
    one, other = (
        pressure(murky(families=families, window=(0.02, 0.021), transmit=sent, receive=received, paths=FEW))
        for sent, received in ((up, down), (down, up))
    )
    assert np.max(np.abs(one - other)) < 1e-4 * np.max(np.abs(one))


SCHOOL = {"label": "school", "position": (0.0, 60.0, 12.0), "size": (3.0, 2.0, 1.5), "volume_strength_db": -40.0,
          "heading": 0.4}  # fmt: skip


@pytest.mark.parametrize(("form", "share"), [("box", 1.0), ("ellipsoid", np.pi / 6)])
def test_a_small_patch_echoes_as_its_volume(form, share):
    """Received by a point: all its energy is that of a target of strength S_v + 10 log V at its middle, to 0.1 dB."""
    wide = {"transmit": POINT, "receive": POINT}
    water = {"volume_strength_db": None, "patches": [{**SCHOOL, "form": form}]}
    patch = intensity(murky(window=(0.076, 0.086), water=water, **wide))
    strength = -40 + 10 * np.log10(9 * share)
    point = {"shape": "point", "label": "p", "position": SCHOOL["position"], "target_strength_db": strength}
    alone = nominal(water=SILENT, targets=[point], track={"window": (0.076, 0.086)}, field="incoherent",
                    paths={"max_reflections": 0, "contributions": ["target"]}, **wide)  # fmt: skip
    assert 10 * np.log10(patch.sum() / intensity(alone).sum()) == pytest.approx(0, abs=0.1)


def test_both_readings_of_a_patch_agree():
    """40 draws of a school, energy of its whole echo: 15 cells along it, standard error 0.2 dB; within 0.6 dB."""
    school = murky(window=(0.076, 0.086), water={"volume_strength_db": None, "patches": [SCHOOL]})
    draws = [school.model_copy(update={"seed": seed}) for seed in range(40)]
    power = np.mean(np.abs(each_ping(draws, pressure)) ** 2, axis=0)
    assert 10 * np.log10(power.sum() / intensity(school).sum()) == pytest.approx(0, abs=0.6)


def test_a_wall_hides_the_water_behind_it():
    """A wall 40 m away from bed to surface, wider than the beam: what is received beyond falls by 20 dB and more."""
    wall = {"position": (0.0, 40.0), "size": (30.0, 0.5, 19.9)}
    hidden, free = (
        intensity(murky(window=(0.06, 0.07), box=box, paths={"edge_diffraction": "none"})) for box in (wall, None)
    )
    assert 10 * np.log10(hidden.mean() / free.mean()) < -20


def test_the_water_has_a_name_in_arrivals_levels_and_labels():
    """Object "water" and the patch's own label; their levels are one contribution, and labels add up to the whole."""
    murk = murky(
        window=(0.078, 0.082), families=("D", "S"), water={"patches": [SCHOOL]}, paths={"contributions": ["water"]}
    )
    assert set(arrivals(murk).object) == {"water", "school"}
    curves = levels(murk)
    water = curves.level_db.sel(contribution="water", pair="all").values
    np.testing.assert_allclose(10 ** (water / 10), intensity(murk), rtol=1e-6)
    named = labels(murk)
    assert list(named.object.values) == ["seabed", "surface", "water", "school"]
    mine = named.object_intensity.sel(object=["water", "school"]).sum("object").values
    np.testing.assert_allclose(mine, named.expected_intensity.values, rtol=1e-5)
    assert named.highlight.values.any()


def test_a_place_in_the_water_keeps_its_scatterer_from_ping_to_ping():
    """A moving sonar: places received at two pings have the same key, position and phase at both."""
    line = {"kind": "line", "start": (0.0, 0.0, 11.0), "position": None, "heading": 0.3, "speed": 2.0, "pings": 3,
            "interval": 0.5, "window": (0.03, 0.04)}  # fmt: skip
    murk = murky()
    murk = type(murk)(**{**murk.model_dump(), "track": {k: v for k, v in line.items() if v is not None}})
    simulator, held = build_simulator(murk), []
    for ping in (0, 2):
        points = [block() for block in simulator.engine.blocks(simulator.ping_geometry(ping))]
        held.append(
            {
                int(k): (*p, f)
                for one in points
                for k, p, f in zip(one.scatterer_id, one.position, one.phase, strict=True)
            }
        )
        assert len(held[-1]) == sum(len(one) for one in points)
    common = held[0].keys() & held[1].keys()
    assert len(common) > 1000
    assert all(held[0][key] == held[1][key] for key in common)


def test_clear_water_offers_nothing():
    """Layers that are all null, and no layers at all: the same blocks, bit for bit the same sound."""
    clear, none = (
        nominal(water={**SILENT, "volume_strength_db": written}, track={"window": (0.05, 0.052)})
        for written in (((0.0, None),), None)
    )
    np.testing.assert_array_equal(pressure(clear), pressure(none))


def test_threads_change_no_bit():
    """One thread and two."""
    murk = murky(window=(0.03, 0.034), families=("D", "S"), water={"patches": [SCHOOL]}, paths=FEW)
    one, two = (simulate(murk, threads=count).pressure.values for count in (1, 2))
    np.testing.assert_array_equal(one, two)


@pytest.mark.slow
def test_nearly_even_water_scatters_as_even_water_does():
    """1 mm/s over 20 m: rays solved for in layers against images of the sonar, over ground with relief, in 3 ms.

    Expected intensities in the mean to 0.02 dB; blocks that lie all under the ground are no error.
    """
    relief = {"relief": {"kind": "ripples", "wavelength": 3.0, "height": 0.3}}
    even, layered = (
        intensity(murky(window=(0.02, 0.023), families=("D", "S"), seabed=relief, water=water, paths=FEW))
        for water in ({}, {"profile": [[0, 1500.0], [25, 1500.001]]})
    )
    assert 10 * np.log10(layered.mean() / even.mean()) == pytest.approx(0, abs=0.02)


@pytest.mark.parametrize("families", [["S"], ["D", "B"]])
def test_the_scatterers_in_the_water_do_not_depend_on_the_window(families):
    """Water near the sonar is received late by reflections: a window that begins later draws the same points."""
    whole, part = (
        pressure(murky(window=window, families=families, paths=FEW)) for window in ((0.016, 0.04), (0.024, 0.032))
    )
    expected, found = whole[200:400][12:-12], part[12:-12]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-3 * np.abs(expected).max())


def test_fewer_even_points_outside_the_main_lobe_give_the_same_expectation():
    """Side lobes by fewer points with larger volumes: samples within 0.2 dB, sums within 0.01 dB, 7.5 to 22.5 m.

    Beyond 15 m at most three quarters of the points are kept, for the same volume to 2 %: side lobes are too weak for
    an error of theirs to show in the samples.
    """
    few, all_points = (
        murky(window=(0.01, 0.03), paths={"importance_sampling": chosen, "scatterers_per_cell": 5.0})
        for chosen in (True, False)
    )
    received, exact = intensity(few), intensity(all_points)
    assert np.abs(10 * np.log10(received / exact)).max() < 0.2
    assert 10 * np.log10(received.sum() / exact.sum()) == pytest.approx(0, abs=0.01)
    count, cross_section = [], []
    for scenario in (few, all_points):
        simulator = build_simulator(scenario.model_copy(update={"field": "incoherent"}))
        blocks = [block() for block in simulator.engine.blocks(simulator.ping_geometry(0), quadrature=True)]
        position, area = (np.concatenate([getattr(one, name) for one in blocks]) for name in ("position", "area"))
        beyond = np.linalg.norm(position - [0, 0, DEPTH], axis=1) > 15
        count.append(int(beyond.sum()))
        cross_section.append(float(area[beyond].sum()))
    assert count[0] < 0.75 * count[1]
    assert cross_section[0] == pytest.approx(cross_section[1], rel=0.02)
