"""The TCP server: the same samples as the sonar itself, and a result or an end for every hostile client."""

import json
import socket
import struct
import time
import warnings

import numpy as np
import pytest

import insonify
from insonify.real_time import tcp_server
from insonify.real_time.tcp_server import MAX_CONNECTIONS, MAX_LINE, TcpServer
from insonify.validity import PhysicsWarning
from oracles.scenes import nominal, point


class Client:
    """A client as the protocol describes it, with the standard library alone."""

    def __init__(self, address, hello=True):
        self.socket = socket.create_connection(address, timeout=60)
        self.file = self.socket.makefile("rb")
        self.hello = json.loads(self.file.readline()) if hello else None

    def request(self, **request):
        """Reply to one request, and its arrays."""
        self.socket.sendall(json.dumps(request).encode() + b"\n")
        return self.reply()

    def reply(self):
        """Reply that comes next."""
        head = json.loads(self.file.readline())
        arrays = {
            one["name"]: np.frombuffer(self.file.read(one["bytes"]), one["dtype"]).reshape(one["shape"])
            for one in head.get("arrays", ())
        }
        return head, arrays


@pytest.fixture(scope="module")
def sonar():
    """A point echo in still water, in some microseconds of samples."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = nominal(targets=[point(0.0, 10.0, 15.0)], paths={"contributions": ("target",)},
                        track={"window": (0.012, 0.016)}, field="incoherent")  # fmt: skip
    with insonify.live(scene, threads=1, warm_up=False) as made:
        yield made


@pytest.fixture
def server(sonar):
    """A server on any free port of the loopback address."""
    with TcpServer(sonar, port=0).start() as made:
        yield made


POSE = {"position": [0, 0, 11], "attitude": [0.01, 0, 0]}


def test_samples_are_those_of_the_sonar(server, sonar):
    """Bit for bit, with number and logged pose; each connection counts its own pings."""
    assert server.address[0] == "127.0.0.1"
    first, second = Client(server.address), Client(server.address)
    assert first.hello["protocol"] == "insonify-live" and first.hello["version"] == 1
    head, arrays = first.request(id=7, method="ping", time=0.0, **POSE)
    alone = sonar.sequence().ping(0.0, **POSE)
    np.testing.assert_array_equal(arrays["intensity"], alone["intensity"].values[0])
    assert head["id"] == 7 and head["ping"] == 0 and head["poses"]["logged_position"] == [0, 0, 11]
    assert first.request(method="ping", time=1.0, **POSE)[0]["ping"] == 1
    assert second.request(id="a", method="ping", time=0.5, **POSE)[0]["ping"] == 0
    first.request(method="restart")
    assert first.request(method="ping", time=0.0, **POSE)[0]["ping"] == 0
    about, _ = first.request(method="describe")
    assert len(about["axes"]["time"]) == arrays["intensity"].shape[-1] and about["field"] == "intensity"


def test_a_reply_has_the_warnings_of_its_ping():
    """A position off the track: once in a sequence, with the reply of its ping, and in the server's process too."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = nominal(targets=[point(0.0, 10.0, 15.0)], paths={"contributions": ("target",)},
                        track={"window": (0.012, 0.016)})  # fmt: skip
    off = {"position": [0, 5, 11], "attitude": [0.01, 0, 0]}
    with (
        pytest.warns(PhysicsWarning, match="off the scenario's track") as issued,
        insonify.live(scene, threads=1, warm_up=False) as made,
        TcpServer(made, port=0).start() as server,
    ):
        client = Client(server.address)
        assert client.request(method="ping", time=0.0, **POSE)[0]["warnings"] == []
        head, arrays = client.request(method="ping", time=1.0, **off)
        (word,) = head["warnings"]
        assert word.startswith("position [0.0, 5.0, 11.0] m is off the scenario's track") and arrays
        assert client.request(method="ping", time=2.0, **off)[0]["warnings"] == []
    assert [str(one.message) for one in issued] == [word]


WRONG = [
    (b"hello", "syntax"), (b"[1]", "syntax"), (b"[" * 60000, "syntax"), (b"\xff\xfe", "syntax"), (b"", "syntax"),
    (b'{"method": "quit"}', "method"), (b'{"method": ["ping"]}', "method"),
    (b'{"id": {}, "method": "ping"}', "argument"),
    (b'{"version": 2, "method": "ping"}', "version"), (b'{"method": "ping"}', "argument"),
    (b'{"method": "ping", "time": NaN, "position": [0, 0, 11]}', "argument"),
    (b'{"method": "ping", "time": 1e999, "position": [0, 0, 11]}', "argument"),
    (b'{"method": "ping", "time": 0, "position": [0, 0, 99]}', "argument"),
    (b'{"method": "ping", "time": 0, "position": {"a": 1}}', "argument"),
    (b'{"method": "ping", "time": 0, "position": [0, 0, 11], "gain": 3}', "argument"),
    (b'{"method": "ping", "time": 0, "position": [0, 0, 11], "receiver": 3}', "argument"),
    (b'{"method": "ping", "time": 0, "position": [0, 0, 11], "window_poses": [1, 2]}', "argument"),
    (b'{"method": "describe", "id": ' + b"9" * 5000 + b"}", "syntax"),
]  # fmt: skip


