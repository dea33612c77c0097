"""Claims about split-beam echosounders: power, backscattering strength and angles follow from the sectors' voltages."""

import numpy as np
import pytest
import xarray as xr

from insonify.formats.instruments import open_instrument
from insonify.ocean.absorption import absorption_db_per_m
from insonify.processing.split_beam import (
    PowerBudget,
    echosounder_levels,
    electrical_angles,
    pressure_per_volt,
    received_power,
    transmit_replica,
)
from oracles.instrument_files import DATA

REAL = DATA / "real" / "ek80-zeebrugge-38-70-120-200-333khz.raw"
RATE, DECIMATION = 1.5e6, 8
TAPS = 2 * np.hanning(31)[:, None] / np.hanning(31).sum() * np.exp(2j * np.pi * 75e3 / RATE * np.arange(31))[:, None]
TAPS = TAPS[:, 0]


def test_a_tone_lasts_as_its_envelope():
    """Rises of half a Hann window over the part s at both ends leave 1 - 5 s / 4 of the energy."""
    for slope in (0.01, 0.2, 0.4):
        replica = transmit_replica((75e3, 75e3), 2e-3, slope, RATE, [(TAPS, DECIMATION)])
        assert replica.sample_rate == RATE / DECIMATION
        expected = 2e-3 * (1 - 1.25 * slope)
        assert replica.resolution_time(compressed=False) == pytest.approx(expected, rel=0.01)


def test_a_compressed_sweep_lasts_one_over_its_bandwidth():
    """The autocorrelation of a sweep of bandwidth B is a sinc whose square has the integral 1/B."""
    replica = transmit_replica((60e3, 90e3), 4e-3, 0.01, RATE, [(TAPS, DECIMATION)])
    assert replica.resolution_time(compressed=True) == pytest.approx(1 / 30e3, rel=0.03)


@pytest.mark.parametrize("sectors", [3, 4])
def test_a_matched_receiver_takes_the_power_of_each_sector(sectors):
    """Equal impedances Z: a voltage of amplitude y in each of n sectors delivers n y^2 / (2 Z)."""
    voltage = np.full((2, sectors, 5), 3j, np.complex64)
    np.testing.assert_allclose(received_power(voltage, 75.0, 75.0), sectors * 9 / 150, rtol=1e-6)


def test_the_sonar_equation_gives_back_what_was_put_in():
    """A point of -40 dB re 1 m^2 and a volume of -60 dB re 1/m at any range, from the power that they return."""
    f, c, tau, r = 120e3, 1500.0, 2e-4, np.array([0.0, 1.0, 10.0, 100.0])
    budget = PowerBudget(c / f, c, 0.04, 250.0, 27.0, -20.7, tau, -0.5)
    way = 250.0 * 10 ** (2 * 27 / 10 - 2 * 0.04 * r / 10) * (c / f) ** 2
    with np.errstate(divide="ignore"):
        point = way * 1e-4 / (16 * np.pi**2 * r**4)
        volume = way * 1e-6 * 10 ** (-2 * 0.5 / 10) * 10 ** (-20.7 / 10) * c * tau / 2 / (16 * np.pi**2 * r**2)
    np.testing.assert_allclose(budget.point_scattering_strength(point, r)[1:], -40)
    np.testing.assert_allclose(budget.volume_backscattering_strength(volume, r)[1:], -60)
    assert np.isnan(budget.point_scattering_strength(point, r)[0])


@pytest.mark.parametrize(("beam_type", "share"), [(1, 1.0), (17, 1.0), (49, 0.5), (65, 0.5), (81, 0.5)])
def test_a_plane_wave_has_the_phase_of_the_distance_of_the_sectors(beam_type, share):
    """Echoes from ahead and from starboard: quadrants by their halves, thirds by their centres; a centre halves it."""
    quadrants = np.array([[-1, 1], [-1, -1], [1, -1], [1, 1]]) / 2  # forward, starboard, in distances of halves
    thirds = np.array([[-0.5, np.sqrt(0.75)], [-0.5, -np.sqrt(0.75)], [1, 0], [0, 0]]) / np.sqrt(3)
    place = quadrants if beam_type == 1 else thirds[: 3 if beam_type == 17 else 4]
    for ahead, starboard in ((0.6, 0.0), (0.0, 0.6), (-0.4, 0.3)):
        wave = np.exp(1j * place @ [ahead, starboard])[:, None]
        along, athwart = electrical_angles(wave, beam_type)
        np.testing.assert_allclose([along[0], athwart[0]], [share * ahead, share * starboard], atol=1e-12)
    with pytest.raises(ValueError, match="is not split into three or four"):
        electrical_angles(wave[:2], beam_type)


