# SPDX-License-Identifier: MIT
"""A live run with a foot IMU that prints lines: `--foot lines:PORT`.

In: the option's value, the open ports. Out: the rate of the samples, and the same chunks with the samples of the lines among them, for recorder
and tracker. Owns the readers of the lines. The bytes of the lines are recorded, too; a replay takes the recorded samples.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

import numpy as np

from echostep.errors import EchostepError
from echostep.offline.imu_checks import complaint
from echostep.offline.imu_csv import COLUMNS
from echostep.ports.chunks import LINES, Chunk
from echostep.settings import imu_settings, parse_settings
from echostep_app.interruption import is_asked
from echostep_app.offline.importing import rate_of
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.session.runs.live_lines import LineChunks, LineReader

SCHEME = "lines:"
LISTEN_S = 2.0  # of samples, from which their rate is measured
PATIENCE_S = 20.0  # longest wait for them; a board that starts and joins a network takes 10 s; assumed
FEWEST = 100  # samples
RATE_SHARE = 0.02  # by which the settings' rate may differ from the measured one
HEADER = ",".join(COLUMNS)


def port_of(foot: str | None) -> str | None:
    """The port in `lines:PORT[#HEADER]`, with tcp:// as this project's ports name it; None for another foot. Raises EchostepError."""
    if foot is None or not foot.startswith(SCHEME):
        return None
    port = foot.removeprefix(SCHEME).partition("#")[0]
    if not port:
        raise EchostepError(f"--foot {foot}: expected a port behind it, as lines:/dev/ttyUSB0 or lines:-")
    return "socket://" + port.removeprefix("tcp://") if port.startswith("tcp://") else port


class LineFoot:
    """Listens to the ports until the rate of the samples is known; raises EchostepError with the received data."""

    def __init__(self, ports: SerialPorts, foot: str) -> None:
        self._foot, self._reader = foot, LineReader()
        samples = self._listen(ports, foot.partition("#")[2])
        if wrong := complaint(samples, COLUMNS):
            raise EchostepError(f"--foot {foot}: {wrong}; units go into the header, as t (ms), ax (g), gx (deg/s)")
        self.rate_hz = rate_of(samples[:, 0])
        self._reader, self._chunks = LineReader(), LineChunks(self.rate_hz)

    def settings(self, text: str, origin: str) -> str:
        """The settings of the run: the given ones, whose rate must fit, or a foot IMU's."""
        if not text:
            return imu_settings(self.rate_hz)
        given = parse_settings(text, origin).mtx.rate_hz
        if abs(given / self.rate_hz - 1.0) > RATE_SHARE:
            raise EchostepError(
                f"{origin}: [mtx] rate_hz = {given:g}, but the lines come at {self.rate_hz:g}: write that"
            )
        return text

    def with_samples(self, chunks: Iterable[Chunk | None]) -> Iterator[Chunk | None]:
        """The same chunks, each of lines followed by its samples'."""
        for chunk in chunks:
            yield chunk
            if chunk is not None and chunk.port == LINES:
                yield from self._chunks.of(self._reader.feed(chunk.data), chunk.t_arrival_ns)

    def report(self) -> str:
        """The lines read, in words."""
        return (
            f"foot in lines: {self.rate_hz:g} Hz; {self._reader.unreadable} lines were no sample, {self._chunks.off} times were out of line, "
            f"{self._chunks.left_out} samples came within the period of another, the device's clock was set {self._chunks.jumps} times"
        )

    def _listen(self, ports: SerialPorts, header: str) -> np.ndarray:
        """The first samples (n, 7); what was read stays with the ports as unused."""
        heard: list[Chunk] = []
        samples = np.empty((0, len(COLUMNS)))
        end_s = time.monotonic() + PATIENCE_S
        for chunk in ports.chunks():
            if is_asked() or time.monotonic() > end_s:
                break
            if chunk is None:
                continue
            if header and chunk.port == LINES and not any(each.port == LINES for each in heard):
                chunk = Chunk(LINES, chunk.t_arrival_ns, header.encode() + b"\n" + chunk.data)
            heard.append(chunk)
            if chunk.port == LINES:
                samples = np.concatenate([samples, self._reader.feed(chunk.data)])
            if len(samples) > FEWEST and np.ptp(samples[:, 0]) >= LISTEN_S:
                break
        ports.unused = heard
        if len(samples) > FEWEST:
            return samples
        what = f"{len(samples)} samples came"
        if not self._reader.header:
            what = f"no line named the columns (print {HEADER} each second, or add #{HEADER})"
        heard_s = time.monotonic() - end_s + PATIENCE_S
        raise EchostepError(
            f"--foot {self._foot}: in {heard_s:.0f} s {what}; {self._reader.unreadable} lines were no sample"
        )
