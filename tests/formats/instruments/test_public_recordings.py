"""Claims about public recordings: what was measured in them by other means comes out of what is read.

The files are not part of the project; tests that need them skip where they are absent.
"""

import json

import numpy as np
import pytest

from insonify import open_instrument
from insonify.cli import main
from oracles.instrument_files import DATA

EM2042, EM2040, HDS = "real/em2042-ostend-os02-300khz-b", "real/em2040-belgica-0077", "scotsman-iver2.xtf"


def opened(name):
    """A public recording, open; skipped where it is absent."""
    if not (DATA / name).is_file():
        pytest.skip(f"{name}, a public recording, is not in the folder INSONIFY_DATA")
    return open_instrument(DATA / name)


def test_heave_of_a_multibeam_is_positive_down():
    """Transmitter depth less heave is constant while the vessel heaves by 0.3 m: lever arms explain 10 mm."""
    with opened(f"{EM2042}.kmall") as file:
        soundings, attitude = file.soundings(), file.attitude()
    heave = np.interp(soundings.time, attitude.time, attitude.heave)
    assert np.ptp(heave) > 0.3 and np.ptp(soundings.transducer_depth.values - heave) < 0.03
    np.testing.assert_allclose(soundings.water_level.values + heave, 0.67, atol=1e-4)  # SWLZ of the installation
    np.testing.assert_allclose(soundings.heading, np.interp(soundings.time, attitude.time, attitude["yaw"]), atol=1e-5)
    with opened(f"{EM2040}.wcd") as water, opened(f"{EM2040}.all") as file:
        column, soundings = water.read("water column"), file.soundings()
    depth = dict(zip(soundings.ping_number.values.tolist(), soundings.transducer_depth.values, strict=True))
    rest = [
        depth[n] - h for n, h in zip(column.ping_number.values.tolist(), column.heave.values, strict=True) if n in depth
    ]
    assert np.ptp(rest) < 0.011  # heave is logged in centimetres


@pytest.mark.parametrize(("name", "aside", "spread"), [(f"{EM2042}.kmall", 0.0, 0.01), (f"{EM2040}.all", 0.867, 0.02)])
def test_ranges_agree_with_positions(name, aside, spread):
    """Travel times times sound speed are the distances to the soundings: signs of angles and axes agree.

    The EM2040's positions are re an antenna that its installation puts 0.867 m to starboard, and some metres forward.
    """
    with opened(name) as file:
        found = file.soundings()
    below = found.depth - found.transducer_depth
    distance = np.hypot(found.starboard + aside, below)
    valid = (found.detection == 0) & (abs(found.beam_angle) > 0)
    ratio = (found.travel_time * found.sound_speed / 2 / distance).where(valid)
    assert abs(float(ratio.median()) - 1) < 0.015 and float(ratio.std()) < spread
    for ping in range(found.sizes["ping"]):
        angle, aside = found.beam_angle.values[ping], found.starboard.values[ping]
        assert np.corrcoef(angle[valid.values[ping]], aside[valid.values[ping]])[0, 1] > 0.9


def test_the_harbour_is_flat():
    """EM2042: 98 % of the normal detections of each ping within 0.35 m, between 8.1 and 8.5 m below the water."""
    with opened(f"{EM2042}.kmall") as file:
        depth = file.soundings().pipe(lambda found: found.depth.where(found.detection == 0))
    low, middle, high = depth.quantile([0.01, 0.5, 0.99], dim="beam").values
    assert low.min() > 8.1 and middle.min() > 8.2 and middle.max() < 8.3
    assert np.sort(high - low)[-2] < 0.35  # of the one at 680 kHz one in a hundred is an outlier


def test_the_seabed_image_is_single_look():
    """Speckle about the neighbours at 50 to 70 deg: std of level 5.57 dB and skew -1.14 of a Rayleigh amplitude.

    Over 500 samples in each ping the standard error of the std is 0.3 dB and of the skew 0.25; the std of ten lines of
    this instrument is 4.9 to 6.3 dB.
    """
    with opened(f"{EM2042}.kmall") as file:
        image = file.read("seabed image")
    for ping in range(image.sizes["ping"]):
        level = image.level.values[ping][np.degrees(np.abs(image.beam_angle.values[ping])) > 50]
        level = level[np.isfinite(level).any(axis=1)]
        if np.isfinite(level).sum() < 500:
            continue
        mean = np.nanmean(10 ** (level / 10), axis=1)
        near = np.array([np.delete(mean[max(k - 12, 0) : k + 13], min(k, 12)).mean() for k in range(len(mean))])
        residual = (level - 10 * np.log10(near)[:, None])[np.isfinite(level)]
        assert 4.9 < residual.std() < 6.3
        assert -1.6 < ((residual - residual.mean()) ** 3).mean() / residual.std() ** 3 < -0.6