def sweep(amplitude, delay, angle):
    """Ping of a swept pulse with one echo in four sectors, from ahead by an angle."""
    replica = transmit_replica((60e3, 90e3), 1e-3, 0.1, RATE, [(TAPS, DECIMATION)])
    echo = np.zeros(1000, complex)
    echo[delay : delay + replica.samples.size] = amplitude * replica.samples
    half = 23 * (75 / 70) * np.sin(angle) / 2
    voltage = echo * np.exp(1j * np.array([-half, -half, half, half]))[:, None]
    pings = {
        "frequency_start": 60e3, "frequency_end": 90e3, "frequency": 75e3, "pulse_length": 1e-3, "swept": 1.0,
        "slope": 0.1, "transmit_power": 250.0, "sound_speed": 1500.0, "gain_db": 20.0, "sa_correction_db": 3.0,
        "range_step": 1500 * DECIMATION / RATE / 2, "first_range": 0.0, "temperature": 10.0, "salinity": 35.0,
        "acidity": 8.0, "environment_depth": 5.0,
    }  # fmt: skip
    constant = {
        "nominal_frequency": 70e3, "receiver_sample_rate": RATE, "transceiver_impedance": 5400.0, "beam_type": 1.0,
        "equivalent_beam_angle_db": -20.0, "angle_sensitivity_alongship": 23.0, "angle_sensitivity_athwartship": 23.0,
        "angle_offset_alongship": 0.01, "angle_offset_athwartship": 0.0,
    }  # fmt: skip
    made = {name: ("ping", [value]) for name, value in pings.items()} | constant
    made["voltage"] = ("ping", "sector", "sample"), voltage[None].astype(np.complex64)
    made["filter_1"] = "tap_1", TAPS, {"decimation": DECIMATION}
    made["calibrated_gain_db"] = "calibration_frequency", [26.0, 28.0, np.nan]
    return xr.Dataset(made, {"ping": [0], "time": ("ping", [0.0]), "calibration_frequency": [60e3, 90e3, 95e3]})


def test_an_echo_of_a_sweep_is_compressed_to_its_range_strength_and_angle():
    """The peak stands at the start of the echo, with its amplitude; the gain is that calibrated at the centre."""
    levels = echosounder_levels(sweep(0.5, 400, 0.03))
    power = levels.received_power[0].values
    r = 400 * 1500 * DECIMATION / RATE / 2
    assert np.argmax(power) == 400 and float(levels.range[0, 400]) == pytest.approx(r)
    coherent = 0.5 * np.cos(23 * (75 / 70) * np.sin(0.03) / 2)
    assert power[400] == pytest.approx(4 * coherent**2 / 8 * (5475 / 5400) ** 2 / 75, rel=1e-4)
    absorption = float(absorption_db_per_m(75e3, temperature=10.0, salinity=35.0, depth=5.0, ph=8.0))
    reference = 10 * np.log10(250 * (1500 / 75e3) ** 2 / (16 * np.pi**2))
    expected = 10 * np.log10(power[400]) + 40 * np.log10(r) + 2 * absorption * r - reference - 2 * 27.0
    assert float(levels.point_scattering_strength[0, 400]) == pytest.approx(expected)
    assert float(levels.angle_alongship[0, 400]) == pytest.approx(0.03 - 0.01, abs=1e-4)
    assert float(levels.angle_athwartship[0, 400]) == pytest.approx(0, abs=1e-4)


def test_a_tone_recorded_as_power_has_the_levels_and_angles_of_its_voltages():
    """Power in decibels and electrical angles of a tone, without slope: the pulse stands for its resolution time."""
    pings = sweep(0.5, 400, 0.03).assign(swept=("ping", [0.0]), slope=("ping", [np.nan]), gain_db=("ping", [27.0]))
    pings = pings.assign(sa_correction_db=("ping", [0.0]))
    complex_levels = echosounder_levels(pings)
    along, athwart = electrical_angles(pings.voltage.values, 1)
    with np.errstate(divide="ignore"):
        power = ("ping", "sample"), 10 * np.log10(complex_levels.received_power.values)
    phases = {"phase_alongship": (("ping", "sample"), along), "phase_athwartship": (("ping", "sample"), athwart)}
    levels = echosounder_levels(pings.drop_vars("voltage").assign(power_db=power, **phases))
    for name in complex_levels:
        np.testing.assert_allclose(levels[name], complex_levels[name], rtol=1e-9, atol=1e-12)
    point, volume = levels.point_scattering_strength[0, 410], levels.volume_backscattering_strength[0, 410]
    cell = 10 * np.log10(1500 * 1e-3 / 2 * levels.range[0, 410] ** 2) - 20 - 20 * np.log10(75 / 70)
    assert float(point - volume) == pytest.approx(float(cell))


