"""The live page of a run: watches a tracker and shows what it knows.

In: a tracker, who guides its wearer, and the moment after each portion that it took. Out: scenes on a stage that a server serves; check-ins for the
tracker. Owns both.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from operator import attrgetter
from types import TracebackType
from typing import Self

from echostep.guidance.guided_run import GuidedRun
from echostep.localization.echo_likelihood import echo_model
from echostep.localization.estimate import Estimate, unobserved
from echostep.page.elements.beacon_marks import marks
from echostep.page.elements.echo_lines import beams, expected_range
from echostep.page.elements.guidance import guidance
from echostep.page.elements.lookahead import ahead
from echostep.page.elements.scene import MOST_SHOWN, PageScene, specks, words
from echostep.page.elements.stream_rates import Pulse
from echostep.page.mailbox import Mailbox
from echostep.page.server import Address, PageServer
from echostep.path import MeasuredSegment
from echostep.ports.chunks import BOARD, MTX, Portion
from echostep.tracker import Tracker

STEP_M = 0.02  # the trail gets a point when he has moved so far
PULSE_NS = 250_000_000
SILENT_S = 2.0  # without bytes of the foot or the board
STEPLESS_S = 6.0  # with bytes that tell no step: longer than the first steps are held back
STALE_S = 1.5  # echoes are shown no longer
MOST_KEPT = 2000  # specks of each scene of a film


class LivePage:
    """Call `shown` after each portion; `said` gives what pages had to say, as bytes of chunks."""

    def __init__(
        self, tracker: Tracker, title: str, address: Address, guided: GuidedRun | None = None, *, replay: bool = False
    ) -> None:
        """`guided` was made before, so that its cue of an estimate is there when the page is told of it."""
        self.wanted = True  # until Ctrl-C
        self._tracker = tracker
        self._guided = guided
        self._stage = Mailbox(tracker.plan, title, replay=replay)
        self.server = PageServer(self._stage, address)
        self._model = echo_model(tracker.settings.echo)
        self._pulse = Pulse()
        self._pulsed_ns = 0
        self._arrived_ns = 0
        self._heard_ns = 0  # foot or board
        self._told_ns = 0
        self._ahead: PageScene | None = None  # of the foot's last step, as long as its echoes are not in
        self._ahead_s = -math.inf
        self._new: list[PageScene] = []
        self._scene = PageScene(0, 0.0, None, None, (), None, 0, words(None, waits=tracker.lost_at_start))
        self._replay = replay
        self._last: Estimate | None = None  # in the trail
        self._check_ins = 0
        self._born_ns = time.monotonic_ns()
        if not replay:
            self._stage.publish(self._scene)
        expected_range(0.0, 0.0, 0.0, tracker.laid_out.walls.index, self._model)  # compiled now, not at the first step

    @property
    def url(self) -> str:
        """Address of the page."""
        return self.server.url

    @property
    def pages(self) -> int:
        """How many pages look."""
        return self.server.pages

    def __enter__(self) -> Self:
        self._tracker.watchers.append(self._watch)
        self.server.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._tracker.watchers.remove(self._watch)
        self.server.__exit__(kind, error, at)

    def said(self) -> Iterator[bytes]:
        """Check-ins that pages made since, as the tracker takes them."""
        for check_in in self._stage.said():
            yield check_in.encode()

    def coming(self) -> None:
        """Bytes have come: what is seen next was born now."""
        self._born_ns = time.monotonic_ns()

    def shown(self, portion: Portion) -> None:
        """The tracker has taken a portion: publish what it told, and now and then how the streams are."""
        if len(portion.t_arrival_ns):
            self._arrived_ns = max(self._arrived_ns, int(portion.t_arrival_ns[-1]))
            if BOARD in portion.ports or MTX in portion.ports:
                self._heard_ns = self._arrived_ns
        else:
            self._arrived_ns = max(self._arrived_ns, time.monotonic_ns())
        if self._new:
            self._told_ns = self._arrived_ns
        else:
            self._look_ahead()
        due = self._arrived_ns - self._pulsed_ns >= PULSE_NS
        if due:
            self._pulsed_ns = self._arrived_ns
            self._scene = replace(self._scene, streams=self._pulse.streams(self._tracker, self._arrived_ns))
        if self._new or (due and not self._replay):
            for scene in self._new or [self._meanwhile()]:
                self._stage.publish(replace(scene, streams=self._scene.streams))
            self._new = []

    def _look_ahead(self) -> None:
        """A step that the foot has told is shown at once; its echoes correct it a quarter of a second later."""
        told, since = self._scene.told, self._tracker.intake.ahead
        if self._replay or told is None or self._tracker.leg is None or not since or since[-1].t1_s <= self._ahead_s:
            return
        self._ahead_s = since[-1].t1_s
        there = ahead(told, self._tracker.leg, since)
        cloud = self._scene.specks and self._scene.specks.moved(there.x_m - told.x_m, there.y_m - told.y_m)
        guide = self._scene.guidance and self._scene.guidance.turned(there.heading_rad - told.heading_rad)
        self._ahead = replace(
            self._scene, born_ns=self._born_ns, t_s=there.t_s, told=there, specks=cloud, words=words(there), guidance=guide
        )  # fmt: skip
        self._stage.publish(self._ahead)

    def _meanwhile(self) -> PageScene:
        """What is known without news: when no step has been told for a while, that he may be anywhere near."""
        scene = replace(self._ahead or self._scene, born_ns=self._born_ns)
        if scene.told is None:
            return replace(scene, words=words(None, waits=self._tracker.lost_at_start))
        untold_s = (self._arrived_ns - self._told_ns) * 1e-9
        silent = self._arrived_ns - self._heard_ns >= SILENT_S * 1e9
        if not silent and untold_s < STEPLESS_S:
            return scene
        why = "nothing from the foot" if silent else "no step of the foot"
        guide = scene.guidance and scene.guidance.stopped(f"There is {why}", scene.t_s)
        return replace(
            scene, told=unobserved(scene.told, scene.told.t_s + untold_s), beams=(), words=f"lost: {why} for {untold_s:.0f} s",
            guidance=guide, marks=tuple(replace(mark, heard=False) for mark in scene.marks),
        )  # fmt: skip

    def _watch(self, passage: MeasuredSegment | None, told: Estimate) -> None:
        """The tracker told an estimate."""
        tracker = self._tracker
        self._ahead = None
        last = self._last
        if last is None or max(abs(told.x_m - last.x_m), abs(told.y_m - last.y_m)) > STEP_M or told.level != last.level:
            if tracker.check_ins != self._check_ins:
                self._stage.trail.add(math.nan, math.nan, told.level)
            self._last, self._check_ins = told, tracker.check_ins
            self._stage.trail.add(told.x_m, told.y_m, told.level)
        shown, heard = self._scene.specks, self._scene.beams
        if passage is not None and (particles := tracker.particles(MOST_KEPT if self._replay else MOST_SHOWN)):
            shown = specks(particles)
            sheet = tracker.laid_out
            new = beams(passage, told, told.level * sheet.sheet.pitch_m, sheet.walls.index, self._model)
            heard = (*(old for old in heard if old.ranger not in [beam.ranger for beam in new]), *new)
        heard = tuple(sorted((b for b in heard if told.t_s - b.t_s < STALE_S), key=attrgetter("ranger")))
        guide = self._scene.guidance
        if self._guided and self._guided.cue:
            guide = guidance(self._guided.cue, self._guided.route, told.level, guide)
        self._scene = replace(
            self._scene, born_ns=self._born_ns, t_s=told.t_s, told=told, walked=len(self._stage.trail),
            words=words(told, taps=not self._replay), specks=shown, beams=heard, guidance=guide,
            marks=marks(tracker, told.t_s),
        )  # fmt: skip
        self._new.append(self._scene)
