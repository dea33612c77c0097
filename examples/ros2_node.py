"""Node of ROS 2 that pings a simulated sonar from the poses of a vehicle: an example, not run against ROS here.

It takes nav_msgs/Odometry in a map frame (x east, y north, z up), pings at most as often as the scenario's sonar does,
and publishes marine_acoustic_msgs/RawSonarImage with marine_interfaces/SonarInfo, for each side of the sonar.

    python3 examples/ros2_node.py harbour.yaml --ros-args -r odometry:=/vehicle/odometry
"""

import sys
from array import array

import numpy as np
import rclpy
from marine_acoustic_msgs.msg import RawSonarImage
from marine_interfaces.msg import SonarInfo
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation

import insonify
from insonify.writers import ros_fans, ros_messages


def fill(message, fields):
    """Fill a message from a mapping; those within it likewise."""
    for name, value in fields.items():
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        elif isinstance(value, np.ndarray):
            setattr(message, name, array("B" if value.dtype == np.uint8 else "f", value.tolist()))
        else:
            setattr(message, name, value)
    return message


class SonarNode(Node):
    """Publishes one ping for the latest pose, not before the ping interval of the scenario is over."""

    def __init__(self, path):
        """Prepare the sonar of a scenario file."""
        super().__init__("insonify")
        self.scenario = insonify.load_scenario(path)
        self.sonar, self.fans = insonify.live(self.scenario), ros_fans.fans(self.scenario)
        self.interval, self.last = round(1e9 * getattr(self.scenario.track, "interval", 0)), None
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.images = [self.create_publisher(RawSonarImage, f"{fan.topic}/raw_image", 10) for fan in self.fans]
        self.infos = [self.create_publisher(SonarInfo, f"{fan.topic}/sonar_info", latched) for fan in self.fans]
        self.create_subscription(Odometry, "odometry", self.ping, 1)
        self.create_timer(10.0, self.state)

    def state(self):
        """Publish the meaning of the samples."""
        stamp, power = self.get_clock().now().nanoseconds, self.scenario.field == "incoherent"
        for fan, publisher in zip(self.fans, self.infos, strict=True):
            head = ros_messages.header(stamp, fan.frame)
            publisher.publish(fill(SonarInfo(), ros_messages.sonar_info(
                head, self.scenario, fan, power=power, display=False, version="live")))  # fmt: skip

    def ping(self, odometry):
        """Simulate and publish one ping."""
        stamp = odometry.header.stamp.sec * 1_000_000_000 + odometry.header.stamp.nanosec
        if self.last is not None and stamp - self.last < self.interval:
            return
        self.last, place, turn = stamp, odometry.pose.pose.position, odometry.pose.pose.orientation
        axes = ros_fans.MAP @ Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix() @ ros_fans.PLATFORM
        heading, pitch, roll = Rotation.from_matrix(axes).as_euler("ZYX")
        recording = self.sonar.ping(stamp * 1e-9, (place.y, place.x, -place.z), (heading, pitch, roll))
        field = "intensity" if "intensity" in recording else "pressure"
        sound = recording[field].values[0] if field == "intensity" else np.abs(recording[field].values[0])
        for fan, publisher in zip(self.fans, self.images, strict=True):
            head = ros_messages.header(stamp, fan.frame)
            info = ros_messages.ping_info(self.scenario, fan, self.scenario.water.sound_speed)
            fields = ros_messages.raw_image(head, info, fan, recording["time"].values, sound[fan.channels])
            publisher.publish(fill(RawSonarImage(), fields))


def main():
    """Ping until the node is shut down."""
    rclpy.init(args=sys.argv)
    node = SonarNode(sys.argv[1])
    node.state()
    rclpy.spin(node)


if __name__ == "__main__":
    main()
