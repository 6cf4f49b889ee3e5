# SPDX-License-Identifier: MIT
"""A Mosquitto broker on a free loopback port, for the tests of the team."""

from __future__ import annotations

import shutil
import signal
import socket
import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Self

import trustme

from free_ports import free_port
from layers import needs
from waiting import PATIENCE_S, until

MOSQUITTO = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin")
needs_broker = needs("process", missing=MOSQUITTO is None, reason="mosquitto is not installed (apt install mosquitto)")


class Certificates:
    """An authority, a server that it knows by 127.0.0.1, one by another name, a client that it knows, and one of either whose time is over."""

    def __init__(self, folder: Path) -> None:
        authority = trustme.CA()
        self.ca, self.server, self.client, self.stranger, self.elsewhere, self.old, self.old_client = (
            folder / f"{n}.pem" for n in ("ca", "server", "client", "stranger", "elsewhere", "old", "old_client")
        )
        authority.cert_pem.write_to_path(str(self.ca))
        yesterday = datetime.now(UTC) - timedelta(days=1)
        for path, issuer, name, end in (
            (self.server, authority, "127.0.0.1", None),
            (self.client, authority, "anna@example.org", None),
            (self.stranger, trustme.CA(), "eve@example.org", None),
            (self.elsewhere, authority, "broker.example", None),
            (self.old, authority, "127.0.0.1", yesterday),
            (self.old_client, authority, "anna@example.org", yesterday),
        ):
            made = issuer.issue_cert(name, not_after=end)
            made.private_key_and_cert_chain_pem.write_to_path(str(path))

    def query(self, client: Path | None = None) -> str:
        """The part of a URL that names the files."""
        return f"?ca={self.ca}" + ("" if client is None else f"&cert={client}&key={client}")


class Broker:
    """Started, stopped and started again on one port."""

    def __init__(self, folder: Path, *more: str, port: int | None = None) -> None:
        self.port = port or free_port()
        self._configuration = folder / f"mosquitto-{self.port}.conf"
        # Root: it reads our folder
        lines = ("user root", f"listener {self.port} 127.0.0.1", "allow_anonymous true", *more)
        self._configuration.write_text("\n".join(lines) + "\n")
        self._log = folder / f"mosquitto-{self.port}.log"
        self._running: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        return f"mqtt://127.0.0.1:{self.port}"

    def start(self) -> None:
        assert MOSQUITTO
        with self._log.open("ab") as log:
            self._running = subprocess.Popen([MOSQUITTO, "-c", self._configuration], stdout=log, stderr=log)
        assert until(self._answers), self._log.read_text()

    def _answers(self) -> bool:
        assert self._running
        assert self._running.poll() is None, self._log.read_text()
        try:
            socket.create_connection(("127.0.0.1", self.port), PATIENCE_S).close()
        except OSError:
            return False
        return True

    def stop(self) -> None:
        if self._running is not None:
            self._running.send_signal(signal.SIGCONT)
            self._running.terminate()
            self._running.wait(PATIENCE_S)
            self._running = None

    def reload(self) -> None:
        """It reads passwords and access rules anew."""
        assert self._running
        self._running.send_signal(signal.SIGHUP)

    def freeze(self) -> None:
        """It lives but does nothing."""
        assert self._running
        self._running.send_signal(signal.SIGSTOP)

    def thaw(self) -> None:
        assert self._running
        self._running.send_signal(signal.SIGCONT)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