@pytest.mark.parametrize("name", [f"{EM2042}.kmwcd", f"{EM2040}.wcd"])
def test_the_strongest_sample_is_the_detection(name):
    """In half of the beams of a water column within one sample."""
    with opened(name) as file:
        water = file.read("water column", slice(9))
    strongest = water.level.fillna(-99).argmax("sample") + water.first_sample
    assert float(abs(strongest - water.detected_sample).median()) <= 1.1
    assert (water.gain_exponent == 30).all() and water.gain_offset.values[0] == (30 if "kmwcd" in name else 40)


def test_the_sidescan_of_the_wreck():
    """Clipped samples, speed, attitude and ping interval as measured by a reader of its own."""
    with opened(HDS) as file:
        sides = {side: file.read(side) for side in file.groups}
        attitude, navigation = file.attitude(), file.navigation()
    for side, share in (("port", 0.014), ("starboard", 0.025)):
        amplitude = sides[side].amplitude.values
        assert (amplitude[:, :8] >= 32767).all()  # the transmitted pulse comes first
        assert (amplitude[:, 41:] >= 32767).mean() == pytest.approx(share, abs=5e-4)
    assert np.degrees([attitude["roll"].std(), attitude["pitch"].std()]) == pytest.approx([1.2, 7.4], abs=0.05)
    time = navigation.time.values
    assert np.ptp(time) / 460 == pytest.approx(0.1135, abs=1e-4)
    north, east = (
        np.diff(navigation.latitude)[1:],
        np.diff(navigation.longitude)[1:] * np.cos(navigation.latitude.values[1]),
    )
    run = 6.371e6 * np.hypot(north, east).sum() / (time[-1] - time[1])
    assert run == pytest.approx(1.05, abs=0.03) and float(sides["port"].speed[1:].mean()) == pytest.approx(
        1.03, abs=0.02
    )


ABOUT = {
    f"{EM2042}.kmall": ("EM2042", "25002", "2025-11-27T11:05:36", {"soundings": 6, "seabed image": 6}, 24),
    f"{EM2042}.kmwcd": ("EM2042", "25002", "2025-11-27T11:05:36", {"water column": 5}, 16),
    f"{EM2040}.all": ("EM2040", "2004", "2022-11-09T12:36:54", {"soundings": 9, "seabed image": 9}, 141),
    f"{EM2040}.wcd": ("EM2040", "2004", "2022-11-09T12:36:54", {"water column": 10}, 38),
    HDS: ("HDS", "", "2013-09-10T21:13:08", {"port": 461, "starboard": 461}, 461),
}
"""Model, serial number, begin, pings of each group and number of datagrams."""


@pytest.mark.parametrize("name", ABOUT)
def test_info_states_what_a_recording_is(name, capsys):
    """Model, serial, time, groups and datagrams of the five files; datagrams cover them without a gap."""
    with opened(name) as file:
        index = file.datagrams
        np.testing.assert_array_equal(index.offset[1:], (index.offset + index.size)[:-1])
        assert index.offset[0] == (1024 if name == HDS else 0)
        assert index.offset[-1] + index.size[-1] == file.path.stat().st_size
    assert main(["info", str(DATA / name), "--json"]) == 0
    about = json.loads(capsys.readouterr().out)
    model, serial, start, groups, count = ABOUT[name]
    assert (about["model"], about["serial"]) == (model, serial) and about["start"].startswith(start)
    assert {group["name"]: group["pings"] for group in about["groups"]} == groups
    assert sum(row["count"] for row in about["datagrams"]) == count and about["clock_jumps"] == []
    for group in about["groups"]:
        low, high = group["frequency"]
        assert 190e3 <= low <= high <= 680e3 and 1400 < group.get("sound_speed", [1500])[0] < 1510


@pytest.mark.parametrize("name", ABOUT)
def test_a_public_recording_cut_short_is_read_to_the_cut(name, tmp_path):
    """At a third and at two thirds: all datagrams in front of the cut, and one omission at the last of them."""
    with opened(name) as file:
        ends, whole = file.datagrams.offset + file.datagrams.size, file.path.read_bytes()
    for cut in (len(whole) // 3, 2 * len(whole) // 3):
        (tmp_path / f"cut{(DATA / name).suffix}").write_bytes(whole[:cut])
        with open_instrument(tmp_path / f"cut{(DATA / name).suffix}") as file:
            assert file.datagrams.offset.size == (ends <= cut).sum()
            assert [part.offset for part in file.omissions][-1] == ends[ends <= cut][-1]
            for group, count in file.groups.items():
                assert file.read(group, slice(-1, None)).sizes["ping"] == min(count, 1)
