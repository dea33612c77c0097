"""Strip map of a synthetic aperture from all pings, beside the image of single pings."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from insonify.demos.products.forward_looking import compressed
from insonify.demos.products.peaks import parabolic_peak_position, width
from insonify.paper.checked_numbers import CheckedNumber
from insonify.plotting.strip_map import PointResponse, StripMap, range_trend, strip_map_view
from insonify.plotting.target_view import half_extent
from insonify.processing import beam_recording, recorded_level, slant_to_ground_range
from insonify.processing.recorded_geometry import (
    body_to_world,
    recorded_element_positions,
    recorded_poses,
    recorded_transmitter_position,
)
from insonify.processing.synthetic_aperture import along_track_resolution, backproject
from insonify.scenario.scenario import Scenario
from insonify.scene.solid import height
from insonify.scene.target import PointTarget
from insonify.sonar.hydrophones import single_element
from insonify.units import level_db

Floats = NDArray[np.float64]

PIXELS_IN_A_CELL = 1.5
"""Pixels per resolution cell, along the track and across it [1]."""
MOST_PIXELS = 1_000_000
CLEAR, BEHIND, LONG, ENOUGH = 0.7, 0.8, 0.7, 50
"""Start of the evaluated shadow behind a body [half lengths], evaluated part of the rest [1], least length [m], least
number of pixels."""
HALF, FINE = 0.5, 0.004
"""Half the side of the patch around a point, and the side of its pixels [m]."""
HAMMING = 1.3030
"""Width at -3 dB of the peak of a Hamming window's spectrum [1 / length]."""


@dataclass(frozen=True, slots=True)
class StripFrame:
    """Frame of a straight track: along the track, and across it to the side of the sonar."""

    start: Floats
    """North and east of the first ping [m], shape (2,)."""
    axes: Floats
    """Unit vectors along and across, north and east each, shape (2, 2)."""
    run: Floats
    """Along-track position of each ping [m], shape (ping,)."""
    height: float
    """Height above the seabed [m]."""

    @classmethod
    def of(cls, recording: xr.Dataset, scenario: Scenario) -> Self:
        """Frame of a recording, from its logged navigation."""
        position, heading = recording["logged_position"].values, float(recording["logged_attitude"].values[0, 0])
        side = np.sign(np.sin(scenario.sonar.mounting.bearing)) or 1.0
        axes = np.array([[np.cos(heading), np.sin(heading)], [-side * np.sin(heading), side * np.cos(heading)]])
        run = (position[:, :2] - position[0, :2]) @ axes[0]
        return cls(position[0, :2], axes, run, scenario.seabed.depth - float(np.mean(position[:, 2])))

    def along_across(self, position: ArrayLike) -> Floats:
        """Along-track and across-track position [m] from north and east, shape (..., 2)."""
        return np.asarray((np.asarray(position, float) - self.start) @ self.axes.T)

    def pixels(self, along: Floats, across: Floats, depth: float) -> Floats:
        """North, east, depth of a grid [m], shape (along, across, 3)."""
        horizontal = self.start + along[:, None, None] * self.axes[0] + across[None, :, None] * self.axes[1]
        return np.concatenate([horizontal, np.full((*horizontal.shape[:2], 1), depth)], axis=2)


def synthetic_aperture(
    recording: xr.Dataset, scenario: Scenario, ping: int | None
) -> tuple[Figure, list[CheckedNumber]]:
    """Draw the strip map, and compute its numbers.

    Args:
        recording: Complete recording of elements.
        scenario: Scenario of the recording.
        ping: Unused: all pings are focused together.
    """
    short, course = compressed(recording, scenario), StripFrame.of(recording, scenario)
    along, across = swath(recording, scenario, course)
    image = focused(short, scenario, course.pixels(along, across, scenario.seabed.depth))
    strip = StripMap(along, across, _level(image), course.run, single_ping_image(short, scenario, course, across))
    points = [response(short, scenario, course, t) for t in scenario.targets if isinstance(t, PointTarget)]
    numbers = [number for point in points for number in point_numbers(point, scenario, course)]
    numbers += shadow_numbers(strip, scenario, course)
    sonar = scenario.sonar
    title = (f"{scenario.title}: {sonar.pulse.frequency / 1e3:g} kHz, band {sonar.pulse.bandwidth / 1e3:g} kHz, "
             f"{recording.sizes['ping']} pings of {sonar.beam_count} elements, aperture "
             f"{aperture(scenario, across[0]):.1f} to {aperture(scenario, across[-1]):.1f} m")  # fmt: skip
    names = [(t.label, *course.along_across(t.position[:2])) for t in scenario.targets]
    return strip_map_view(strip, names, points[:1], title), numbers


