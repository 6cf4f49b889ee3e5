# SPDX-License-Identifier: MIT
"""A foot that rests too briefly for a walk is said to run, on terminal and page and in the record, beside a status that stays as it is."""

from __future__ import annotations

import io
import math
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from echostep.foot.steps import Stance, Step, walk_track
from echostep.foot.trunk_path import MIDDLE_SD_S, GaitSettings, TrunkPath
from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment, PathSegment
from echostep.ports.chunks import MTX, Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.output.derived import STEP, Derived
from echostep_app.output.terminal import TerminalView
from echostep_app.page.live import LivePage
from echostep_app.page.server import Address
from echostep_app.wearer.steady_status import running_note
from echostep_studies.bench.recordings.feet import SETS
from echostep_studies.frame.recordings import DATA, recordings_in
from needs_data import needs_data
from page.frames import PLAN, told

RUN = PathSegment(0.0, 0.7, 1.5, 0.0, 0.0, 0.0, 0.09, 0.01, 1, running=True)
WALK = replace(RUN, running=False)


def path_of(rests_s: list[float]) -> list[PathSegment]:
    """The segments of steps of 0.5 s, each after a rest of so long."""
    path, t_s, segments = TrunkPath(GaitSettings()), 0.0, []
    for rest_s in rests_s:
        still = np.arange(t_s, t_s + rest_s, 0.01)
        segments += [segment for _, segment in path.add_standing(still, np.zeros(len(still)))]
        segments += path.add_stance(Stance(t_s, t_s + rest_s, 0.0))
        segments += path.add_step(
            Step(t_s + rest_s, t_s + rest_s + 0.5, (1.2, 0.0, 0.0), 0.08**2 * np.eye(3), 0.0, 0.01)
        )
        t_s += rest_s + 0.5
    return segments


def running_of(segments: list[PathSegment]) -> list[bool]:
    return [segment.running for segment in segments if math.hypot(segment.dx_m, segment.dy_m) > 0.1]


def test_a_walk_is_no_run_and_one_longer_rest_does_not_end_a_run() -> None:
    assert not any(running_of(path_of([2.0, 0.3, 0.3, 0.3])))
    assert running_of(path_of([2.0, 0.08, 0.2, 0.08, 0.3, 0.3])) == [False, True, True, True, True, False]


def test_who_stands_runs_no_more() -> None:
    segments = path_of([0.3, 0.08, 3.0, 0.3])
    assert running_of(segments) == [False, True, False, False]
    assert not [segment for segment in segments if segment.dx_m < 0.1 and segment.t0_s > 2.0 and segment.running]


def test_a_running_trunk_is_over_the_foot_in_the_middle_of_its_brief_rest() -> None:
    """After a stand and after a walk, from the third step on: at 3 m/s a fifth of a second is 0.6 m."""
    rests_s = [3.0, 0.06, 0.06, 0.4, 0.4, 0.4, 0.4, 0.06, 0.06, 0.06]
    steps = [s for s in path_of(rests_s) if s.dx_m > 0.1]
    middles_s = [0.5 * rest + sum(rests_s[:k]) + 0.5 * k for k, rest in enumerate(rests_s)][1:]
    late_s = np.subtract([s.t1_s for s in steps[:-1]], middles_s)
    assert abs(late_s[8]) < 0.01
    assert max(late_s) < 0.2
    assert steps[-1].anchor_sd_m == pytest.approx(MIDDLE_SD_S * 1.2 / 0.56, rel=0.1)


@pytest.mark.slow
@needs_data()
def test_runs_and_walks_of_real_feet() -> None:
    """The three trials of runs with motion capture, and six walks on stairs and level ground (real)."""
    shares = {}
    for recording in recordings_in(DATA, [kind for kind in SETS if kind[0] in ("vicon_more", "stairs", "xio")]):
        path, running = TrunkPath(GaitSettings()), []
        for event in walk_track(recording.t_s, recording.accel, recording.gyro).events:
            running += running_of(path.add_stance(event) if isinstance(event, Stance) else path.add_step(event))
        shares[recording.name] = float(np.mean(running))
    runs = {name for name, share in shares.items() if share > 0.0}
    assert runs == {"2017-11-27-11-18-11", "2017-11-27-11-22-22", "2017-12-15-18-03-05"}
    assert min(shares[name] for name in runs) > 0.8


@pytest.mark.parametrize(
    ("segment", "estimate", "said"),
    [
        (RUN, told(sd_m=0.5), "running: position good to about 1.2 m"),
        (RUN, told(sd_m=1.2, status=TrackStatus.UNCERTAIN), "running: position good to about 2.9 m"),
        (RUN, told(status=TrackStatus.LOST), "running"),
        (WALK, told(), ""),
        (None, told(), ""),
        (RUN, None, ""),
    ],
)
def test_the_note(segment: PathSegment | None, estimate: Estimate | None, said: str) -> None:
    assert running_note(segment, estimate) == said


def noted(tracker: Tracker, segment: PathSegment | None, estimate: Estimate) -> None:
    """Tell those who watch a tracker of an estimate."""
    for watch in tracker.watchers:
        watch(segment and MeasuredSegment(segment, *(np.zeros(0),) * 3), estimate)  # type: ignore[arg-type]


def test_the_page_says_it_until_the_foot_walks_or_is_silent() -> None:
    tracker, notes = Tracker(PLAN), []
    with LivePage(tracker, "test", Address(port=0)) as page:
        for t_s, segment in enumerate((WALK, RUN, WALK, RUN), 1):
            noted(tracker, segment, replace(told(t_s=t_s), status=TrackStatus.UNCERTAIN))
            page.publish(portion_of([Chunk(MTX, t_s * 10**9, b"")]))
            scene = page.mailbox.latest
            assert scene
            assert scene.status_text.startswith("uncertain")
            notes.append(scene.gait)
        page.publish(portion_of([Chunk("person", 60 * 10**9, b"")]))
        assert page.mailbox.latest
        notes.append(page.mailbox.latest.gait)
    assert [note[:8] for note in notes] == ["", "running:", "", "running:", ""]


@pytest.mark.parametrize(("width", "height"), [(80, 24), (160, 60)])
def test_the_terminal_is_filled_and_says_that_the_foot_is_silent(
    monkeypatch: pytest.MonkeyPatch, width: int, height: int
) -> None:
    monkeypatch.setattr("echostep_app.output.terminal.SILENT_S", -1.0)
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=width, height=height, color_system=None)
    with TerminalView(Tracker(PLAN), "test", console=console) as view:
        view.show([told()], final=True)
    shown = text.getvalue()
    assert "MTx is silent" in shown
    assert "%" not in shown.split("walk ")[-1]  # nothing says how long this run goes on
    assert max(map(len, shown.splitlines())) > 0.6 * width
    assert "╰" in shown.split("walk ")[-1]  # the frame is whole


def test_the_record_says_it_of_each_step() -> None:
    tracker = Tracker(PLAN)
    derived, told_ = Derived(tracker), []
    for step, segment in enumerate((WALK, RUN, WALK), 1):
        estimate = replace(told(t_s=float(step)), step=step)
        noted(tracker, replace(segment, sd_m=0.05 * step), estimate)
        told_.append(estimate)
    bodies = [note.body for note in derived.take(portion_of([]), told_) if note.topic is STEP]
    assert [(body["step"], body["running"], body["sd_m"]) for body in bodies] == [
        (2, True, pytest.approx(0.1)), (3, False, pytest.approx(0.15)),
    ]  # fmt: skip
