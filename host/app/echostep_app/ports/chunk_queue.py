# SPDX-License-Identifier: MIT
"""The queue between the threads that read the ports and the run.

In: chunks. Out: the same, the oldest first. Owns the chunks that wait, and the number of those dropped: the queue is bounded for each port, so that
one port never crowds out another.
"""

from __future__ import annotations

import threading
from collections import Counter, deque

from echostep.ports.chunks import Chunk

MOST_BYTES = 1 << 24  # of one port that wait: minutes of the board's or the MTx's bytes
CHUNK_BYTES = 100  # approximate memory that a chunk takes besides its bytes


class ChunkQueue:
    """Call `put` from any thread, `get` from one. `dropped`: chunks by port that found no room."""

    def __init__(self) -> None:
        self.dropped: Counter[str] = Counter()
        self._chunks: deque[Chunk] = deque()
        self._bytes: Counter[str] = Counter()  # that wait, by port
        self._changed = threading.Condition()

    def put(self, chunk: Chunk) -> None:
        """Append a chunk; it is dropped and counted when too many bytes of its port wait."""
        size = len(chunk.data) + CHUNK_BYTES
        with self._changed:
            if self._bytes[chunk.port] + size > MOST_BYTES:
                self.dropped[chunk.port] += 1
                return
            self._bytes[chunk.port] += size
            self._chunks.append(chunk)
            self._changed.notify()

    def get(self, timeout_s: float) -> Chunk | None:
        """The oldest chunk; None after the timeout."""
        with self._changed:
            if not self._chunks and not self._changed.wait_for(lambda: bool(self._chunks), timeout_s):
                return None
            chunk = self._chunks.popleft()
            self._bytes[chunk.port] -= len(chunk.data) + CHUNK_BYTES
            return chunk
