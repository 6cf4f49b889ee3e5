# SPDX-License-Identifier: MIT
"""A host and a simulated MT for the tests: in simulated time, or with the device on a pseudo terminal."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator

import numpy as np

from echostep.xsens import MtSample
from echostep_app.xsens.requests import project_requests
from echostep_app.xsens.setup import MtxSetup
from echostep_studies.simulation.devices.mtx_setup import MtxDevice
from players import playing, pseudo_terminal

SAMPLE = MtSample(7, (0.5, -0.25, 9.75), (0.125, 0.0, -1.5), (0.5, 0.0, -0.875), (0.5, 0.5, -0.5, 0.5))
STILL = MtSample(0, (0.0, 0.0, 9.81), (0.0, 0.0, 0.0), (0.5, 0.0, -0.875), (1.0, 0.0, 0.0, 0.0))
STEP_S = 0.01


class Line:
    """A host and a device that meet every 10 ms; `lose` drops whole messages in either direction by a seeded generator."""

    def __init__(self, device: MtxDevice, rate_hz: float = 100.0, lose: float = 0.0, seed: int = 0) -> None:
        self.device, self.setup = device, MtxSetup(project_requests(rate_hz), rate_hz)
        self.now_s, self.counter = 5.0, 0
        self.received = b""
        self._lose, self._rng = lose, np.random.default_rng(seed)
        self._to_host = b""

    def run(self, seconds: float) -> MtxSetup:
        for _ in range(round(seconds / STEP_S)):
            sent = self._through(self.setup.advance(self._to_host, self.now_s))
            self.received += self._to_host
            self.now_s += STEP_S
            self._to_host = self._through(self.device.feed(sent, self.now_s))
            self.counter += 1
            self._to_host += self.device.measure(SAMPLE._replace(counter=self.counter))
        return self.setup

    def _through(self, sent: bytes) -> bytes:
        return b"" if self._rng.random() < self._lose else sent


@contextlib.contextmanager
def on_a_terminal(device: MtxDevice) -> Iterator[str]:
    """A device that measures at its rate and answers, on a pseudo terminal; gives the port's name."""
    counter, due_s = 0, time.monotonic()
    with pseudo_terminal() as (ours, port):

        def step() -> None:
            nonlocal counter, due_s
            received = b""
            with contextlib.suppress(BlockingIOError):
                received = os.read(ours, 4096)
            sent = device.feed(received, time.monotonic())
            if time.monotonic() >= due_s:
                due_s += 1.0 / device.rate_hz
                counter += 1
                noise = (1e-3 * (counter % 2), 0.0, 0.0)
                sent += device.measure(STILL._replace(counter=counter, gyro=noise))
            with contextlib.suppress(BlockingIOError):
                os.write(ours, sent)
            time.sleep(0.001)

        with playing(step):
            yield port
