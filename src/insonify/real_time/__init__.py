"""Real time: one ping at a time, from the pose that another program has at that moment, and servers that offer it."""

from insonify.real_time.live_sonar import LiveSonar, live
from insonify.real_time.platform_pose import PlatformPose
from insonify.real_time.tcp_server import TcpServer

__all__ = ["LiveSonar", "PlatformPose", "TcpServer", "live"]
