"""Ping360 and Ping1D: unmodified clients of their maker read them, and hostile datagrams leave them at work."""

import socket
import struct
import time
import warnings

import numpy as np
import pytest

from insonify.real_time.ping1d import Ping1D
from insonify.real_time.ping360 import Ping360
from insonify.real_time.ping_protocol import Message, messages, packed
from oracles.scenes import nominal, point


def scene(bearing, tilt, target):
    """A point in silent water before a small transducer, 5 m deep; 30 m of range."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return nominal(
            targets=[target], field="incoherent", paths={"contributions": ("target",), "max_reflections": 0},
            line={"kind": "planar", "length": None, "width": 0.04, "height": 0.04},
            sonar={"mounting": {"bearing": bearing, "tilt": tilt}},
            track={"position": (0.0, 0.0, 5.0), "window": (0.0, 0.04), "interval": 0.1},
        )  # fmt: skip


@pytest.fixture(scope="module")
def scanning():
    """A Ping360 that faces north at angle 0, and a point 12 m to the east of it."""
    with Ping360(scene(0.0, 0.0, point(0.0, 12.0, 5.0)), threads=1).start() as made:
        yield made


@pytest.fixture(scope="module")
def echosounder():
    """A Ping1D 5 m deep, and a point 8 m below it."""
    with Ping1D(scene(0.0, np.pi / 2, point(0.0, 0.0, 13.0)), threads=1).start() as made:
        yield made


def client(name, device):
    """Client of the maker's own package."""
    made = getattr(pytest.importorskip("brping"), name)()
    made.connect_udp(*device.address)
    return made


def test_a_client_turns_the_head_to_the_echo(scanning):
    """Strongest at 100 gradians, to the east, at 12 m; settings are read back, and wrong ones are refused."""
    sonar = client("Ping360", scanning)
    assert any(sonar.initialize() for _ in range(20)) and sonar.get_device_information()["device_type"] == 2
    assert sonar.get_protocol_version()["version_major"] == 1
    assert sonar.set_number_of_samples(1000).message_id == 2300
    assert sonar.set_sample_period(1200).sample_period == 1200  # 30 us a sample
    highest = {}
    for angle in (0, 80, 100, 120, 300):
        data = sonar.transmitAngle(angle)
        assert data.message_id == 2300 and data.angle == angle and len(data.data) == 1000
        highest[angle] = max(data.data)
        if angle == 100:
            first = int(np.argmax(np.frombuffer(data.data, np.uint8))) + 0.5
            assert first * 30e-6 * 1500 / 2 == pytest.approx(12, abs=0.3)
    assert max(highest, key=highest.get) == 100 and highest[100] > highest[300]
    assert sonar.set_gain_setting(9).message_id == 2
    assert sonar.transmitAngle(400).message_id == 2


def test_a_sector_is_scanned_there_and_back(scanning):
    """Measurements come unasked, at angles that turn at both ends, until the motor is switched off."""
    sonar = client("Ping360", scanning)
    assert any(sonar.initialize() for _ in range(20))  # it waits for half a second alone
    sonar.control_auto_transmit(1, 1, 200, 1200, 100, 500, 90, 94, 2, 0)
    angles = [sonar.wait_message([2301], 20).angle for _ in range(6)]
    assert angles == [90, 92, 94, 92, 90, 92]
    sonar.control_motor_off()
    assert sonar.wait_message([1], 20) is not None


def test_a_client_measures_the_depth(echosounder):
    """Distance of the point within 5 cm, by the sound speed that the client has set; profiles come continuously."""
    sonar = client("Ping1D", echosounder)
    assert any(sonar.initialize() for _ in range(20))  # it waits for half a second alone
    assert sonar.get_distance()["distance"] == pytest.approx(8000, abs=50)
    # brping 0.2.5 sends 0 here: it takes the names of another device's fields
    sonar.write(packed(Message(1002, struct.pack("<I", 1_650_000))))
    found = sonar.get_profile()
    assert found["distance"] == pytest.approx(8800, abs=55) and len(found["profile_data"]) == 200
    assert found["confidence"] == 100
    sonar.write(packed(Message(1003, b"\0")) + packed(Message(1001, struct.pack("<II", 2000, 10_000))))
    found = sonar.get_profile()
    assert (found["scan_start"], found["scan_length"]) == (2000, 10_000)
    highest = int(np.argmax(np.frombuffer(found["profile_data"], np.uint8)))
    assert 2000 + (highest + 0.5) * 50 == pytest.approx(8800, abs=100)
    sonar.control_continuous_start(1300)
    numbers = [sonar.wait_message([1300], 20).ping_number for _ in range(3)]
    assert numbers[2] > numbers[0]
    sonar.control_continuous_stop(1300)


def test_messages_survive_a_round_trip_and_noise():
    """Two messages in a datagram, rubbish between them, are both read; a changed byte or a cut end is not."""
    sent = [Message(6, b"\x04\x00"), Message(2601, bytes(range(14)), 3, 4)]
    together = b"BRBxx".join(packed(one) for one in sent)
    assert list(messages(b"B" + together)) == sent
    whole = packed(sent[1])
    for place in range(len(whole)):
        broken = bytearray(whole)
        broken[place] ^= 0x10
        assert list(messages(bytes(broken))) == [] and list(messages(whole[:place])) == []


