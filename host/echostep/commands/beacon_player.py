"""Plays a beacon gateway: a walk's truth in, frames out over UDP or a serial port, in real time.

In: plan, truth.csv. Out: `beacon` frames. Owns the socket or port that it sends from.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import serial
from rich.console import Console

from echostep.errors import EchostepError
from echostep.localization.metrics import load_truth
from echostep.plan.importers.formats import open_plan
from echostep.simulation.devices.beacon_gateway import BeaconWorld, gateway_chunks, lay_beacons

console = Console(soft_wrap=True)


def simulate_gateway(plan_path: Path, truth_path: Path, to: str, spacing_m: float, pace: float, seed: int) -> None:
    """Send what beacons along the walk measure until it is over; raises EchostepError for files and ports that do not open."""
    plan, truth = open_plan(plan_path), load_truth(truth_path)
    send, close = _sender(to)
    places = lay_beacons(truth.xy_m, spacing_m, np.random.default_rng([seed, 8]))
    arrival_ns = np.rint(truth.t_s * 1e9).astype(np.int64)
    console.print(
        f"{len(places)} simulated beacons; their gateway sends to {to} for {truth.t_s[-1] - truth.t_s[0]:.0f} s of walk"
    )
    began, sent = time.monotonic(), 0
    try:
        for chunk in gateway_chunks(BeaconWorld(places, plan.levels[0].walls), truth.t_s, truth.xy_m, arrival_ns, seed):
            ahead_s = (chunk.t_arrival_ns - int(arrival_ns[0])) * 1e-9 / pace - (time.monotonic() - began)
            if ahead_s > 0.0:
                time.sleep(ahead_s)
            send(chunk.data)
            sent += len(chunk.data)
    except KeyboardInterrupt:
        pass
    finally:
        close()
    console.print(f"{sent} bytes sent")


def _sender(to: str) -> tuple[Callable[[bytes], object], Callable[[], None]]:
    """How to send, and how to end."""
    if not to.startswith("udp://"):
        try:
            port = serial.serial_for_url(to, baudrate=115200, write_timeout=0.5)
        except (serial.SerialException, OSError, ValueError) as error:
            raise EchostepError(f"{to}: cannot open the port: {error}") from error
        return port.write, port.close
    try:
        parts = urlsplit(to)
        address = (parts.hostname or "127.0.0.1", parts.port or 9000)
        plug = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        plug.connect(address)
    except (OSError, ValueError) as error:
        raise EchostepError(f"{to}: cannot send there: {error}") from error
    return _forgiving(plug), plug.close


def _forgiving(plug: socket.socket) -> Callable[[bytes], object]:
    """Nobody need listen yet."""

    def send(sent: bytes) -> None:
        try:
            plug.send(sent)
        except ConnectionRefusedError:
            return

    return send
