"""TCP server of a live sonar: requests and replies are lines of JSON, samples follow a reply as bytes.

The protocol is described in `docs/explanation/live-sonar.md`. Each connection has a sequence of pings of its own.
"""

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib.metadata import version
from typing import Any

import numpy as np

from insonify.real_time.live_sonar import LiveSonar
from insonify.real_time.platform_pose import PlatformPose
from insonify.real_time.socket_server import SocketServer

PROTOCOL = "insonify-live"
VERSION = 1
DEFAULT_PORT = 9460
MAX_LINE = 1 << 16
"""Length of the longest request [bytes]."""
MAX_CONNECTIONS = 16
IDLE_SECONDS = 600.0
"""Time without a whole request, or without a reader of a reply, after which a connection is closed [s]."""
MAX_MESSAGE = 1000
"""Length of the longest message of a reply [characters]."""
MAX_WARNINGS = 20
"""Largest number of warnings in a reply."""
PING_ARGUMENTS = ("time", "position", "attitude", "velocity", "turn_rate", "window_poses", "receiver")
POSE_ARGUMENTS = ("position", "attitude", "velocity", "turn_rate", "window_poses")


class RequestError(ValueError):
    """A request that is refused; its code is one of the protocol."""

    def __init__(self, code: str, message: str) -> None:
        """Errors of a request.

        Args:
            code: Code of the protocol.
            message: Problem and remedy.
        """
        super().__init__(message)
        self.code = code


class TcpServer(SocketServer):
    """Server of one sonar; closes with its context, or by `close`.

    Example:
        >>> import json, socket
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> with LiveSonar(scenario) as sonar, TcpServer(sonar, port=0).start() as server:
        ...     with socket.create_connection(server.address) as connection:
        ...         json.loads(connection.makefile().readline())["protocol"]
        'insonify-live'
    """

    def __init__(
        self, sonar: LiveSonar, host: str = "127.0.0.1", port: int = DEFAULT_PORT, *, idle_seconds: float = IDLE_SECONDS
    ) -> None:
        """Bind a server, which serves from `start` or `serve_forever` on.

        Args:
            sonar: The sonar.
            host: Address to bind to; the loopback address by default.
            port: Port; 0: any that is free.
            idle_seconds: Time without a whole request, or a reader, after which a connection is closed [s].

        Raises:
            OSError: Address or port cannot be bound.
        """
        self._sonar, self._idle = sonar, idle_seconds
        super().__init__(socket.create_server((host, port)))
        self._socket.settimeout(0.2)
        self._connections: set[socket.socket] = set()
        self._lock = threading.Lock()

    def serve_forever(self) -> None:
        """Serve until `close`."""
        while not self._stopped.is_set():
            try:
                connection, _ = self._socket.accept()
            except TimeoutError:
                continue
            except OSError:  # the server is closed; or this one was aborted, or there are no descriptors left
                self._stopped.wait(0.05)
                continue
            with self._lock:
                full = len(self._connections) >= MAX_CONNECTIONS
                if not full:
                    self._connections.add(connection)
            if full:
                refusal = _error(None, "busy", f"{MAX_CONNECTIONS} connections are open. Close one of them.")
                connection.settimeout(1.0)
                self._end(connection, refusal)
            else:
                threading.Thread(target=self._converse, args=(connection,), daemon=True).start()

    def close(self) -> None:
        """Close all connections and release the port."""
        self._stopped.set()
        self._socket.close()
        with self._lock:
            for connection in self._connections:
                _shut(connection)
        self._join()

    def _converse(self, connection: socket.socket) -> None:
        """Reply to the requests of one connection until it ends."""
        try:
            connection.settimeout(self._idle)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sonar = self._sonar.sequence()
            connection.sendall(_line({"protocol": PROTOCOL, "version": VERSION, "insonify": version("insonify")}))
            for line in self._requests(connection):
                connection.settimeout(self._idle)
                for part in replies(sonar, line):
                    connection.sendall(part)
        except OSError:  # the other end has gone, or does not read
            pass
        finally:
            _shut(connection)
            connection.close()
            with self._lock:
                self._connections.discard(connection)

    def _requests(self, connection: socket.socket) -> Iterator[bytes]:
        """Whole requests, each complete within the idle time, however slowly its bytes come."""
        known, deadline = b"", time.monotonic() + self._idle
        while True:
            line, end, rest = known.partition(b"\n")
            if len(line) > MAX_LINE:
                return self._end(connection, _error(None, "too long", f"a request has {MAX_LINE} bytes at most"))
            if end:
                yield line
                known, deadline = rest, time.monotonic() + self._idle
                continue
            connection.settimeout(max(deadline - time.monotonic(), 1e-3))
            more = connection.recv(MAX_LINE)
            if not more:
                return None
            known += more

    @staticmethod
    def _end(connection: socket.socket, last: bytes) -> None:
        try:
            connection.sendall(last)
        except OSError:
            pass
        finally:
            _shut(connection)
            connection.close()


