"""Socket server: what servers of a simulated sonar share, whatever their protocol."""

import socket
import threading
from abc import ABC, abstractmethod
from typing import Self


class SocketServer(ABC):
    """A bound socket that is served in the calling thread or in one of its own; a context closes it."""

    def __init__(self, bound: socket.socket) -> None:
        """Keep the socket; nothing is served before `start` or `serve_forever`.

        Args:
            bound: Socket that is bound to its address.
        """
        self._socket = bound
        self._stopped = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def address(self) -> tuple[str, int]:
        """Host and port that the server is bound to."""
        host, port = self._socket.getsockname()[:2]
        return str(host), int(port)

    def start(self) -> Self:
        """Serve in a thread of its own."""
        self._thread = threading.Thread(target=self.serve_forever, daemon=True)
        self._thread.start()
        return self

    @abstractmethod
    def serve_forever(self) -> None:
        """Serve until `close`."""

    @abstractmethod
    def close(self) -> None:
        """Release the port."""

    def _join(self) -> None:
        """Wait for the server's own thread, if it has one and is not called from it."""
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()

    def __enter__(self) -> Self:
        """Enter a context that closes the server."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the server."""
        self.close()
