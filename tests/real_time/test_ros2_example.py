"""The example of a node of ROS 2, with stand-ins for ROS: it pings, and its messages have the fields of their types."""

import importlib.util
import sys
import types
from pathlib import Path

import numpy as np
import pytest

import insonify
from insonify.writers.ros_definitions import message, typestore
from oracles.surveys import sidescan

pytest.importorskip("rosbags")
FILE = Path(__file__).parents[2] / "examples" / "ros2_node.py"
STORE = typestore()


def stand_in(name):
    """Class of a message whose fields are those of its type and no others, as ROS makes them."""
    fields = STORE.fielddefs[name][1]

    def made(self):
        for field, (node, detail) in fields:
            setattr(self, field, stand_in(detail)() if node.name == "NAME" else None)

    return type(name.split("/")[2], (), {"__slots__": [field for field, _ in fields], "__init__": made, "kind": name})


def as_fields(given):
    """Fields of a message of stand-ins by name."""
    return {name: as_fields(value) if hasattr(value := getattr(given, name), "kind") else value
            for name in given.__slots__}  # fmt: skip


class Node:
    """Node that keeps what is published, and its subscriptions and timers."""

    def __init__(self, name):
        self.name, self.published, self.subscribed, self.timers = name, {}, {}, []

    def create_publisher(self, kind, topic, _):
        """A publisher that keeps its messages."""

        def publish(sent):
            assert isinstance(sent, kind)
            self.published.setdefault(topic, []).append(sent)

        return types.SimpleNamespace(publish=publish)

    def create_subscription(self, kind, topic, callback, _):
        """Keep the callback."""
        self.subscribed[topic] = kind, callback

    def create_timer(self, period, callback):
        """Keep the period and the callback."""
        self.timers.append((period, callback))

    def get_clock(self):
        """A clock that stands."""
        return types.SimpleNamespace(now=lambda: types.SimpleNamespace(nanoseconds=5_000_000_000))


@pytest.fixture
def nodes(monkeypatch):
    """Stand-ins for ROS; nodes that are spun, whose sonars are closed at the end."""
    spun = []
    modules = {
        "rclpy": {"init": lambda args: None, "spin": spun.append}, "rclpy.node": {"Node": Node},
        "rclpy.qos": {"QoSProfile": lambda **_: None, "DurabilityPolicy": types.SimpleNamespace(TRANSIENT_LOCAL=1)},
        "nav_msgs.msg": {"Odometry": stand_in("nav_msgs/msg/Odometry")},
        "marine_acoustic_msgs.msg": {"RawSonarImage": stand_in("marine_acoustic_msgs/msg/RawSonarImage")},
        "marine_interfaces.msg": {"SonarInfo": stand_in("marine_interfaces/msg/SonarInfo")},
    }  # fmt: skip
    for name, content in modules.items():
        for part in (name.split(".")[0], name):
            if part not in sys.modules:
                monkeypatch.setitem(sys.modules, part, types.ModuleType(part))
        for key, value in content.items():
            setattr(sys.modules[name], key, value)
    yield spun
    for node in spun:
        node.sonar.close()


@pytest.mark.parametrize("field", ["incoherent", "coherent"])
def test_the_example_publishes_pings_of_the_poses_it_gets(nodes, monkeypatch, tmp_path, field):
    """Samples are those of the live sonar at the same pose, heading east, starboard side down; not too often."""
    if not FILE.is_file():
        pytest.skip("no examples here: an installation, not a checkout")
    scenario = sidescan(field=field, track={"start": (0.0, 0.0, 6.0), "heading": "90 deg", "motion": {}})
    with insonify.live(scenario, threads=1) as sonar:
        path = tmp_path / "survey.yaml"
        path.write_text(sonar.attributes["scenario"], encoding="utf-8")
        sonar.ping(0.0, (0.0, 0.0, 6.0), (np.pi / 2, 0.0, 0.1))
        alone = sonar.ping(0.1, (0.0, 0.2, 6.0), (np.pi / 2, 0.0, 0.1))
    monkeypatch.setattr(sys, "argv", ["ros2_node.py", str(path)])
    spec = importlib.util.spec_from_file_location("ros2_node", FILE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.main()
    (node,) = nodes
    kind, ping = node.subscribed["odometry"]
    for nanoseconds, east in ((0, 0.0), (50_000_000, 0.1), (100_000_000, 0.2)):  # the second comes too early
        odometry = kind()
        odometry.header.stamp.sec, odometry.header.stamp.nanosec = 0, nanoseconds
        place, turn = odometry.pose.pose.position, odometry.pose.pose.orientation
        place.x, place.y, place.z = east, 0.0, -6.0
        turn.x, turn.y, turn.z, turn.w = np.sin(0.05), 0.0, 0.0, np.cos(0.05)  # bow east, port side up
        ping(odometry)
    expected = alone[{"incoherent": "intensity", "coherent": "pressure"}[field]].values[0]
    for channel, side in enumerate(("port", "starboard")):
        info, images = node.published[f"/sonar/{side}/sonar_info"], node.published[f"/sonar/{side}/raw_image"]
        assert len(images) == 2 and len(info) == 1
        for sent in (info[0], *images):
            STORE.serialize_cdr(message(STORE, sent.kind, as_fields(sent)), sent.kind)
        given = np.frombuffer(bytes(images[1].image.data), {"incoherent": "<f8", "coherent": "<f4"}[field])
        np.testing.assert_allclose(given, np.abs(expected[channel]), rtol=1e-6)
        assert images[1].header.stamp.nanosec == 100_000_000 and info[0].intensity_reference == 2
    assert [period for period, _ in node.timers] == [10.0]
