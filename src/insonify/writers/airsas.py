"""HDF5 of synthetic apertures in the layout of the AirSAS data set.

Blanford et al. (2024), Scientific Data 11, s41597-024-04050-0: real series `/ch1/ts` ... over pings and samples (MATLAB
reads samples by pings), non-acoustic data in `/na`. Parameters that its authors keep in tables beside the files are in
groups named as their structure: `Params`, `Wfm`, `Hardware`. Axes are theirs: x along the track, y across it, z up.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from insonify.formats.store_description import StoreError
from insonify.sonar.pulse import envelope
from insonify.surveys.survey import START, Survey

Floats = NDArray[np.float64]

OVERSAMPLING = 2.5
"""Least sample rate re the highest frequency of the band [1]."""
PEAK = np.sqrt(2.0)
"""Peak re rms pressure of a tone [1]."""


def write_airsas(survey: Survey, path: Path) -> None:
    """Write series as real pressure [uPa] from the start of transmission on, with platform and pulse.

    Args:
        survey: Coherent recording of elements or beams on one platform.
        path: File to write.
    """
    import h5py

    survey.require_one_platform("AirSAS HDF5")
    if "pressure" not in survey.recording:
        raise StoreError(f"{survey.name}: a synthetic aperture needs phase, and this recording has intensities. Write "
                         "field: coherent in the scenario")  # fmt: skip
    factor, rate, start = _sampling(survey)
    lead = int(np.floor(start * rate))
    samples = survey.recording.sizes["time"] * factor
    with h5py.File(path, "w") as file:
        shape = (survey.rows.size, lead + samples)
        series = [
            file.create_dataset(
                f"ch{channel + 1}/ts", shape, "f4", chunks=(1, shape[1]), compression="gzip", shuffle=True
            )
            for channel in range(survey.recording.sizes["channel"])
        ]
        for part in series:
            part.attrs["units"] = "uPa"
        for number, row in enumerate(survey.rows):
            pressure = survey.recording["pressure"].isel(ping=int(row)).transpose("channel", "time").values
            for part, real in zip(series, passband(pressure, survey, factor), strict=True):
                part[number, lead:] = real
        values = _platform(survey) | _parameters(survey, rate) | {"Hardware/groupDelay": lead - start * rate}
        for name, value in values.items():
            file[name] = value
        file.attrs["collection_date"] = str(np.datetime64(START, "s"))
        file.attrs["scenario"] = str(survey.recording.attrs["scenario"])


def airsas_size(survey: Survey) -> tuple[float, str]:
    """Largest size of the file [bytes], and the reason for it; the series are compressed, to a third in quiet water."""
    factor, rate, start = _sampling(survey)
    sizes = survey.recording.sizes
    samples = survey.rows.size * sizes["channel"] * (int(np.floor(start * rate)) + factor * sizes["time"])
    return 4.0 * samples, (
        f"AirSAS has real pressures from the start of transmission on, here {rate / 1e3:.4g} kHz of float32 for the "
        f"{rate / factor / 1e3:.4g} kHz of the envelopes"
    )


def passband(pressure: NDArray[np.complexfloating], survey: Survey, factor: int) -> NDArray[np.float32]:
    """Real pressure of complex envelopes at a multiple of their sample rate, by zeros in their spectrum.

    Args:
        pressure: Envelopes of rms pressure [uPa], shape (channel, time).
        survey: Their recording.
        factor: Samples for each sample of the envelope.

    Returns:
        Shape (channel, factor * time).
    """
    from scipy.signal import resample

    fine = resample(np.asarray(pressure, complex), factor * pressure.shape[1], axis=1)
    _, rate, start = _sampling(survey)
    time = start + np.arange(fine.shape[1]) / rate
    carrier = np.exp(2j * np.pi * survey.scenario.sonar.pulse.frequency * time)
    return np.asarray(PEAK * (fine * carrier).real, np.float32)


def _sampling(survey: Survey) -> tuple[int, float, float]:
    """Factor and sample rate of the real series [Hz], and the time of their first sample [s]."""
    base = round(1 / survey.sample_interval, 6)  # free of the rounding of the times, which readers divide lengths by
    highest = survey.scenario.sonar.pulse.frequency + base / 2
    factor = int(np.ceil(OVERSAMPLING * highest / base))
    return factor, factor * base, float(survey.sample_time[0])


def _platform(survey: Survey) -> dict[str, object]:
    """Positions along the track, poses and the positions of transmitter and receivers, forward, starboard, up."""
    scenario, position = survey.scenario, survey.position
    course = position[-1, :2] - position[0, :2]
    length = float(np.linalg.norm(course))
    ahead = course / length if length else np.array([np.cos(survey.attitude[0, 0]), np.sin(survey.attitude[0, 0])])
    upwards, depth = np.array([1.0, 1.0, -1.0]), np.array([0.0, 0.0, -float(position[:, 2].mean())])
    pings = survey.rows.size
    return {
        "na/position": (position[:, :2] - position[0, :2]) @ ahead,
        "na/pose": np.concatenate([position, np.degrees(survey.attitude)], axis=1),
        "na/pose_columns": "north [m], east [m], down [m], heading [deg], pitch [deg], roll [deg], as logged",
        "na/temperature": np.full((pings, 1), scenario.water.temperature),
        "na/soundSpeed": np.full(pings, scenario.water.sound_speed),
        "Hardware/rxPos": survey.recording["element_position"].values * upwards + depth,
        "Hardware/txPos": np.asarray(scenario.sonar.transmit.offset) * upwards + depth,
    }


def _parameters(survey: Survey, rate: float) -> dict[str, object]:
    """Acquisition and waveform."""
    pulse = survey.scenario.sonar.pulse
    half = (pulse.bandwidth if pulse.sweep == "up" else -pulse.bandwidth) / 2
    time = np.arange(int(np.ceil(pulse.duration * rate)) + 1) / rate
    replica = (envelope(pulse, time) * np.exp(2j * np.pi * pulse.frequency * time)).real
    window = {"none": "rectwin", "tukey": "tukeywin", "hann": "hann"}[pulse.taper]
    return {
        "Params/fs": rate, "Params/sysUnits": "mks", "Params/angleUnits": "deg", "Wfm/pulseReplica": replica,
        "Wfm/fStart": pulse.frequency - half, "Wfm/fStop": pulse.frequency + half, "Wfm/pulseLength": pulse.duration,
        "Wfm/winType": window, "Wfm/winParams": pulse.taper_fraction,
        "Wfm/sourceLevel": survey.scenario.sonar.source_level_db,
        "Wfm/replicaCorrelated": int(survey.scenario.sonar.receiver.matched_filter),
    }  # fmt: skip
