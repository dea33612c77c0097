"""Claims about `insonify serve`: it serves until Ctrl-C, and refuses what it cannot serve with one line of advice."""

import json
import re
import signal
import socket
import struct
import subprocess
import sys
from contextlib import suppress

import pytest
import yaml

from insonify.cli import main
from insonify.real_time.ping_protocol import Message, messages, packed
from oracles.scenes import nominal, point

STREAM, DATAGRAM = socket.SOCK_STREAM, socket.SOCK_DGRAM


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Scenario file of a point in silent water."""
    scenario = nominal(
        targets=[point(0.0, 12.0, 11.0)], field="incoherent",
        paths={"contributions": ("target",), "max_reflections": 0},
        line={"kind": "planar", "length": None, "width": 0.04, "height": 0.04}, track={"window": (0.0, 0.02)},
    )  # fmt: skip
    path = tmp_path_factory.mktemp("serve") / "point.yaml"
    path.write_text(yaml.safe_dump(scenario.model_dump(mode="json", exclude_unset=True)))
    return path


def bound(kind):
    """A socket at a port of the loopback address that was free."""
    made = socket.socket(socket.AF_INET, kind)
    made.bind(("127.0.0.1", 0))
    if kind == STREAM:
        made.listen()
    return made


def axes_over_tcp(port):
    """Number of samples that a describe request is reported with."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection, connection.makefile("rw") as lines:
        assert json.loads(lines.readline())["protocol"] == "insonify-live"
        lines.write('{"method": "describe", "id": 7}\n')
        lines.flush()
        reply = json.loads(lines.readline())
        assert reply["id"] == 7
        return len(reply["axes"]["time"])


def version_over_udp(port):
    """Payload of the version of ping-protocol."""
    with socket.socket(socket.AF_INET, DATAGRAM) as out:
        out.settimeout(10)
        out.connect(("127.0.0.1", port))
        out.send(packed(Message(6, struct.pack("<H", 5))))
        return len(next(messages(out.recv(4096))).payload)


@pytest.mark.parametrize(
    ("device", "kind", "exchange", "least"),
    [("json", STREAM, axes_over_tcp, 100), ("ping360", DATAGRAM, version_over_udp, 4)],
)
def test_it_replies_until_ctrl_c_and_frees_its_port(device, kind, exchange, least, file):
    """The address on stdout, a reply to a request, and after Ctrl-C exit code 0, and a port free again."""
    with bound(kind) as free:
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "insonify", "serve", str(file), "--as", device, "--port", str(port)]
    # a parent that ignores Ctrl-C would have the child ignore it too
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                              preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))  # noqa: PLW1509  # fmt: skip
    try:
        assert server.stdout is not None and server.stdout.readline() == f"127.0.0.1:{port}\n"
        assert exchange(port) >= least
        server.send_signal(signal.SIGINT)
        out, err = server.communicate(timeout=60)
    finally:
        server.kill()
    assert server.returncode == 0, err
    assert out == "" and "interrupted" not in err
    assert re.search(r"^preparing \S*point\.yaml: .*\n(?:.*\n)*ready after \d+\.\d s\n", err, re.MULTILINE)
    with socket.socket(socket.AF_INET, kind) as again:
        again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        again.bind(("127.0.0.1", port))


@pytest.mark.parametrize(("device", "kind"), [("json", STREAM), ("ping360", DATAGRAM), ("ping1d", DATAGRAM)])
def test_a_port_in_use_is_named(device, kind, file, capsys):
    """Exit code 2, and one line with the port and the remedy."""
    with bound(kind) as taken:
        port = taken.getsockname()[1]
        assert main(["serve", str(file), "--as", device, "--port", str(port), "--threads", "1"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith(f"--host 127.0.0.1, --port {port}: Address already in use")
    assert err.endswith("Choose another port or address\n") and len(err.splitlines()) == 1


def test_the_port_of_the_protocol_is_named_where_none_is_given(file, capsys):
    """9092 of a device, where another program has it already."""
    with socket.socket(socket.AF_INET, DATAGRAM) as taken:
        with suppress(OSError):  # some other program has it, which will do
            taken.bind(("127.0.0.1", 9092))
        assert main(["serve", str(file), "--as", "ping1d", "--threads", "1"]) == 2
    assert "--port 9092: " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (("absent.yaml",), "absent.yaml"),
        (("wrong.yaml",), "wrong.yaml"),
        (("point.yaml", "--as", "ping3d"), "--as ping3d: there is no such choice. Did you mean ping1d?"),
        (("point.yaml", "--as", "xyz"), "Choose one of json, ping360, ping1d"),
        (("point.yaml", "--host", "198.51.100.7"), "Choose another port or address"),
        (("point.yaml", "--host", "no such host"), "Choose another port or address"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_cannot_be_served_is_refused_in_a_line(words, advice, file, monkeypatch, capsys):
    """Files that are not there or no scenario, devices and addresses that are none: exit code 2."""
    (file.parent / "wrong.yaml").write_text("sonar: 3\n")
    monkeypatch.chdir(file.parent)
    assert main(["serve", *words, "--threads", "1"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and advice in err and "Traceback" not in err
    assert len(err.splitlines()) == 1 or "wrong.yaml" in words


def test_a_port_out_of_range_is_refused(file, capsys):
    """Ports end at 65535."""
    assert main(["serve", str(file), "--port", "65536"]) == 2 and "65535" in capsys.readouterr().err
