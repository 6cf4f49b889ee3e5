# SPDX-License-Identifier: MIT
"""Rates and losses of each input stream.

In: the tracker's counters at arrival times. Out: `StreamRates`. Owns the counters of the last seconds.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, fields

from echostep.ports.chunks import BOARD, FOOT, LINES, MTX
from echostep.tracker import Tracker
from echostep.tracker.state import StreamState
from echostep.xsens.reader import MtxCounts
from echostep_app.board.faults.health import Severity, all_findings

WINDOW_NS = 2_000_000_000  # over which rates are averaged
SHORTEST_S = 0.5  # no rate is given for a shorter time
FEET = {MTX, FOOT, LINES}  # ports of what is worn on the foot


@dataclass(frozen=True, slots=True)
class StreamRates:
    """Rates over the last two seconds (None: not known yet), and counts since the start. The field names are keys of the frame's JSON.

    `lost`: messages that did not arrive. `rejected`: bytes or messages with wrong contents. `late_pings`: pings that came after their segment.
    `wrong`: a fault of the reports, the board or a stream and its remedy, as text; empty if none. `foot`: the sensor worn on the
    foot; its samples are counted in `mtx_hz`.
    """

    mtx_hz: float | None
    pings_hz: float | None
    lost: int
    rejected: int
    late_pings: int
    synchronised: bool
    check_ins: int
    wrong: str
    foot: str = "MTx"
    undone: int = 0


class StreamRateMeter:
    """Turns counters into rates; call `measure` after each portion. `ports`: those there are; `foot`: name of another maker's sensor on the foot."""

    def __init__(self) -> None:
        self.ports: set[str] = set()
        self.foot = ""
        self._counts: deque[tuple[int, int, int]] = deque()  # time (ns), MTx samples, pings
        self._unused = 0  # messages of the MTx that are not samples, when its samples were last counted

    def measure(self, tracker: Tracker, t_ns: int, fault: str = "") -> StreamRates:
        """Rates and counts at `t_ns` of the arrival clock, which must not go back; `fault`: of the run's output."""
        streams = tracker.streams
        board, mtx = streams.board, streams.mtx
        mtx_hz, pings_hz = self._rates_hz(mtx.good, streams.pings, t_ns)
        if mtx_hz != 0.0:
            self._unused = _unused(mtx)
        foot, has_board = self.foot or streams.foot_name, BOARD in self.ports
        advice = _advice(
            streams,
            foot,
            mtx_hz if self.ports & FEET else None,
            pings_hz if has_board else None,
            _unused(mtx) - self._unused,
        )
        return StreamRates(
            mtx_hz=mtx_hz,
            pings_hz=pings_hz if has_board else None,
            lost=board.lost + mtx.lost + streams.reports.dropped,
            rejected=board.rejected + mtx.bad_checksum + mtx.bad_length + mtx.incomplete,
            late_pings=streams.front_end.late_pings,
            synchronised=streams.synchronised,
            check_ins=tracker.state.check_ins,
            wrong=". ".join(filter(None, (fault, advice))),
            foot=foot,
            undone=tracker.state.undone,
        )

    def _rates_hz(self, samples: int, pings: int, t_ns: int) -> tuple[float | None, float | None]:
        """Samples and pings a second over the window; adds these counts to the window."""
        while len(self._counts) > 1 and t_ns - self._counts[1][0] >= WINDOW_NS:
            self._counts.popleft()
        begin_ns, first_samples, first_pings = self._counts[0] if self._counts else (t_ns, samples, pings)
        if not self._counts or t_ns - self._counts[-1][0] >= WINDOW_NS // 20:
            self._counts.append((t_ns, samples, pings))
        span_s = (t_ns - begin_ns) * 1e-9
        if span_s < SHORTEST_S:
            return None, None
        return (samples - first_samples) / span_s, (pings - first_pings) / span_s


def _unused(mtx: MtxCounts) -> int:
    """Number of messages, or of bytes outside of messages, that came from the MTx and gave no sample."""
    return sum(getattr(mtx, field.name) for field in fields(mtx) if field.name not in ("good", "lost"))


def _advice(streams: StreamState, foot: str, mtx_hz: float | None, pings_hz: float | None, unused: int) -> str:
    """The gravest finding and what to do about it. `unused`: messages or bytes from the foot since its last sample, which gave none."""
    if mtx_hz == 0.0 and unused > 0:
        incomplete = " (without counter, acceleration or rate of turn)" if streams.mtx.incomplete else ""
        return f"the {foot} sends no usable samples{incomplete}: look at its settings, its port and its RX line: echostep doctor"
    if mtx_hz == 0.0:
        return f"the {foot} is silent: look at its plug and its power"
    findings = [
        finding for finding in all_findings(streams.reports, streams.foot_reports) if finding.severity > Severity.NOTE
    ]
    if not findings and pings_hz == 0.0:
        return "no pings: look at the board's plug and at the rangers"
    return str(findings[0]) if findings else ""