def half_angle(scenario: Scenario) -> float:
    """Largest angle off broadside of pings that contribute to a pixel [rad]: -3.9 dB of the narrower one-way beam."""
    wavelength = scenario.water.sound_speed / scenario.sonar.pulse.frequency
    return float(np.arcsin(min(wavelength / (2 * max(*lengths(scenario), wavelength)), 0.9)))


def aperture(scenario: Scenario, across: float) -> float:
    """Length of the synthetic aperture of a pixel [m].

    Args:
        scenario: Scenario of the recording.
        across: Ground range of the pixel [m].
    """
    return float(2 * np.tan(half_angle(scenario)) * across)


def swath(recording: xr.Dataset, scenario: Scenario, course: StripFrame) -> tuple[Floats, Floats]:
    """Pixels of the strip, along and across [m]: those with complete echoes and a complete aperture."""
    speed, pulse = scenario.water.sound_speed, scenario.sonar.pulse
    first, last = recording["time"].values[[0, -1]] * speed / 2
    last -= pulse.duration * speed / 2
    near, far = np.sqrt(np.maximum(np.maximum((first, last), course.height + 0.1) ** 2 - course.height**2, 0.01))
    reach = min(aperture(scenario, float(far)) / 2, 0.4 * float(np.ptp(course.run)))
    steps = np.array(cells(scenario)) / PIXELS_IN_A_CELL
    ends = course.run.min() + reach, course.run.max() - reach
    steps *= max(1.0, float(np.sqrt((ends[1] - ends[0]) * (far - near) / np.prod(steps) / MOST_PIXELS)))
    return np.arange(*ends, steps[0]), np.arange(near, far, steps[1])


def cells(scenario: Scenario) -> tuple[float, float]:
    """Width at -3 dB of a point along the track, and in slant range [m].

    Along the track the aperture is weighted with the patterns of transmitter and element, so that the cell is wider
    than `along_track_resolution`. Source: in range, the width of a sweep under a Hamming window; F. J. Harris (1978),
    Proc. IEEE 66(1), 51-83.
    """
    pulse, speed = scenario.sonar.pulse, scenario.water.sound_speed
    wavelength, widest = speed / pulse.frequency, np.sin(half_angle(scenario))
    sine = np.linspace(-widest, widest, 401)
    weight = np.prod([np.sinc(length * sine / wavelength) for length in lengths(scenario)], axis=0)
    along = np.linspace(-2, 2, 2001) * along_track_resolution(float(half_angle(scenario)), pulse.frequency, speed)
    peak = np.abs(np.exp(4j * np.pi * np.outer(along, sine) / wavelength) @ weight) ** 2
    slant = pulse.duration * speed / 2 if pulse.form == "cw" else HAMMING * speed / (2 * pulse.bandwidth)
    return width(along, np.asarray(level_db(peak), float), 1000), slant


def lengths(scenario: Scenario) -> tuple[float, float]:
    """Length along the track of the transmitter, and of one element [m]; 0 for points."""
    ends = (scenario.sonar.transmit, single_element(scenario.sonar.receive))
    transmit, receive = (float(getattr(end, "width", getattr(end, "length", 0.0))) for end in ends)
    return transmit, receive


def focused(short: xr.Dataset, scenario: Scenario, pixels: Floats) -> NDArray[np.complex64]:
    """Focused image of pixels from the logged navigation; see `backproject`.

    Args:
        short: Elements, compressed.
        scenario: Scenario of the recording.
        pixels: North, east, depth [m], shape (..., 3).
    """
    position, rotation = recorded_poses(short)
    elements = body_to_world(position, rotation, recorded_element_positions(short))
    is_static = scenario.track.stop_and_hop or len(elements) < 2
    return backproject(
        short["pressure"].transpose("ping", "channel", "time").values, short["time"].values,
        body_to_world(position, rotation, recorded_transmitter_position(short)), elements, pixels,
        centre_frequency=scenario.sonar.pulse.frequency, sound_speed=scenario.water.sound_speed,
        receive_velocity=None if is_static else np.gradient(elements, short["ping_time"].values, axis=0),
        track_direction=rotation[:, :, 0], max_angle=half_angle(scenario),
    )  # fmt: skip