def test_hostile_datagrams_are_refused_or_dropped(scanning):
    """Unknown messages and wrong lengths get a refusal with their number; rubbish gets nothing; the device goes on."""
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.settimeout(10)
    random = np.random.default_rng(1)
    for size in (0, 1, 9, 1400, 60_000):
        out.sendto(random.bytes(size), scanning.address)
    out.sendto(b"BR\xff\xff" + bytes(50), scanning.address)
    time.sleep(0.2)
    for sent in (Message(9999, b""), Message(2601, b"\x01"), Message(6, b""), Message(6, struct.pack("<H", 777))):
        out.sendto(packed(sent), scanning.address)
        (reply,) = messages(out.recv(4096))
        assert reply.number == 2
    for _ in range(2000):
        out.sendto(packed(Message(6, struct.pack("<H", 5)))[:-1], scanning.address)
    time.sleep(2)  # the system drops what its buffer cannot hold
    out.sendto(packed(Message(6, struct.pack("<H", 5))), scanning.address)
    assert next(messages(out.recv(4096))).number == 5


def replies(device, *sent):
    """Replies of a device to messages, one datagram each."""
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.settimeout(20)
    found = []
    for message in sent:
        out.sendto(packed(message), device.address)
        found.append(next(messages(out.recv(4096))))
    return found


def test_a_refused_command_changes_no_setting(scanning):
    """One value out of range, at the end of the message: a refusal, and the measurement has the settings before."""
    good = struct.pack("<BBHHHHHBB", 1, 1, 10, 100, 80, 500, 200, 0, 0)
    wrong = [
        Message(2601, struct.pack("<BBHHHHHBB", 1, 2, 400, 100, 90, 600, 300, 0, 0)),
        Message(2601, struct.pack("<BBHHHHHBB", 1, 2, 20, 100, 90, 600, 100, 0, 0)),
        Message(2602, struct.pack("<BBHHHHHHBB", 1, 2, 100, 90, 600, 300, 1, 2, 11, 0)),
        Message(2602, struct.pack("<BBHHHHHHBB", 1, 2, 100, 90, 600, 300, 1, 2, 1, 101)),
    ]
    before, *refusals, after = replies(scanning, Message(2601, good), *wrong, Message(6, struct.pack("<H", 2300)))
    assert [reply.number for reply in (before, *refusals, after)] == [2300, 2, 2, 2, 2, 2300]
    assert after.payload == before.payload


def test_reserved_numbers_of_a_device_are_refused(scanning, echosounder):
    """0 is unknown and 255 addresses all: 1 to 254 for all devices, 0 to 254 for a Ping1D's own message."""
    for device, kind, form, allowed in (
        (scanning, 100, "<B", (1, 254)), (scanning, 2000, "<Bx", (1, 254)), (echosounder, 1000, "<B", (0, 254)),
    ):  # fmt: skip
        found = replies(device, *(Message(kind, struct.pack(form, number)) for number in (0, 1, 254, 255)))
        assert [reply.number for reply in found] == [1 if number in range(allowed[0], 255) else 2
                                                     for number in (0, 1, 254, 255)]  # fmt: skip
        assert [reply.source for reply in found][1:] == [1, 254, 254]


def test_a_datagram_full_of_headers_costs_no_more_than_its_length():
    """60 000 bytes that are all starts of whole messages: a tenth of a second, not a sum for each start."""
    begin = time.process_time()
    assert list(messages(b"BR" * 30_000)) == []
    hostile = bytearray(b"BR\x00\x70" * 15_000)
    assert list(messages(bytes(hostile))) == []
    assert time.process_time() - begin < 1.0


def test_a_datagram_of_thousands_of_commands_gets_a_reply_in_part(scanning):
    """Of 2000 pings in one datagram 16 are made; the device then replies to others."""
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.settimeout(60)
    ping = struct.pack("<BBHHHHHBB", 1, 1, 0, 100, 80, 500, 200, 1, 0)
    out.sendto(packed(Message(2601, ping)) * 2000, scanning.address)
    out.sendto(packed(Message(6, struct.pack("<H", 5))), scanning.address)
    numbers = [next(messages(out.recv(4096))).number for _ in range(17)]
    assert numbers == [2300] * 16 + [5]


@pytest.mark.parametrize(("kind", "begin"), [
    (Ping360, Message(2602, struct.pack("<BBHHHHHHBB", 1, 1, 100, 80, 500, 200, 0, 399, 1, 0))),
    (Ping1D, Message(1400, struct.pack("<H", 1300))),
])  # fmt: skip
def test_pings_that_fail_again_and_again_are_no_flood(kind, begin):
    """A vehicle above the water: a refusal with the reason twice a second, not as fast as pings can fail."""
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with kind(
        scene(0.0, 0.0, point(0.0, 12.0, 5.0)), threads=1, pose=lambda _: {"position": (0, 0, -5.0)}
    ).start() as made:
        out.sendto(packed(begin), made.address)
        end, refused = time.monotonic() + 1.2, []
        while (left := end - time.monotonic()) > 0:
            out.settimeout(left)
            try:
                refused += [message for message in messages(out.recv(4096)) if message.number == 2]
            except TimeoutError:
                break
    assert 2 <= len(refused) <= 4 and all(b"above the sea surface" in message.payload for message in refused)
