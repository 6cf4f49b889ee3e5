# SPDX-License-Identifier: MIT
"""Simulates a beacon gateway: measurements of beacons along a walk, as frames over UDP or a serial port, in real time.

In: plan, true path of the wearer (CSV). Out: `beacon` frames. Owns the socket or the port that it sends from.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import serial

from echostep.errors import EchostepError
from echostep_app.plan.importers.limited import open_limited
from echostep_app.ports.access import PORT_FAULTS
from echostep_app.ports.datagram_key import seal
from echostep_app.ports.udp import key_of
from echostep_app.printing.console import console
from echostep_app.scorecard.track_columns import load_path
from echostep_simulation.devices.beacon_gateway import BeaconWorld, gateway_chunks, lay_beacons

BAUD = 115200
DEFAULT_PORT = 9000  # UDP
WRITE_TIMEOUT_S = 0.5
LOOK_S = 0.02  # between two looks at the time of the walk


def simulate_gateway(
    plan_path: Path,
    truth_path: Path,
    to: str,
    spacing_m: float,
    pace: float,
    seed: int,
    walk_s: Callable[[], float] | None = None,
) -> None:
    """Send frames until the walk is over; raises EchostepError for files and ports that do not open.

    `walk_s`: the time of a walk that is played elsewhere, with which the frames keep step; None: `pace` times as fast as real time.
    """
    plan = open_limited(plan_path)
    truth = load_path(truth_path, plan)
    send, close = _open_sender(to)
    beacons_m = lay_beacons(truth.xy_m, spacing_m, np.random.default_rng([seed, 8]))
    arrival_ns = np.rint(truth.t_s * 1e9).astype(np.int64)
    duration_s = truth.t_s[-1] - truth.t_s[0]
    console.print(f"{len(beacons_m)} simulated beacons; their gateway sends to {to} for {duration_s:.0f} s of walk")
    now_s, byte_count = walk_s or _clock(float(truth.t_s[0]), pace), 0
    try:
        world = BeaconWorld(beacons_m, plan.levels[0].walls)
        for chunk in gateway_chunks(world, truth.t_s, truth.xy_m, arrival_ns, seed):
            while (early_s := chunk.t_arrival_ns * 1e-9 - now_s()) > 0.0:
                time.sleep(min(early_s / pace, LOOK_S))
            send(chunk.data)
            byte_count += len(chunk.data)
    except KeyboardInterrupt:
        pass
    finally:
        close()
    console.print(f"{byte_count} bytes sent")


def _clock(start_s: float, pace: float) -> Callable[[], float]:
    """A time that is `start_s` now and goes on `pace` times as fast as real time."""
    began_s = time.monotonic()
    return lambda: start_s + (time.monotonic() - began_s) * pace


def _open_sender(to: str) -> tuple[Callable[[bytes], object], Callable[[], None]]:
    """Functions that send to a port (serial, pyserial URL or udp://HOST:PORT) and that close it."""
    if not to.startswith("udp://"):
        try:
            port = serial.serial_for_url(to, baudrate=BAUD, write_timeout=WRITE_TIMEOUT_S)
        except PORT_FAULTS as error:
            raise EchostepError(f"{to}: cannot open the port: {error}; give another one with --to") from error
        return port.write, port.close
    try:
        parts = urlsplit(to)
        key = key_of(to)
        address = (parts.hostname or "127.0.0.1", parts.port or DEFAULT_PORT)
        datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        datagrams.connect(address)
    except (OSError, ValueError) as error:
        raise EchostepError(
            f"{to}: cannot send there: {error}; expected udp://HOST:PORT or udp://HOST:PORT?key=FILE"
        ) from error

    counter = 0

    def send(frame: bytes) -> None:
        nonlocal counter
        # The counter must grow over restarts of the gateway, and when the clock is set back: a real one without a clock stores it.
        counter = max(counter + 1, time.time_ns())
        with suppress(ConnectionRefusedError):  # no program has opened the port yet
            datagrams.send(frame if key is None else seal(key, frame, counter))

    return send, datagrams.close
