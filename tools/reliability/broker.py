# SPDX-License-Identifier: MIT
"""A Mosquitto broker of its own for a campaign.

In: the program mosquitto. Out: its URL while the context is open; the program ends where mosquitto is missing. Owns the process.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory


@contextlib.contextmanager
def broker() -> Iterator[str]:
    """On a free port of the loopback interface, for everybody there."""
    mosquitto = shutil.which("mosquitto", path=os.environ["PATH"] + ":/usr/sbin")
    if mosquitto is None:
        sys.exit("mosquitto is not installed: apt install mosquitto")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with TemporaryDirectory() as folder:
        configuration = Path(folder) / "mosquitto.conf"
        configuration.write_text(f"user root\nlistener {port} 127.0.0.1\nallow_anonymous true\n")
        process = subprocess.Popen([mosquitto, "-c", str(configuration)], stderr=subprocess.DEVNULL)
        try:
            yield f"mqtt://127.0.0.1:{port}"
        finally:
            process.terminate()
            process.wait(10)
