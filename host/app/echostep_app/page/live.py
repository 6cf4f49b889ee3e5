# SPDX-License-Identifier: MIT
"""The live page of a run, or the page of a replay: watches a tracker and publishes scenes.

In: a tracker, perhaps the guidance of its wearer, and each portion of bytes after the tracker has taken it. Out: scenes in a mailbox that a server
serves; check-ins for the tracker. Owns both.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from operator import attrgetter
from types import TracebackType
from typing import Any, Self

from echostep.echoes.likelihood import echo_model
from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep.ports.chunks import BOARD, FOOT, MTX, Portion
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.guided_return import GuidedReturn
from echostep_app.page.drawing_process import DrawingProcess
from echostep_app.page.elements.alarm import shown_alarm
from echostep_app.page.elements.echo_lines import EchoLine, expected_range, last_echo_lines
from echostep_app.page.elements.guidance import ShownGuidance, guidance_of_cue
from echostep_app.page.elements.likely_places import PlaceNumbers
from echostep_app.page.elements.lookahead import extrapolate, moves_as_one
from echostep_app.page.elements.marks import beacon_marks, shown_meeting
from echostep_app.page.elements.scene import MOST_SHOWN, PageScene, TruePath, is_placed, sample_of, status_text
from echostep_app.page.elements.stream_rates import StreamRateMeter
from echostep_app.page.elements.undo_offer import UndoClock, echoes_fit
from echostep_app.page.mailbox import Mailbox, popped
from echostep_app.page.server import Address, PageServer
from echostep_app.plan.places.bearing import KNOWN_HEADING_RAD
from echostep_app.plan.routing import EXIT, RoutePlace
from echostep_app.ports.arrival_clock import now_ns
from echostep_app.wearer.alarm import watch_of
from echostep_app.wearer.steady_status import SETTLED_S, SteadyStatus, running_note, span_words

# All assumed:
TRAIL_STEP_M = 0.02  # the trail gets a point when x or y has changed by this much
RATES_NS = 250_000_000  # time between two measurements of the stream rates
STEPLESS_S = 6.0  # with bytes but without an estimate: the same; longer than the delay of the first steps
SHOWN_S = 1.5  # an echo line is shown for this long
OPENING_S = 5.0  # longest wait for a browser that was started
OPENING_POLL_S = 0.05
TOLD_S = 2.0  # longest wait for pages to be told of an error
MOST_KEPT = 2000  # particles in each scene of a replay


class LivePage:
    """Call `note_arrival` and `publish` for each portion; `pop_check_ins` gives the pages' check-ins as bytes of chunks.

    `mailbox`: the messages to and from all pages of this run.
    """

    def __init__(
        self,
        tracker: Tracker,
        title: str,
        address: Address | PageServer,
        guided: CueList | None = None,
        *,
        replay: bool = False,
        keeps: bool = False,
    ) -> None:
        """`guided` must have been made before: then it watches the tracker first, and its cue exists when the page gets an estimate.

        `address`: an address, or a server that shows this page while it is entered, and goes on after it.
        `keeps`: keep the scenes of a live run, so that it can be played again after `end`.
        """
        self._tracker, self._watched = tracker, watch_of(tracker)
        self._guided = guided
        self._replay = replay
        self.mailbox = Mailbox(tracker.plan, title, replay=replay, keeps=keeps)
        self.truth: TruePath | None = None  # shown beside the estimates
        self.receipt_of: Callable[[int], str] | None = None  # delivery of a mayday; None: the run's reports go nowhere
        self.fault_sources: list[Callable[[], str]] = []  # present faults of the run's output, in words
        self.answer_to: Callable[[int], str] | None = None  # the commanders' answer to a mayday
        self._owns_server = isinstance(address, Address)
        self.server = PageServer(self.mailbox, address) if isinstance(address, Address) else address
        self._model = echo_model(tracker.settings.echo)
        self.rate_meter = StreamRateMeter()
        self._rates_ns = 0  # times of the last measurement of rates, of the last bytes, of bytes of MTx or board, of the last estimate
        self._arrived_ns = 0
        self._sensors_ns = 0
        self._estimate_ns = 0
        self._bytes_arrived_ns = time.monotonic_ns()
        self._scene = PageScene(
            0, 0.0, None, None, (), None, 0, status_text(None, needs_start=tracker.state.waits_for_start)
        )  # of the last estimate
        self._lookahead: PageScene | None = None  # of the last step, until its echoes have been used
        self._lookahead_s = -math.inf
        self._new: list[PageScene] = []  # to publish
        self._trail_end: Estimate | None = None
        self._trail_breaks = False  # before its next point
        self._check_ins = (0, 0)  # check-ins and undoings
        self._undo_clock, self._numbers, self._steady = UndoClock(), PlaceNumbers(), SteadyStatus()
        self.mailbox.goes_back = not (replay or (tracker.plan.is_drawn and tracker.plan.exits))
        self._back = GuidedReturn(tracker, is_wanted=False) if self.mailbox.goes_back else None
        self._drawing: DrawingProcess | None = None  # of a walk without a plan
        if not replay:
            self.mailbox.publish(self._scene)
        # Compiled now, not at the first step
        expected_range(math.nan, 0.0, 0.0, tracker.laid_out.walls.index, self._model)

    @property
    def url(self) -> str:
        """Address of the page."""
        return self.server.url

    def __enter__(self) -> Self:
        self._tracker.watchers.append(self._watch)
        if self._owns_server:
            self.server.__enter__()
        else:
            self.server.show(self.mailbox)
        if not self._tracker.plan.is_drawn:
            fail = self.server.shared.faults.note_text
            self._drawing = DrawingProcess(self.mailbox.add_drawing, fail, live=not self._replay)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._tracker.watchers.remove(self._watch)
        if self._drawing:
            self._drawing.close()
        if self._owns_server:
            self.server.__exit__(kind, error, at)

    def set_errand(self, x_m: float, y_m: float, level: int, text: str) -> None:
        """Guide all pages to a person in distress, and show who sent the wearer; a level that is not in the plan is ignored."""
        if level < len(self._tracker.plan.levels):
            self.mailbox.set_goal(RoutePlace(x_m, y_m, level), text)

    def announce(self, text: str) -> None:
        """Show the run's activity, until its first bytes."""
        self.mailbox.show(replace(self._scene, status_text=text))

    def wait_for_page(self) -> None:
        """Wait until a browser shows the page, for at most `OPENING_S`."""
        end_s = time.monotonic() + OPENING_S
        while not self.server.pages and time.monotonic() < end_s:
            time.sleep(OPENING_POLL_S)

    def fail(self, words: str) -> None:
        """An error ends the run: pages show it; waits until they have it, for at most `TOLD_S`."""
        self.mailbox.fail(words)
        end_s = time.monotonic() + TOLD_S
        while self.server.pages and time.monotonic() < end_s:
            time.sleep(OPENING_POLL_S)

    def pop_check_ins(self) -> Iterator[bytes]:
        """Check-ins and undoings that pages have made since the last call, encoded as the tracker takes them."""
        for check_in in popped(self.mailbox.check_ins):
            yield check_in.encode()

    def note_alive(self) -> None:
        """The run goes on; a live page says when it no longer does."""
        if not self._replay:
            self.mailbox.exchange.note_alive()

    def note_arrival(self) -> None:
        """Bytes have arrived: their time is the start of the latency of the scenes that follow."""
        self._bytes_arrived_ns = time.monotonic_ns()

    def publish(self, portion: Portion) -> None:
        """The tracker has taken a portion: publish the scenes of its estimates, and the stream rates every quarter of a second."""
        self._advance_clock(portion)
        if self._new:
            self._estimate_ns = self._arrived_ns
        else:
            self._publish_lookahead()
        due = self._arrived_ns - self._rates_ns >= RATES_NS
        if due:
            self._rates_ns = self._arrived_ns
        if not (due or self._new):
            return
        state_fields = self._state_fields()
        self._scene = replace(self._scene, **state_fields)
        if self._new or not self._replay:
            for old in self._new or [self._scene_without_news()]:
                scene = replace(old, **state_fields)
                self.mailbox.publish(scene)
                if self._new:
                    self.mailbox.keep(scene)
            self._new = []

    def _state_fields(self) -> dict[str, Any]:
        """The fields of a scene that follow the tracker's state rather than an estimate."""
        state = self._tracker.state
        fault = ". ".join(filter(None, (words() for words in self.fault_sources)))
        return {
            "streams": self.rate_meter.measure(self._tracker, self._arrived_ns, fault),
            "undo": None if self._replay else self._undo_clock.offer(state, time.monotonic_ns()),
            "echoes_fit": echoes_fit(state),
            "alarm": shown_alarm(
                self._watched,
                self._tracker.front_end.newest_s,
                receipt_of=self.receipt_of,
                answer_to=self.answer_to,
            ),
            "met": shown_meeting(state),
        }

    def _advance_clock(self, portion: Portion) -> None:
        """The arrival clock: time of the newest chunk, or the host's clock when a portion is empty."""
        if len(portion.t_arrival_ns):
            self._arrived_ns = max(self._arrived_ns, int(portion.t_arrival_ns[-1]))
            self.rate_meter.ports.update(portion.ports)
            if {BOARD, MTX, FOOT} & set(portion.ports):
                self._sensors_ns = self._arrived_ns
        else:
            self._arrived_ns = max(self._arrived_ns, now_ns())

    def _publish_lookahead(self) -> None:
        """Publish a new step of the foot at once, by dead reckoning; the estimate with its echoes follows about 0.25 s later."""
        estimate, state = self._scene.estimate, self._tracker.state
        later = state.pending_segments
        if self._replay or estimate is None or state.last_segment is None:
            return
        if not later or later[-1].t1_s <= self._lookahead_s:
            return
        self._lookahead_s = later[-1].t1_s
        moved = replace(estimate, t_s=self._lookahead_s)  # a mean that is no place, or whose heading is unknown, stays
        if is_placed(estimate, self._tracker.plan) and estimate.heading_sd_rad <= KNOWN_HEADING_RAD:
            moved = extrapolate(estimate, state.last_segment, later)
        if moved.status is not estimate.status:  # it is worse
            self._steady.worst(moved.t_s, moved.status)
        particles, guidance = self._scene.particles, self._scene.guidance
        dx_m, dy_m = moved.x_m - estimate.x_m, moved.y_m - estimate.y_m
        self._lookahead = replace(
            self._scene,
            arrived_ns=self._bytes_arrived_ns,
            t_s=moved.t_s,
            estimate=moved,
            particles=particles and (particles.moved(dx_m, dy_m) if moves_as_one(estimate) else particles),
            status_text=status_text(moved, no_plan=not self._tracker.plan.is_drawn),
            guidance=guidance and guidance.turned(moved.heading_rad - estimate.heading_rad),
            truth=self.truth.at(moved.t_s) if self.truth else None,
        )
        self.mailbox.publish(self._lookahead)

    def _scene_without_news(self) -> PageScene:
        """The last scene again; without bytes or steps for too long: the same with a grown ellipse, and the status that follows from it."""
        scene = replace(self._lookahead or self._scene, arrived_ns=self._bytes_arrived_ns)
        if scene.estimate is None:
            return replace(scene, status_text=status_text(None, needs_start=self._tracker.state.waits_for_start))
        age_s = (self._arrived_ns - self._estimate_ns) * 1e-9
        silent = self._arrived_ns - self._sensors_ns >= SETTLED_S * 1e9
        if not silent and age_s < STEPLESS_S:
            return scene
        reason = "nothing from the foot" if silent else "no step of the foot"
        late = scene.estimate.unobserved(scene.estimate.t_s + age_s)
        return replace(
            scene,
            estimate=late,
            echo_lines=(),
            status_text=f"{late.status.value}: {reason} for {span_words(age_s)}",
            gait="",
            guidance=scene.guidance and scene.guidance.stopped(f"There is {reason}", scene.t_s),
            beacons=tuple(replace(mark, heard=False) for mark in scene.beacons),
        )

    def _watch(self, measured: MeasuredSegment | None, estimate: Estimate) -> None:
        """Make a scene of the tracker's new estimate. `measured` None: the foot is silent, and there are no new echoes."""
        self._lookahead, estimate = None, self._steady.shown(estimate, self._tracker)
        self._extend_trail(estimate)
        if self._drawing and measured is not None:
            self._drawing.add(measured, estimate, len(self.mailbox.trail))
        published = None if measured is None else self._tracker.particles(MOST_KEPT if self._replay else MOST_SHOWN)
        self._scene = replace(
            self._scene,
            arrived_ns=self._bytes_arrived_ns,
            t_s=estimate.t_s,
            estimate=estimate,
            trail_count=len(self.mailbox.trail),
            status_text=status_text(estimate, accepts_taps=not self._replay, no_plan=not self._tracker.plan.is_drawn),
            particles=self._scene.particles if published is None else sample_of(published),
            echo_lines=self._echo_lines(measured, estimate),
            numbers=self._numbers.of(estimate),
            gait=running_note(None if measured is None else measured.segment, estimate),
            guidance=self._guidance(estimate),
            beacons=beacon_marks(self._tracker, estimate.t_s),
            truth=self.truth.at(estimate.t_s) if self.truth else None,
        )
        self._new.append(self._scene)

    def _extend_trail(self, estimate: Estimate) -> None:
        """Append the estimate to the trail when it has moved; a check-in, its undoing, or a time without a place breaks the line."""
        end, trail = self._trail_end, self.mailbox.trail
        if not is_placed(estimate, self._tracker.plan):
            self._trail_breaks = end is not None
            return
        moved_m = max(abs(estimate.x_m - end.x_m), abs(estimate.y_m - end.y_m)) if end is not None else math.inf
        if end is not None and estimate.level == end.level and moved_m <= TRAIL_STEP_M:
            return
        state = self._tracker.state
        check_ins = state.check_ins, state.undone
        if check_ins != self._check_ins or self._trail_breaks:
            trail.add(math.nan, math.nan, estimate.level)
        self._trail_end, self._check_ins, self._trail_breaks = estimate, check_ins, False
        trail.add(estimate.x_m, estimate.y_m, estimate.level)

    def _echo_lines(self, measured: MeasuredSegment | None, estimate: Estimate) -> tuple[EchoLine, ...]:
        """The newest line of each ranger that is not older than `SHOWN_S`."""
        lines = self._scene.echo_lines
        if measured is not None:
            laid_out = self._tracker.laid_out
            east_m = estimate.level * laid_out.sheet.pitch_m
            new = last_echo_lines(measured, estimate, east_m, laid_out.walls, self._model)
            lines = (*(old for old in lines if old.ranger not in [line.ranger for line in new]), *new)
        return tuple(sorted((line for line in lines if estimate.t_s - line.t_s < SHOWN_S), key=attrgetter("ranger")))

    def _guidance(self, estimate: Estimate) -> ShownGuidance | None:
        guided = self._guided
        if self._back:
            self._back.is_wanted = self.mailbox.goal == EXIT
            guided = self._back if self._back.is_wanted else guided
        if guided is None or guided.cue is None:
            return None
        shown = guidance_of_cue(guided.cue, guided.route, estimate.level, self._scene.guidance)
        return replace(shown, own=guided is not self._guided)