def replies(sonar: LiveSonar, line: bytes) -> list[bytes]:
    """Reply to one request: a line, and the bytes of its arrays.

    Args:
        sonar: Sequence of pings of the connection.
        line: The request.
    """
    number: Any = None
    try:
        try:
            request = json.loads(line)
        except (ValueError, RecursionError):
            raise RequestError("syntax", "the line is not JSON") from None
        if not isinstance(request, dict):
            raise RequestError("syntax", 'a request is an object, such as {"method": "describe"}')
        number = request.pop("id", None)
        if not isinstance(number, int | str | None) or isinstance(number, bool) or len(str(number)) > 100:
            number = None
            raise RequestError("argument", "id is a number or a text of 100 characters at most")
        if request.pop("version", VERSION) != VERSION:
            raise RequestError("version", f"the version of the protocol is {VERSION}")
        method = request.pop("method", None)
        if not isinstance(method, str) or method not in METHODS:
            raise RequestError("method", f"method is one of {', '.join(METHODS)}")
        return METHODS[method](sonar, number, request)
    except RequestError as fault:
        return [_error(number, fault.code, str(fault))]
    except (ValueError, TypeError) as fault:
        return [_error(number, "argument", str(fault))]
    except Exception as fault:  # a ping that fails ends neither the connection nor the server
        return [_error(number, "failed", f"{type(fault).__name__}: {fault}")]


def _ping(sonar: LiveSonar, number: Any, request: dict[str, Any]) -> list[bytes]:
    """Samples of one ping, with its logged pose."""
    _require_known(request, PING_ARGUMENTS)
    for name in ("time", "position"):
        if name not in request:
            raise RequestError("argument", f"{name} is missing")
    receiver = request.pop("receiver", None)
    if receiver is not None:
        if not isinstance(receiver, dict) or "position" not in receiver:
            raise RequestError("argument", "receiver is an object with position and attitude")
        _require_known(receiver, POSE_ARGUMENTS)
        request["receiver"] = PlatformPose(**receiver)
    recording, doubts = sonar.ping_and_warnings(**request)
    samples = [str(name) for name in recording.data_vars if "time" in recording[name].dims]
    samples += [str(name) for name in recording.data_vars if "bin" in recording[name].dims]
    arrays, parts = [], []
    for name in samples:
        values = np.ascontiguousarray(recording[name].values[0])
        values = values.astype(values.dtype.newbyteorder("<"), copy=False)
        parts.append(values.tobytes())
        arrays.append({
            "name": name, "dtype": values.dtype.str, "shape": values.shape, "bytes": len(parts[-1]),
            "units": recording[name].attrs.get("units", "1"),
        })  # fmt: skip
    poses = {str(name): recording[name].values[0].tolist() for name in recording.data_vars if name not in samples}
    head = {
        "id": number, "ping": int(recording["ping"].values[0]), "poses": poses, "warnings": _within_a_line(doubts),
        "arrays": arrays,
    }  # fmt: skip
    return [_line(head | {"bytes": sum(map(len, parts))}), *parts]


def _within_a_line(doubts: list[str]) -> list[str]:
    """Warnings of a ping, few and short enough for a reply."""
    return [doubt[:MAX_MESSAGE] for doubt in doubts[:MAX_WARNINGS]]


def _describe(sonar: LiveSonar, number: Any, request: dict[str, Any]) -> list[bytes]:
    """Axes and scenario of all pings."""
    _require_known(request, ())
    layout, attributes = sonar.layout, sonar.attributes
    axes = {name: getattr(layout, name).tolist() for name in ("time", "steer", "side", "element_position")}
    about = {"field": layout.field, "axes": axes, "scenario": attributes["scenario"], "title": attributes["title"]}
    return [_line({"id": number, **about, "arrays": [], "bytes": 0})]


def _restart(sonar: LiveSonar, number: Any, request: dict[str, Any]) -> list[bytes]:
    """Start anew with ping 0."""
    _require_known(request, ())
    sonar.restart()
    return [_line({"id": number, "arrays": [], "bytes": 0})]


METHODS: dict[str, Callable[[LiveSonar, Any, dict[str, Any]], list[bytes]]] = {
    "ping": _ping, "describe": _describe, "restart": _restart
}  # fmt: skip
"""Methods of the protocol."""


def _require_known(given: dict[str, Any], known: tuple[str, ...]) -> None:
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise RequestError("argument", f"{unknown[0][:100]!r} is no argument; there are {', '.join(known) or 'none'}")


def _line(reply: dict[str, Any]) -> bytes:
    return json.dumps(reply, allow_nan=False).encode() + b"\n"


def _error(number: Any, code: str, message: str) -> bytes:
    return _line({"id": number, "error": {"code": code, "message": message[:MAX_MESSAGE]}})


def _shut(connection: socket.socket) -> None:
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)
