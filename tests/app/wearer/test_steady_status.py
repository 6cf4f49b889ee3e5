# SPDX-License-Identifier: MIT
"""The word of page, terminal and reports: worse at once, better once it has held for HOLD_S of the estimates' own time."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

from echostep.localization import Estimate, TrackStatus
from echostep.plan import Pose
from echostep.ports.chunks import MTX, Chunk, portion_of
from echostep.ports.people.check_in import PERSON, CheckIn
from echostep.tracker import Tracker
from echostep_app.page.live import LivePage
from echostep_app.team.outbox import stamped, steadied
from echostep_app.wearer.steady_status import HOLD_S, SteadyStatus
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import START_NS, Scenario
from page.frames import LOCAL, PLAN
from team.team_reports import POSITION, report

LATE_NS = 1_400_000_000  # so long the MTx's bytes wait in a busy computer, longer than the second that makes a dropout
BUSY_S = 9.0  # then it is no longer busy
WORSE = list(TrackStatus)


def walked() -> list[Chunk]:
    """A walk of 11 m, then at rest, as a busy computer reads it."""
    scenario = Scenario(PLAN, ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8)), 5, PythonBoard(seed=5))

    def late(chunk: Chunk) -> Chunk:
        at_ns = chunk.t_arrival_ns
        is_late = chunk.port == MTX and at_ns < START_NS + BUSY_S * 1e9
        return replace(chunk, t_arrival_ns=(at_ns // LATE_NS + 1) * LATE_NS) if is_late else chunk

    return sorted(map(late, scenario.chunks()), key=lambda chunk: chunk.t_arrival_ns)


def shown(chunks: list[Chunk], size: int, *, replay: bool) -> tuple[list[Estimate], list[Estimate]]:
    """Estimates of the tracker, and as the page shows them, from portions of so many chunks."""
    tracker, own, page_has = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1), list[Estimate](), list[Estimate]()
    with LivePage(tracker, "test", LOCAL, replay=replay) as page:
        for begin in range(0, len(chunks), size):
            portion = portion_of(chunks[begin : begin + size])
            own += tracker.take(portion)
            page_has += [scene.estimate for scene in page._new if scene.estimate]
            page.publish(portion)
    return own, page_has


def words_of(estimates: list[Estimate]) -> list[str]:
    return [word.value for word, _ in groupby(e.status for e in estimates)]


def test_a_busy_computer_says_lost_once() -> None:
    chunks = walked()
    own, live = shown(chunks, 5, replay=False)
    _, replayed = shown(chunks, 3000, replay=True)
    assert len(words_of(own)) > 8
    said = words_of(live)
    assert (
        said == ["tracking", "lost", "uncertain", "tracking"][: max(len(said), 3)]
    )  # 11 m are short: it may end there
    assert live == replayed  # although a live page shows steps ahead of their echoes, too
    assert all(WORSE.index(said.status) >= WORSE.index(was.status) for was, said in zip(own, live, strict=True))
    last_s = max(e.t_s for e in own if e.status is TrackStatus.LOST)
    assert {e.status.value for e in live if last_s <= e.t_s < last_s + HOLD_S} == {"lost"}


def test_a_check_in_is_believed_at_once() -> None:
    tracker, steady = Tracker(PLAN, Pose(2.0, 7.5, 0.0), seed=1), SteadyStatus()
    (*_, last) = tracker.take(portion_of(walked()))
    assert steady.shown(replace(last, status=TrackStatus.LOST), tracker).status is TrackStatus.LOST
    assert steady.shown(last, tracker).status is TrackStatus.LOST
    assert steady.worst(last.t_s - 60.0, last.status) is last.status  # a clock that went back
    assert steady.worst(last.t_s, TrackStatus.LOST) is TrackStatus.LOST
    (stated,) = tracker.feed(Chunk(PERSON, 0, CheckIn(last.x_m, last.y_m, None, 0.1).encode()))
    assert steady.shown(stated, tracker).status is stated.status is TrackStatus.TRACKING


def test_a_report_that_was_late_does_not_turn_from_lost_to_tracked_and_back() -> None:
    """An estimate each three seconds is lost by its age before the next one; then there is one each second."""
    steady, said = SteadyStatus(), list[str]()
    for t_s, age_s in ((0.0, 0.1), (0.0, 2.5), (3.0, 0.1), (3.0, 2.5), (6.0, 0.1), (7.0, 0.1), (8.0, 0.1)):
        made = steadied(stamped(report(position=replace(POSITION, t_s=t_s)), 1, 1.8e9, age_s, 0), age_s, steady)
        assert (made.position is None) == (made.status == "lost")
        said.append(made.status)
    assert said == ["tracking", *["lost"] * 5, "tracking"]
