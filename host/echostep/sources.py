"""Where bytes come from: the only place where live and replay differ.

In: serial ports (pyserial URLs), a recording, or a simulation. Out: `Chunk`s in order of arrival. Owns the ports and the wall clock.
"""

from __future__ import annotations

from dataclasses import dataclass

BOARD = "board"
MTX = "mtx"


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes as one port delivered them; `t_arrival_ns` is the host's monotonic clock, or the simulated or recorded one."""

    port: str
    t_arrival_ns: int
    data: bytes
