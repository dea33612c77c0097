"""Claims about HDF5 files in the AirSAS layout, read by h5py and focused by a back-projection of this file."""

import warnings
from importlib import import_module

import numpy as np
import pytest

import insonify
from insonify.formats.store_description import StoreError
from oracles.surveys import aperture, sidescan

h5py = pytest.importorskip("h5py")
export_module = import_module("insonify.writers.export")
POINT = {"shape": "point", "label": "p", "position": (0.3, 13.0, 9.0), "target_strength_db": 0.0}


@pytest.fixture(scope="module")
def sound():
    """Pings past a point."""
    return insonify.simulate(aperture(targets=[POINT]), threads=1)


@pytest.fixture(scope="module")
def file(sound, tmp_path_factory):
    """The recording as a file, open."""
    with h5py.File(insonify.export(sound, tmp_path_factory.mktemp("a") / "a.h5")) as opened:
        yield opened


def analytic(series):
    """Positive frequencies of real series, twice, shape (ping, sample)."""
    spectrum = np.fft.fft(series, axis=1)
    spectrum[:, series.shape[1] // 2 :] = 0
    return np.fft.ifft(2 * spectrum, axis=1)


def test_the_envelope_comes_back_from_the_real_series(sound, file):
    """Positive frequencies, mixed down and every so-manieth sample: the recording to 1e-6 of its largest pressure."""
    rate, start = file["Params/fs"][()], float(sound.time[0])
    assert rate == 300e3 and file["Wfm/pulseLength"][()] * rate == 150  # the authors' reader refuses parts of a sample
    factor = round(rate * float(np.diff(sound.time.values).mean()))
    lead = round(start * rate + file["Hardware/groupDelay"][()])
    assert 0 <= start * rate - lead < 1 and file["ch1/ts"].shape == (24, lead + factor * sound.sizes["time"])
    for channel in range(4):
        complete = analytic(file[f"ch{channel + 1}/ts"][:, lead:].astype(float))[:, ::factor] / np.sqrt(2)
        envelope = complete * np.exp(-2j * np.pi * 100e3 * sound.time.values)
        expected = sound.pressure.values[:, channel]
        assert np.abs(envelope - expected).max() < 1e-6 * np.abs(expected).max()


def test_a_great_size_is_stated_before_the_file_is_written(sound, tmp_path, monkeypatch):
    """Size at most, the reason, and the size of the recording; nothing of small files, and of netCDF no such size."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        insonify.export(sound, tmp_path / "a.h5")
    size, samples = (tmp_path / "a.h5").stat().st_size, sound.pressure.nbytes
    rows = 24 * 4 * h5py.File(tmp_path / "a.h5")["ch1/ts"].shape[1]
    assert samples * 4 < size < 4 * rows < 6 * size
    monkeypatch.setattr(export_module, "LEAST_GREAT", 1e6)
    monkeypatch.setattr("insonify.writers.airsas.passband", None)  # would be called to write
    message = f"up to {4e-6 * rows:.3g} MB, and the recording has samples of {1e-6 * samples:.3g} MB: AirSAS has real"
    with pytest.warns(UserWarning, match=message), pytest.raises(TypeError):
        insonify.export(sound, tmp_path / "b.h5")
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        insonify.export(sound, tmp_path / "a.nc")


def test_a_point_is_in_focus_at_its_coordinates(file):
    """Correlated with the replica of the file, and summed over positions and elements at delays of the file's axes."""
    rate, speed, run = file["Params/fs"][()], file["na/soundSpeed"][0], file["na/position"][:]
    sender, receivers = file["Hardware/txPos"][:], file["Hardware/rxPos"][:]
    replica = np.conj(np.fft.fft(analytic(file["Wfm/pulseReplica"][:][None])[0], 1 << 17))
    x, y = np.meshgrid(1.5 + np.arange(-0.1, 0.11, 0.01), 13 + np.arange(-0.1, 0.11, 0.01), indexing="ij")
    image = np.zeros(x.shape, complex)
    late = file["Hardware/groupDelay"][()]
    for channel, receiver in enumerate(receivers):
        series = np.fft.ifft(np.fft.fft(analytic(file[f"ch{channel + 1}/ts"][:].astype(float)), 1 << 17) * replica)
        for ping, along in enumerate(run):
            path = sum(np.sqrt((x - along - end[0]) ** 2 + (y - end[1]) ** 2 + (-9.0 - end[2]) ** 2)
                       for end in (sender, receiver))  # fmt: skip
            index = path / speed * rate + late
            whole = np.floor(index).astype(int)
            turn = np.exp(2j * np.pi * 100e3 * (index - whole) / rate)
            image += series[ping][whole] * turn
    row, column = np.unravel_index(np.abs(image).argmax(), image.shape)
    assert abs(x[row, column] - 1.5) < 0.015 and abs(y[row, column] - 13.0) < 0.015
    assert np.abs(image[0, 0]) < 0.3 * np.abs(image).max()
    assert file["na/pose"][5, 0] == pytest.approx(-1.2 + 0.5) and file["Wfm/fStart"][()] == 92.5e3


def test_intensities_are_refused(tmp_path):
    """They have no phase."""
    with pytest.raises(StoreError, match="field: coherent"):
        insonify.export(insonify.simulate(sidescan(pings=1), threads=1), tmp_path / "a.h5")
