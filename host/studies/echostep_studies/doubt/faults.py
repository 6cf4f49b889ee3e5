# SPDX-License-Identifier: MIT
"""What may befall rangers and bytes: a ranger dies, both are covered, a person passes, samples repeat, a plug is loose.

In: rows of a board, or chunks in order of arrival, and a time span. Out: the same with other echoes or bytes. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Bools, Floats
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep.xsens import MTDATA, encode_frame
from echostep_simulation.scenario import START_NS
from echostep_studies.bench.echo_changes import LEFT, RIGHT
from echostep_studies.doubt.wearers import Span

Rows = NDArray[np.void]
SECOND_S = 25.0  # from the death of one ranger to that of the other
PASSER_M, PASSES_S, EVERY_S = 0.6, 1.5, 8.0  # distance of a person who passes, for how long, how often
HEADER, COUNTER = 4, 3  # bytes of an MTData frame before its data; its counter and checksum


class Heard:
    """The sensors of a board, whose echoes are changed."""

    def __init__(self, sensors: Any, change: Callable[[Rows, Floats, Span], None], span_s: Span) -> None:
        self._sensors, self._change, self._span_s = sensors, change, span_s

    def rows(self, start: int, stop: int, ranging: Bools | None = None) -> Rows:
        """The rows of the milliseconds start..stop-1."""
        rows: Rows = self._sensors.rows(start, stop, ranging)
        self._change(rows, np.arange(start, stop) / 1000.0, self._span_s)
        return rows


def covered(rows: Rows, t_s: Floats, span_s: Span) -> None:
    """Both rangers hear nothing during the span."""
    rows["own_us"][_within(t_s, span_s)] = 0
    rows["cross_us"][_within(t_s, span_s)] = 0


def one_after_the_other(rows: Rows, t_s: Floats, span_s: Span) -> None:
    """The left ranger hears nothing from the begin of the span on, the right one from SECOND_S later on."""
    for ranger, begin_s in ((LEFT, span_s[0]), (RIGHT, span_s[0] + SECOND_S)):
        rows["own_us"][t_s >= begin_s, ranger] = 0
    rows["cross_us"][t_s >= span_s[0]] = 0


def passers_by(rows: Rows, t_s: Floats, span_s: Span) -> None:
    """People pass on the left, nearer and farther, during the span."""
    since_s = (t_s - span_s[0]) % EVERY_S
    passing = _within(t_s, span_s) & (since_s < PASSES_S)
    away_m = PASSER_M + 0.5 * np.abs(since_s / PASSES_S - 0.5)
    us = (2.0 * away_m / 343.0 * 1e6).astype(np.uint16)
    own = rows["own_us"][:, LEFT]
    rows["own_us"][:, LEFT] = np.where(passing & ((own == 0) | (own > us)), us, own)


def _within(t_s: Floats, span_s: Span) -> Bools:
    return np.asarray((t_s >= span_s[0]) & (t_s < span_s[1]))


def repeating(chunks: Sequence[Chunk], span_s: Span) -> list[Chunk]:
    """The MTx repeats one sample while its counter goes on."""
    pieces = [chunk.data for chunk in chunks if chunk.port == MTX]
    sent, earlier = b"".join(pieces), sum(len(c.data) for c in chunks if c.port == MTX and _since_s(c, span_s) < 0.0)
    length = HEADER + sent[HEADER - 1] + 1
    frames = [sent[k : k + length] for k in range(0, len(sent), length)]
    first = earlier // length + 1
    kept = frames[first][HEADER:-COUNTER]
    frames[first:] = [encode_frame(MTDATA, kept + frame[-COUNTER:-1]) for frame in frames[first:]]
    left = memoryview(b"".join(frames))
    changed = []
    for chunk in chunks:
        if chunk.port == MTX:
            chunk, left = replace(chunk, data=bytes(left[: len(chunk.data)])), left[len(chunk.data) :]
        changed.append(chunk)
    return changed


def loose_plug(chunks: Sequence[Chunk], span_s: Span, port: str = MTX, later_s: float = 0.0) -> list[Chunk]:
    """Every 12 s, from this long after the begin of the span on, a port's bytes are missing, for 1 to 5 s in turn."""
    since_s = [divmod(_since_s(chunk, span_s) - later_s, 12.0) for chunk in chunks]
    loose = [number >= 0.0 and at_s < 1.0 + number % 5.0 for number, at_s in since_s]
    return [chunk for chunk, is_loose in zip(chunks, loose, strict=True) if chunk.port != port or not is_loose]


def loose_plugs(chunks: Sequence[Chunk], span_s: Span) -> list[Chunk]:
    """The plugs of MTx and board in turn: the board's six seconds after the MTx's."""
    return loose_plug(loose_plug(chunks, span_s), span_s, BOARD, 6.0)


def _since_s(chunk: Chunk, span_s: Span) -> float:
    """Time of arrival since the span began."""
    return 1e-9 * (chunk.t_arrival_ns - START_NS) - span_s[0]