def test_wrong_requests_get_error_codes(server):
    """One connection survives them all, and pings afterwards."""
    client = Client(server.address)
    for line, code in WRONG:
        client.socket.sendall(line + b"\n")
        head, _ = client.reply()
        assert head["error"]["code"] == code, (line[:60], head)
    assert "error" not in client.request(method="ping", time=0.0, **POSE)[0]


def test_failures_get_a_reply(server, monkeypatch):
    """An unexpected error is a reply, and the connection goes on."""

    def broken(*_):
        raise MemoryError("too much")

    client = Client(server.address)
    monkeypatch.setitem(tcp_server.METHODS, "describe", broken)
    assert client.request(method="describe")[0]["error"]["code"] == "failed"
    assert "error" not in client.request(method="restart")[0]


def test_endless_lines_and_silence_end_the_connection(server, sonar):
    """A line beyond the limit is reported and dropped, half a line and silence are dropped in the idle time."""
    long = Client(server.address)
    long.socket.sendall(b"x" * (MAX_LINE + 2))
    assert json.loads(long.file.readline())["error"]["code"] == "too long"
    with TcpServer(sonar, port=0, idle_seconds=0.3).start() as hasty:
        half = Client(hasty.address)
        half.socket.sendall(b'{"method": "pi')
        assert half.file.readline() == b""
    assert "error" not in Client(server.address).request(method="restart")[0]


def test_slow_readers_and_resets_do_not_stop_others(server):
    """Requests without a reader, and connections that are reset in the middle of a reply, leave the server at work."""
    slow = Client(server.address)
    slow.socket.settimeout(0.5)
    with pytest.raises(OSError):  # in the end the server stops to read: no memory grows
        for _ in range(100_000):
            slow.socket.sendall(b'{"method": "describe"}\n' * 100)
    for _ in range(5):
        rude = Client(server.address)
        rude.socket.sendall(b'{"method": "describe"}\n' * 20)
        rude.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        rude.file.close()
        rude.socket.close()
    assert "error" not in Client(server.address).request(method="ping", time=0.0, **POSE)[0]


def test_connections_are_limited(server):
    """One more than allowed is refused with advice; when one ends, another is let in."""
    clients = [Client(server.address) for _ in range(MAX_CONNECTIONS)]
    refused = Client(server.address)
    assert refused.hello["error"]["code"] == "busy"
    clients.pop().socket.shutdown(socket.SHUT_RDWR)
    deadline = time.monotonic() + 10
    while "error" in Client(server.address).hello:
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_a_request_that_trickles_in_is_dropped_in_the_idle_time(sonar):
    """A byte now and then keeps no connection open: the whole request has to come in time."""
    with TcpServer(sonar, port=0, idle_seconds=0.5).start() as hasty:
        slow, begin = Client(hasty.address), time.monotonic()
        with pytest.raises(OSError):
            while time.monotonic() - begin < 20:
                slow.socket.sendall(b" ")
                time.sleep(0.1)
        assert time.monotonic() - begin < 10
        quick = Client(hasty.address)
        quick.socket.sendall(b'{"method": "restart"}\n' * 5000 + b'{"method": "rest')  # more than one request's length
        assert all("error" not in quick.reply()[0] for _ in range(5000))


def test_a_connection_that_is_aborted_before_it_is_accepted_ends_nothing(sonar, monkeypatch):
    """Faults of accepting, and too few descriptors, leave the server at work."""
    server = TcpServer(sonar, port=0)
    faults = iter([ConnectionAbortedError(103, "aborted"), OSError(24, "too many open files")])

    class Faulty:
        def __init__(self, bound):
            self.bound = bound

        def accept(self):
            """Two faults, then connections."""
            for fault in faults:
                raise fault
            return self.bound.accept()

        def __getattr__(self, name):
            return getattr(self.bound, name)

    monkeypatch.setattr(server, "_socket", Faulty(server._socket))
    with server.start():
        assert "error" not in Client(server.address).request(method="restart")[0]


LONG = int("9" * 400)


@pytest.mark.parametrize(("given", "message"), [
    ({"time": LONG}, "time is '99999"),
    ({"time": 1e300}, "1e+12 s at most"),
    ({"position": [LONG, 0, 11]}, "position is [99999"),
    ({"attitude": [0, LONG, 0]}, "attitude is [0, 99999"),
    ({"window_poses": [1, 2]}, "window_poses has 1; give two of (position, attitude)"),
    ({"window_poses": "ab"}, "window_poses has 'a'"),
    ({"window_poses": [[[0, 0, 11], [0, 0, 0]], [[9e6, 0, 11], [0, 0, 0]]]}, "faster than 100 m/s"),
])  # fmt: skip
def test_arguments_beyond_all_limits_get_a_remedy(server, given, message):
    """Whole numbers of hundreds of digits, times without phase, and platforms at the speed of light."""
    reply, _ = Client(server.address).request(method="ping", **{"time": 0.0, "position": [0, 0, 11]} | given)
    assert reply["error"]["code"] == "argument" and message in reply["error"]["message"]
    assert len(reply["error"]["message"]) < 300