def test_pressure_of_a_tone_gives_the_target_strength_by_its_source_level():
    """Level less source level plus spreading and absorption: eq. 20 within the 0.1 dB to which 170.8 dB is rounded."""
    made = sweep(0.5, 400, 0.0).assign(swept=("ping", [0.0]), gain_db=("ping", [27.0]))
    levels = echosounder_levels(made)
    r = float(levels.range[0, 410])
    loss = float(absorption_db_per_m(75e3, temperature=10.0, salinity=35.0, depth=5.0, ph=8.0))
    pressure = np.abs(made.voltage.values[0].mean(axis=0)[410]) * pressure_per_volt(made)
    strength = 20 * np.log10(pressure) - (170.8 + 10 * np.log10(250) + 27) + 40 * np.log10(r) + 2 * loss * r
    assert float(levels.point_scattering_strength[0, 410]) == pytest.approx(strength, abs=0.1)
    assert np.isnan(pressure_per_volt(made.drop_vars("gain_db")))


def test_stored_angles_of_thirds_are_scaled():
    """The instrument stores the mean of the two differences along, and half of theirs athwart."""
    wave = np.exp(1j * np.array([0.1, 0.3, 0.7]))[:, None]  # starboard, port, forward
    pings = (
        sweep(0.5, 0, 0.0).isel(sample=[0]).assign(swept=("ping", [0.0]), beam_type=17.0, angle_offset_alongship=0.0)
    )
    pings = pings.assign(voltage=(("ping", "sector", "sample"), wave[None]))
    stored = {"phase_alongship": (0.6 + 0.4) / 2, "phase_athwartship": (0.4 - 0.6) / 2, "power_db": -90.0}
    levels = echosounder_levels(
        pings.drop_vars("voltage").assign({name: (("ping", "sample"), [[value]]) for name, value in stored.items()})
    )
    for name in ("angle_alongship", "angle_athwartship"):
        np.testing.assert_allclose(levels[name], echosounder_levels(pings)[name])


def test_a_setting_that_is_missing_is_named():
    """Of one ping its levels are NaN; of all pings, it is refused by name; a single beam has no angles."""
    pings = sweep(0.5, 400, 0.03)
    two = xr.concat([pings, pings.assign(transmit_power=("ping", [np.nan]))], "ping", data_vars="minimal")
    levels = echosounder_levels(two)
    assert np.isfinite(levels.received_power[0]).all() and np.isnan(levels.received_power[1]).all()
    with pytest.raises(ValueError, match=r"does not state transceiver_impedance\. Assign"):
        echosounder_levels(pings.drop_vars("transceiver_impedance"))
    assert "angle_alongship" not in echosounder_levels(pings.assign(beam_type=0.0))


@pytest.mark.parametrize("other", [xr.Dataset(), xr.Dataset({"level": (("ping", "channel"), [[1.0]])})])
def test_a_dataset_without_echoes_of_an_echosounder_is_refused(other):
    """An empty one, and one of another instrument; the message has the call that reads the right one."""
    with pytest.raises(ValueError, match=r"neither voltage nor power_db .*file\.read\(\"38 kHz\"\)"):
        echosounder_levels(other)


@pytest.mark.skipif(not REAL.is_file(), reason=f"the recording {REAL.name} is not in the folder of data")
def test_the_stored_filters_decimate_to_the_stored_interval():
    """Five real channels: filters lead to the sample rate, and a tone passes at its amplitude."""
    with open_instrument(REAL) as file:
        for group in file.groups:
            pings = file.read(group)
            stages = [(pings[name].values, pings[name].attrs["decimation"]) for name in ("filter_1", "filter_2")]
            tone = (float(pings.frequency[0]),) * 2
            replica = transmit_replica(tone, 2e-3, 0.1, float(pings.receiver_sample_rate), stages)
            assert 1 / replica.sample_rate == pytest.approx(float(pings.sample_interval[0]))
            assert np.median(np.abs(replica.samples[40:-40])) == pytest.approx(1, abs=0.01)


@pytest.mark.skipif(not REAL.is_file(), reason=f"the recording {REAL.name} is not in the folder of data")
def test_the_first_echo_of_a_flat_bed_arrives_near_the_axis():
    """The leading edge of a level bed lies within half a beam width of 7 deg of the axis, alike in both pings."""
    with open_instrument(REAL) as file:
        for group in file.groups:
            levels = echosounder_levels(file.read(group))
            bed = (levels.range[0] > 4.9) & (levels.range[0] < 7)
            power = levels.received_power.where(bed)
            edge = int((power[0] > power[0].max() / 4).argmax("sample"))
            for side in ("alongship", "athwartship"):
                angle = np.degrees(levels[f"angle_{side}"][:, edge : edge + 15].mean("sample"))
                assert np.all(np.abs(angle) < 3.5) and np.ptp(angle.values) < 1.0, (group, angle.values)
