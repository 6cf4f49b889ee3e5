# SPDX-License-Identifier: MIT
"""Bytes of the ports: `Chunk`; `Portion`, many of them as columns.

In: chunks from live ports, a recording or a simulation. Out: the same chunks as the columns of a `Portion`. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from echostep.arrays import Bools, Ints, Octets
from echostep.jit import kernel

# Names of the ports.
BOARD = "board"
MTX = "mtx"
FOOT = "foot"  # a second board, at the ankle, in place of an MTx
GATEWAY = "gateway"
LINES = "lines"  # text of any foot IMU, recorded; its samples are chunks of MTX [echostep_app.session.runs.live_lines]
TEAM = "team"  # places of a teammate, which older recordings have; not read

LATEST_NS = 1 << 62  # a later arrival time (damage in a recording) is replaced by this one; assumed


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes of one read of a port; `t_arrival_ns` is on the host's clock (`arrival_clock`), or on the simulated or recorded one.

    The ports are `board`, `mtx` or `foot`, and `gateway`. Bytes are cut anywhere: a frame may begin in one chunk and end in the next one.

    >>> import echostep
    >>> chunk = echostep.Chunk("board", 1_500_000_000, bytes(28))
    >>> chunk
    <Chunk 'board': 28 bytes at 1.500000 s>
    >>> tracker = echostep.Tracker(echostep.plan.load_plan("demo.json"))
    >>> tracker.feed(chunk)  # no estimate yet
    []
    """

    port: str
    t_arrival_ns: int
    data: bytes

    def __repr__(self) -> str:
        """Port, number of bytes, time of arrival."""
        return f"<Chunk {self.port!r}: {len(self.data)} bytes at {1e-9 * self.t_arrival_ns:.6f} s>"


@dataclass(frozen=True, slots=True)
class PortBytes:
    """All bytes of one port in a portion, joined in `received`.

    Chunk k of the port is row `row[k]` of the portion and ends before byte `end[k]` of `received`.
    """

    received: bytes
    row: Ints
    end: Ints

    def rows_of(self, ends: Ints) -> Ints:
        """Row of the chunk with the last byte of each frame; `ends` (n,) are the frames' ends in `received`, ascending."""
        return self.row[np.searchsorted(self.end, ends)]


_NO_BYTES = PortBytes(b"", np.empty(0, np.int64), np.empty(0, np.int64))


@dataclass(frozen=True, slots=True)
class Portion:
    """Chunks in order of arrival, as columns (n,).

    Chunk k came from `ports[port[k]]` at `t_arrival_ns[k]`; its bytes are `received[start[k] : end[k]]`. The names in `ports` are unique.
    """

    ports: tuple[str, ...]
    port: Ints
    t_arrival_ns: Ints
    start: Ints
    end: Ints
    received: bytes

    def chunks(self) -> Iterator[Chunk]:
        """The chunks one by one."""
        columns = (self.port.tolist(), self.t_arrival_ns.tolist(), self.start.tolist(), self.end.tolist())
        for port, t_arrival_ns, start, end in zip(*columns, strict=True):
            yield Chunk(self.ports[port], t_arrival_ns, self.received[start:end])

    def rows(self, begin: int, end: int) -> Portion:
        """The chunks from row `begin` up to row `end`."""
        return self.where(slice(begin, end))

    def where(self, kept: Bools | slice) -> Portion:
        """The chunks of those rows (n,) that are kept."""
        return Portion(
            self.ports, self.port[kept], self.t_arrival_ns[kept], self.start[kept], self.end[kept], self.received
        )

    def cut_after(self, *names: str) -> Iterator[Portion]:
        """The portion in pieces; each chunk of the named ports is the last one of its piece."""
        cuts = np.sort(np.concatenate([self._rows_from(name) for name in names])) + 1
        for begin, end in pairwise(dict.fromkeys([0, *cuts.tolist(), len(self.port)])):
            yield self.rows(begin, end)

    def of(self, name: str) -> PortBytes:
        """All bytes of the named port."""
        if name not in self.ports:
            return _NO_BYTES
        row = self._rows_from(name)
        start, end = self.start[row], self.end[row]
        total = (end - start).cumsum()
        joined = np.empty(int(total[-1]) if len(total) else 0, np.uint8)
        _copy_ranges(np.frombuffer(self.received, np.uint8), start, end, joined)
        return PortBytes(joined.tobytes(), row, total)

    def _rows_from(self, name: str) -> Ints:
        """Rows of the named port's chunks; empty when the portion has no such port."""
        return (self.port == self.ports.index(name)).nonzero()[0] if name in self.ports else np.empty(0, np.int64)


def portion_of(chunks: Sequence[Chunk]) -> Portion:
    """Chunks as the columns of a portion; arrival times are limited to 0 ... `LATEST_NS`."""
    port_index = {port: k for k, port in enumerate(dict.fromkeys(chunk.port for chunk in chunks))}
    edges = [0, *accumulate(len(chunk.data) for chunk in chunks)]
    return Portion(
        tuple(port_index),
        np.array([port_index[chunk.port] for chunk in chunks], np.int64),
        np.array([min(max(chunk.t_arrival_ns, 0), LATEST_NS) for chunk in chunks], np.int64),
        np.array(edges[:-1], np.int64),
        np.array(edges[1:], np.int64),
        b"".join(chunk.data for chunk in chunks),
    )


@kernel
def _copy_ranges(received: Octets, start: Ints, end: Ints, joined: Octets) -> None:
    """Copy received[start[k] : end[k]] for each k into `joined`, one after the other."""
    joined_index = 0
    for k in range(len(start)):
        for byte_index in range(start[k], end[k]):
            joined[joined_index] = received[byte_index]
            joined_index += 1
