"""Bag of ROS 2 (MCAP): pings in marine_acoustic_msgs, what their numbers mean in SonarInfo, poses and transforms.

A bag holds what a driver would publish: amplitudes of beams as they were received (powers of an expected intensity),
the same as counts for displays, and the detections of a multibeam that was recorded by its elements.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from insonify.demos.products import product_kind
from insonify.demos.products.multibeam import BEAMS, WIDEST
from insonify.formats.store_description import StoreError
from insonify.frames import pose_rotation
from insonify.records.recording import FIELDS
from insonify.surveys.ground_lines import slant_ranges
from insonify.surveys.survey import START, Survey
from insonify.writers import ros_messages as made
from insonify.writers.ros_definitions import message, typestore
from insonify.writers.ros_fans import Fan, fans, swath_fan
from insonify.writers.swath import Swath, arrays, surface_speed, swaths

Floats = NDArray[np.float64]

SONAR, SECOND = "marine_acoustic_msgs/msg/", 1_000_000_000
HEARTBEAT = 10 * SECOND
"""Longest time between two messages of SonarInfo, so that each part of a divided bag has one [ns]."""


class _PingSamples(NamedTuple):
    """Samples of one ping."""

    samples: NDArray[Any]
    """Amplitudes in single precision [uPa] or powers in double precision [uPa^2], shape (channel, time)."""
    ranges: Floats
    """Ranges of the samples [m], shape (time,)."""
    sound_speed: float
    """Sound speed by which ranges and beams are computed [m/s]."""
    swath: Swath | None = None
    """Detections of a multibeam."""


def write_rosbag(survey: Survey, path: Path) -> None:
    """Write a bag with pings, their meaning, poses and transforms.

    Args:
        survey: Recording of beams, or of a multibeam's elements.
        path: File to write.
    """
    survey.require_one_platform("a bag")
    multibeam = product_kind(survey.scenario) == "multibeam"
    if multibeam:
        sides = [swath_fan(survey.scenario, arrays(survey).receiver, np.linspace(-WIDEST, WIDEST, BEAMS))]
    else:
        survey.require_beams("a bag")
        sides = fans(survey.scenario)
    stamps = [START * SECOND + round(float(t) * SECOND) for t in survey.recording["ping_time"].values[survey.rows]]
    with TemporaryDirectory(dir=path.parent, prefix=f"{path.stem}.") as folder:
        with _Bag(Path(folder) / "recording", survey) as bag:
            bag.put("/tf_static", "tf2_msgs/msg/TFMessage", stamps[0], made.sonar_transforms(stamps[0], sides))
            stated = -HEARTBEAT
            for number, ping in enumerate(_swath_pings(survey) if multibeam else _pings(survey)):
                stamp = stamps[number]
                if stamp - stated >= HEARTBEAT:
                    _put_meaning(bag, survey, sides, stamp)
                    stated = stamp
                _put_poses(bag, survey, number, stamp)
                for fan in sides:
                    _put_ping(bag, survey, fan, number, (stamp, ping))
        os.replace(Path(folder) / "recording" / "recording.mcap", path)


class _Bag:
    """Bag that is written; topics are added as their messages come."""

    def __init__(self, folder: Path, survey: Survey) -> None:
        """Prepare a bag.

        Args:
            folder: Folder to make.
            survey: What its custom data describe.
        """
        from rosbags.rosbag2 import StoragePlugin, Writer

        self._types, self._topics = typestore(), dict[str, Any]()
        self._writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        for name in ("title", "scenario", "version"):
            self._writer.set_custom_data(name, str(survey.recording.attrs.get(name, "")))

    def __enter__(self) -> Self:
        """Open the file."""
        self._writer.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self._writer.__exit__(kind, fault, trace)

    def put(self, topic: str, kind: str, stamp: int, fields: made.Fields) -> None:
        """Write one message.

        Args:
            topic: Name of the topic.
            kind: Type of the message.
            stamp: Time [ns since 1970].
            fields: All of its fields.
        """
        if topic not in self._topics:
            latched = topic == "/tf_static" or topic.endswith("sonar_info")
            self._topics[topic] = self._writer.add_connection(
                topic, kind, typestore=self._types, offered_qos_profiles=[_quality(latched)]
            )
        content = self._types.serialize_cdr(message(self._types, kind, fields), kind)
        self._writer.write(self._topics[topic], stamp, content)


def _quality(latched: bool) -> Any:
    """Quality of service: reliable; the last message is kept for later subscribers, or none."""
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

    never = QosTime(9_223_372_036, 854_775_807)
    durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
    return Qos(QosHistory.KEEP_LAST, 1 if latched else 10, QosReliability.RELIABLE, durability, never, never,
               QosLiveliness.AUTOMATIC, never, False)  # fmt: skip


def _pings(survey: Survey) -> Iterator[_PingSamples]:
    """Pings of a recording of beams, as they were recorded."""
    field = next((name for name in FIELDS if name in survey.recording), None)
    if field is None:
        raise StoreError(f"{survey.name} has the lines of a recorder alone. Keep the pressure beside them in the "
                         "scenario, or write them as xtf-recorded (.xtf) or netCDF (.nc)")  # fmt: skip
    sound, ranges = survey.recording[field].transpose("ping", "channel", "time"), slant_ranges(survey)
    for row in survey.rows:
        values = sound[int(row)].values
        yield _PingSamples(np.abs(values) if field == "pressure" else values, ranges, survey.scenario.water.sound_speed)


def _swath_pings(survey: Survey) -> Iterator[_PingSamples]:
    """Pings of a multibeam: the beams that its detections are made of."""
    time = survey.sample_time
    for number, swath in enumerate(swaths(survey)):
        speed = surface_speed(survey, number)
        yield _PingSamples((10 ** (swath.level / 20)).astype(np.float32), time * speed / 2, speed, swath)


def _put_meaning(bag: _Bag, survey: Survey, sides: list[Fan], stamp: int) -> None:
    """Write the meaning of the numbers of each stream."""
    power = "intensity" in survey.recording
    for fan in sides:
        for display, topic in ((False, fan.topic), (True, f"{fan.topic}/display")):
            head = made.header(stamp, fan.frame)
            fields = made.sonar_info(head, survey.scenario, fan, power=power, display=display, version=survey.version)
            bag.put(f"{topic}/sonar_info", "marine_interfaces/msg/SonarInfo", stamp, fields)


def _put_poses(bag: _Bag, survey: Survey, number: int, stamp: int) -> None:
    """Logged pose with its transform and its position on Earth, and the true pose."""
    logged = survey.position[number], survey.attitude[number]
    row, pose = int(survey.rows[number]), "geometry_msgs/msg/PoseStamped"
    true = (np.asarray(survey.recording[name].values[row], float) for name in ("position", "attitude"))
    moved = {"transforms": [made.platform_transform(stamp, *logged)]}
    bag.put("/tf", "tf2_msgs/msg/TFMessage", stamp, moved)
    bag.put("/navigation/pose", pose, stamp, made.pose_stamped(stamp, *logged))
    bag.put("/ground_truth/pose", pose, stamp, made.pose_stamped(stamp, *true))
    if survey.frame.origin is not None:
        latitude, longitude, _ = (float(column[number]) for column in survey.pose_on_earth)
        fields = made.fix(stamp, latitude, longitude, float(logged[0][2]))
        bag.put("/navigation/fix", "sensor_msgs/msg/NavSatFix", stamp, fields)


def _put_ping(bag: _Bag, survey: Survey, fan: Fan, number: int, sent: tuple[int, _PingSamples]) -> None:
    """Images of one side, and the detections of a multibeam."""
    stamp, ping = sent
    head, info = made.header(stamp, fan.frame), made.ping_info(survey.scenario, fan, ping.sound_speed)
    time, samples = survey.sample_time, ping.samples[fan.channels]
    power = samples.astype(float) if "intensity" in survey.recording else samples.astype(float) ** 2
    counts = made.display_counts(survey.scenario, power)
    bag.put(f"{fan.topic}/raw_image", SONAR + "RawSonarImage", stamp, made.raw_image(head, info, fan, time, samples))
    bag.put(f"{fan.topic}/display/projected_image", SONAR + "ProjectedSonarImage", stamp,
            made.projected_image(head, info, fan, ping.ranges, counts))  # fmt: skip
    swath = ping.swath
    if swath is None:
        return
    sample = np.clip(np.nan_to_num((swath.travel_time - time[0]) / survey.sample_interval), 0, time.size - 1)
    amplitude = samples[np.arange(len(samples)), np.rint(sample).astype(int)].astype(float)
    amplitude[np.isnan(swath.travel_time)] = np.nan
    points = swath.sounding @ pose_rotation(0.0, *survey.attitude[number, 1:]) - fan.position
    bag.put(f"{fan.topic}/detections", SONAR + "SonarDetections", stamp,
            made.detections(head, info, fan, swath.travel_time, amplitude))  # fmt: skip
    bag.put(f"{fan.topic}/ranges", SONAR + "SonarRanges", stamp,
            made.sonar_ranges(head, info, fan, points, amplitude))  # fmt: skip
