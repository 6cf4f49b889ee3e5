"""Streams of the streams: rates and losses.

In: the tracker's counts at moments of arrival. Out: `StreamRates`. Owns the counts of the last seconds.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from echostep.board.health import Severity, board_findings
from echostep.tracker import Tracker

WINDOW_NS = 2_000_000_000


@dataclass(frozen=True, slots=True)
class StreamRates:
    """Rates over the last two seconds (None: not known yet), and since the beginning what was lost on the way, rejected, and came late."""

    mtx_hz: float | None
    pings_hz: float | None
    lost: int
    rejected: int
    late_pings: int
    synchronised: bool
    check_ins: int
    wrong: str  # with the board or a stream and what to do, in words; empty: nothing


class Pulse:
    """Takes the tracker's counts after each portion."""

    def __init__(self) -> None:
        self._counts: deque[tuple[int, int, int]] = deque()

    def streams(self, tracker: Tracker, t_ns: int) -> StreamRates:
        """Streams at a moment of the arrival clock, not earlier than the last one."""
        intake = tracker.intake
        samples, pings = intake.mtx.counts.good, intake.pings
        while len(self._counts) > 1 and t_ns - self._counts[1][0] >= WINDOW_NS:
            self._counts.popleft()
        begin_ns, before_samples, before_pings = self._counts[0] if self._counts else (t_ns, samples, pings)
        if not self._counts or t_ns - self._counts[-1][0] >= WINDOW_NS // 20:
            self._counts.append((t_ns, samples, pings))
        span_s = (t_ns - begin_ns) * 1e-9
        known = span_s >= 0.5
        board, mtx, status = intake.board.counts, intake.mtx.counts, intake.status
        dropped = 0 if status is None else sum(v for k, v in status._asdict().items() if k.startswith("dropped_"))
        mtx_hz = (samples - before_samples) / span_s if known else None
        pings_hz = (pings - before_pings) / span_s if known else None
        return StreamRates(
            mtx_hz=mtx_hz,
            pings_hz=pings_hz,
            lost=board.lost + mtx.lost + dropped,
            rejected=board.rejected + mtx.bad_checksum + mtx.bad_length + mtx.incomplete,
            late_pings=intake.counts.late_pings,
            synchronised=intake.timeline.synchronised,
            check_ins=tracker.check_ins,
            wrong=_wrong(tracker, mtx_hz, pings_hz),
        )


def _wrong(tracker: Tracker, mtx_hz: float | None, pings_hz: float | None) -> str:
    if mtx_hz == 0.0:
        return "the MTx is silent: look at its plug and its power"
    found = [finding for finding in board_findings(tracker.intake.words) if finding.severity > Severity.NOTE]
    if not found and pings_hz == 0.0:
        return "no pings: look at the board's plug and at the rangers"
    return str(found[0]) if found else ""
