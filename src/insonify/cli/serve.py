"""Command that offers a scenario's sonar to other programs."""

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Annotated

import typer

from insonify.cli.arguments import Cores, InputError, ScenarioFile, require_choice


def serve(
    file: ScenarioFile,
    device: Annotated[
        str, typer.Option("--as", metavar="NAME", help="json (TCP), ping360 or ping1d (ping-protocol over UDP).")
    ] = "json",
    host: Annotated[str, typer.Option(metavar="HOST", help="Address to bind to.")] = "127.0.0.1",
    port: Annotated[
        int | None, typer.Option(metavar="PORT", min=0, max=65535, help="[default: 9460; of a device 9092]")
    ] = None,
    threads: Cores = None,
) -> None:
    """Offer a sonar to other programs, ping by ping, until it is stopped with Ctrl-C.

    Example: insonify serve harbour.yaml

    Example: insonify serve scanning.yaml --as ping360 --port 9092
    """
    require_choice(device, ("json", "ping360", "ping1d"), "--as")
    from insonify.real_time.live_sonar import live
    from insonify.real_time.ping1d import Ping1D
    from insonify.real_time.ping360 import Ping360
    from insonify.real_time.tcp_server import DEFAULT_PORT, TcpServer
    from insonify.scenario.load import load_scenario

    scenario = load_scenario(file)
    if port is None:
        port = DEFAULT_PORT if device == "json" else 9092
    with _advising(host, port):
        _bound(device, host, port).close()  # before the minutes that preparing may take
    typer.echo(f"preparing {file}: scene, paths and kernels, and a few pings that are discarded", err=True)
    begin = time.monotonic()
    with ExitStack() as stack:
        with _advising(host, port):
            if device == "json":
                sonar = stack.enter_context(live(scenario, threads=threads))
                server: TcpServer | Ping360 | Ping1D = TcpServer(sonar, host, port)
            else:
                kind = Ping360 if device == "ping360" else Ping1D
                server = kind(scenario, host, port, threads=threads)
        stack.enter_context(server)
        typer.echo(f"ready after {time.monotonic() - begin:.1f} s", err=True)
        typer.echo(f"{server.address[0]}:{server.address[1]}")
        with suppress(KeyboardInterrupt):
            server.serve_forever()


@contextmanager
def _advising(host: str, port: int) -> Iterator[None]:
    """Errors of an address that cannot be bound, with the remedy."""
    try:
        yield
    except OSError as error:
        raise InputError(f"--host {host}, --port {port}: {error.strerror}. Choose another port or address") from None


def _bound(device: str, host: str, port: int) -> socket.socket:
    """A socket of the kind that a device has, bound to an address."""
    if device == "json":
        return socket.create_server((host, port))
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bound.bind((host, port))
    return bound
