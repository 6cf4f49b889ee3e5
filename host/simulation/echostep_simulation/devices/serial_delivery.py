# SPDX-License-Identifier: MIT
"""From a serial line or a board's USB to the host: when bytes arrive, and in which portions.

In: frames and when the device begins to send each. Out: portions as the driver of an FTDI adapter hands them over. Owns nothing.
The adapter sends its buffer when 62 bytes have come or when its latency timer runs out, whichever is first [FTDI AN232B-04].
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel
from echostep.ports.chunks import Chunk

FULL = 62  # bytes in a USB packet of 64, two of them status
BITS = 10  # a byte on the line: start, eight, stop
WAKE_S = 0.0002  # mean time until the reading program gets to run
USB_LATENCY_NS = 1_000_000


def usb_chunks(port: str, sent: Iterable[tuple[int, bytes]], origin_ns: int) -> list[Chunk]:
    """A board's bytes as a USB host gets them, those of one instant together; `origin_ns`: the host's clock at the board's time 0."""
    gathered: defaultdict[int, bytes] = defaultdict(bytes)
    for t_ns, part in sent:
        gathered[origin_ns + t_ns + USB_LATENCY_NS] += part
    return [Chunk(port, t_ns, part) for t_ns, part in gathered.items()]


def deliver(
    frames: list[bytes], begin_s: Floats, baud: int, timer_s: float, rng: np.random.Generator
) -> tuple[Floats, list[bytes], Floats]:
    """Arrival times (m,) and portions, and when each frame is complete (n,), for frames that begin at `begin_s` (n,) at the earliest."""
    lengths = np.array([len(frame) for frame in frames])
    byte_s = _byte_times(begin_s, lengths, BITS / baud)
    ends, left_s = _packets(byte_s, timer_s)
    arrival_s = np.maximum.accumulate(left_s + WAKE_S * rng.exponential(size=len(left_s)))
    stream = b"".join(frames)
    starts = np.concatenate([[0], ends[:-1]])
    portions = [stream[a:b] for a, b in zip(starts.tolist(), ends.tolist(), strict=True)]
    complete_s: Floats = arrival_s[np.searchsorted(ends, np.cumsum(lengths))]
    return arrival_s, portions, complete_s


@kernel
def _byte_times(begin_s: Floats, lengths: Ints, byte_s: float) -> Floats:
    """When each byte has come over the line; a frame waits for the one before it."""
    times_s = np.zeros(lengths.sum())
    at, free_s = 0, 0.0
    for k in range(len(lengths)):
        free_s = max(free_s, begin_s[k])
        for _ in range(lengths[k]):
            free_s += byte_s
            times_s[at] = free_s
            at += 1
    return times_s


@kernel
def _packets(byte_s: Floats, timer_s: float) -> tuple[Ints, Floats]:
    """For each USB packet with bytes in it: the number of bytes sent up to its end, and when it leaves."""
    ends, left_s = np.zeros(len(byte_s), np.int64), np.zeros(len(byte_s))
    count, first, timer = 0, 0, timer_s
    for k in range(len(byte_s) + 1):
        over = k == len(byte_s)
        while first < k and (over or byte_s[k] > timer):
            ends[count], left_s[count] = k, timer
            count, first, timer = count + 1, k, timer + timer_s
        if not over:
            while byte_s[k] > timer:  # it ran out with nothing to send
                timer += timer_s
            if k + 1 - first == FULL:
                ends[count], left_s[count] = k + 1, byte_s[k]
                count, first, timer = count + 1, k + 1, byte_s[k] + timer_s
    return ends[:count], left_s[:count]