def single_ping_image(short: xr.Dataset, scenario: Scenario, course: StripFrame, across: Floats) -> Floats:
    """Level of each single ping over ground range, its elements as one array [dB re 1 uPa], shape (ping, across).

    Args:
        short: Elements, compressed.
        scenario: Scenario of the recording.
        course: Frame of the track.
        across: Ground ranges [m], shape (across,).
    """
    speed, abeam = scenario.water.sound_speed, scenario.sonar.mounting.bearing
    beams = beam_recording(short, [abeam], sound_speed=speed)
    level = np.asarray(recorded_level(beams).transpose("ping", "beam", "time").values[:, 0], float)
    slant = np.asarray(short["time"].values, float) * speed / 2
    return slant_to_ground_range(level, slant, np.full(len(level), course.height), across)


def response(short: xr.Dataset, scenario: Scenario, course: StripFrame, point: PointTarget) -> PointResponse:
    """Focused image around a point target, at a fine spacing.

    Args:
        short: Elements, compressed.
        scenario: Scenario of the recording.
        course: Frame of the track.
        point: Point target; pixels lie at its depth.
    """
    position = course.along_across(point.position[:2])
    off = np.arange(-HALF, HALF + FINE / 2, FINE)
    level = _level(focused(short, scenario, course.pixels(position[0] + off, position[1] + off, point.position[2])))
    top = np.unravel_index(int(np.argmax(level)), level.shape)
    return PointResponse(point.label, off, level - level.max(), (int(top[0]), int(top[1])), float(level.max()),
                 float(position[1]))  # fmt: skip


def point_numbers(point: PointResponse, scenario: Scenario, course: StripFrame) -> list[CheckedNumber]:
    """Position errors and widths of a focused point, compared with theory."""
    row, column = point.top
    along, across = point.level[:, column], point.level[row]
    wide, deep = cells(scenario)
    target = next(t for t in scenario.targets if isinstance(t, PointTarget) and t.label == point.label)
    below = course.height - (scenario.seabed.depth - target.position[2])
    deep *= float(np.hypot(1, below / point.across))
    put, label = "true position of the point", point.label
    error_along = parabolic_peak_position(point.off, along, row) * 100
    error_across = parabolic_peak_position(point.off, across, column) * 100
    return [
        CheckedNumber(f"{label}: along the track, off", error_along, "cm", 0.0, 1.0, put),
        CheckedNumber(f"{label}: across the track, off", error_across, "cm", 0.0, 1.0, put),
        CheckedNumber(f"{label}: width at -3 dB along", width(point.off, along, row) * 100, "cm", wide * 100,
                      wide * 10, "aperture weighted with both beams"),
        CheckedNumber(f"{label}: width at -3 dB across", width(point.off, across, column) * 100, "cm", deep * 100,
                      deep * 10, "Hamming window over the sweep, in ground range"),
    ]  # fmt: skip


def shadow_numbers(strip: StripMap, scenario: Scenario, course: StripFrame) -> list[CheckedNumber]:
    """Levels of the shadows of bodies that are long enough, re the seabed at their range."""
    level, numbers = strip.level - range_trend(strip.level), []
    for target in scenario.targets:
        if isinstance(target, PointTarget):
            continue
        position, half = course.along_across(target.position[:2]), half_extent(target, scenario.scene)
        top = height(target)
        first = position[1] + CLEAR * half
        length = position[1] * course.height / max(course.height - top, 1e-3) - first
        rows = np.abs(strip.along - position[0]) < half / 4
        columns = (strip.across > first) & (strip.across < first + BEHIND * length)
        if length > LONG and rows.sum() * columns.sum() > ENOUGH:
            dark = float(level_db(np.mean(10 ** (level[np.ix_(rows, columns)] / 10))))
            name = f"{target.label}: shadow below the bed"
            numbers.append(CheckedNumber(name, -dark, "dB", 10.0, None, "typical of such images"))
    return numbers


def _level(image: NDArray[np.complex64]) -> Floats:
    return np.asarray(level_db(np.maximum(np.abs(image.astype(complex)) ** 2, 1e-12)), float)
