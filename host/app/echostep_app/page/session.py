# SPDX-License-Identifier: MIT
"""The session of one wearer's page: sends scenes, takes requests.

In: a WebSocket, the mailbox. Out: frames. Owns the state sent to this page and its position in a replay.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque

from starlette.websockets import WebSocket, WebSocketDisconnect

from echostep.errors import EchostepError
from echostep.localization import Estimate
from echostep.ports.people.check_in import Call, CheckIn, Undo
from echostep_app.page import protocol, requests
from echostep_app.page.elements.drawn_walls import NO_DRAWING, ShownDrawing
from echostep_app.page.elements.guidance import Destination, ShownGuidance
from echostep_app.page.elements.marks import ShownMark, ShownOrder
from echostep_app.page.elements.scene import PageScene, ParticleSample, is_placed
from echostep_app.page.guarded_socket import UNKNOWN, GuardedSocket
from echostep_app.page.mailbox import Mailbox
from echostep_app.page.player import Player
from echostep_app.page.shared import Shared
from echostep_app.plan.places.bearing import heading_words
from echostep_app.plan.routing import EXIT, Goal, Route, RoutePlace

TOO_BUSY = "Not accepted: this is a replay, or the tracker is too busy."


class PageSession(GuardedSocket):
    """Serves one page until it disconnects."""

    def __init__(self, socket: WebSocket, mailbox: Mailbox, shared: Shared) -> None:
        # From the arrival of an estimate's bytes to its frame being drawn
        self.latency_s: deque[float] = deque(maxlen=512)
        super().__init__(socket, mailbox.exchange, shared.faults, shared.counts)
        self._mailbox = mailbox
        self._shared = shared
        self._player = Player(mailbox.history) if mailbox.replay else None
        self._destination: Destination | None = None
        self._aim: tuple[Goal | None, tuple[RoutePlace, ...]] = None, ()  # destination, and what is closed
        self._searches: set[asyncio.Task[None]] = set()
        self._last: PageScene | None = None
        self._particles: ParticleSample | None = None
        self._marks: tuple[ShownMark, ...] | None = None  # that the page has
        self._orders: tuple[ShownOrder, ...] = ()
        self._drawing: ShownDrawing | None = None  # that the page has
        self._team: tuple[str, ...] | None = None  # that the page has
        self._trail_count = 0  # points of the trail that the page has
        self._told_end = False

    async def _greet(self) -> None:
        mailbox, shared = self._mailbox, self._shared
        replay = self._player is not None
        hello = protocol.hello(
            mailbox.plan, mailbox.title, mailbox.exchange.run, replay=replay, takes_files=shared.takes_files
        )
        await self.tell(protocol.encode(hello))

    async def _begin_replay(self) -> None:
        """The live run is over: from now on the page plays its scenes, beginning with the last one, paused."""
        self._player = Player(self._mailbox.history, at_end=True)
        self._trail_count, self._particles, self._drawing, self._frame_due = 0, None, None, True
        await self._greet()

    async def _handle(self, text: str | None) -> str:
        refusal = ""
        request = None if text is None else requests.parse_request(text)
        levels = len(self._mailbox.plan.levels)
        match request:
            case None:
                self._counts.unknown += 1
                return UNKNOWN
            case requests.FrameDrawn(seq):
                if (arrived_ns := self._undrawn.pop(seq, None)) is not None:
                    self.latency_s.append((time.monotonic_ns() - arrived_ns) * 1e-9)
            case requests.Consider() if request.level < levels:
                answer = self._shared.taps.consider(request.check_in, self._mailbox.latest)
                await self.tell(protocol.encode(answer))
            case CheckIn() if request.level < levels:
                refusal = self._shared.taps.refusal(request) or self._take(request)
            case Undo():
                offer = self._mailbox.latest.undo if self._mailbox.latest else None
                is_late = offer is None or offer.undo != request.undo
                refusal = "It is too late to undo this." if is_late else self._take(request)
            case Call() | requests.Understood() | requests.Met():
                refusal = self._take(request)
            case requests.GoTo() if request.level < levels:
                act = self._mailbox.strike if isinstance(request, requests.Strike) else self._mailbox.set_goal
                act(request.goal)
            case requests.GoOut() | requests.EndGuidance():
                self._mailbox.set_goal(EXIT if isinstance(request, requests.GoOut) else None)
            case requests.SetPlaying() | requests.SetSpeed() | requests.Seek() | requests.Step() if self._player:
                self._player.handle(request)
                self._frame_due = True
            case _:
                self._counts.refused += 1
        self._news.set()
        return refusal

    def _take(self, request: CheckIn | Undo | Call | requests.Understood | requests.Met) -> str:
        """Queue a page's message for the run; the reason of a refusal, else empty."""
        mailbox = self._mailbox
        if mailbox.summary is not None:
            return "The run has ended."
        match request:
            case requests.Understood(identity):
                taken = mailbox.add(mailbox.understood, identity)
            case requests.Met(name) if name not in mailbox.team:
                return f"{name} is not heard."
            case requests.Met(name):
                taken = mailbox.add(mailbox.met, name)
            case _:
                taken = mailbox.add(mailbox.check_ins, request)
        return "" if taken else TOO_BUSY

    async def _tell_run(self) -> None:
        mailbox = self._mailbox
        if mailbox.failure:
            await self.tell(protocol.encode(protocol.Failed(mailbox.failure, ended=True)))
            raise WebSocketDisconnect
        if self._player is None and mailbox.replay:
            await self._begin_replay()
        if mailbox.summary is not None and not self._told_end:
            self._told_end = self._frame_due = True

    async def _next_frame(self) -> bytes | None:
        # Any page may have changed the run's goal, or what is closed.
        aim = goal, _ = self._mailbox.goal, self._mailbox.closed
        if aim != self._aim:
            self._destination, self._frame_due, self._aim = None if goal is None else Destination(goal), True, aim
        scene = self._scene()
        if scene is None or not (self._frame_due or self._is_new(scene)):
            return None
        return self._frame(scene)

    def _scene(self) -> PageScene | None:
        """What this page shows; None while there is nothing."""
        if self._player is None:
            return self._mailbox.latest
        t_s = self._player.move(time.monotonic())
        return self._mailbox.latest if t_s is None else self._mailbox.history.at(t_s)

    def _is_new(self, scene: PageScene) -> bool:
        """Whether the page lacks something of what it would be sent with a scene."""
        mailbox = self._mailbox
        had = (self._last, self._marks, self._orders, self._team, self._drawing)
        now = (scene, mailbox.marks, mailbox.orders, mailbox.team, mailbox.drawing_at(scene.t_s))
        playing = self._player is not None and self._player.playing
        return playing or any(new is not old for new, old in zip(now, had, strict=True))

    def _frame(self, scene: PageScene) -> bytes:
        """A frame with what this page has not been sent yet; from then on it counts as sent."""
        new_estimate = self._player is None and (self._last is None or scene.estimate is not self._last.estimate)
        begin = min(self._trail_count, scene.trail_count)  # a replay may go back
        drawing = self._mailbox.drawing_at(scene.t_s)
        parts = protocol.FrameParts(
            seq=self._numbered(scene.arrived_ns if new_estimate else None),
            where=self._shared.taps.where(scene.estimate) if scene.estimate else "",
            heading=self._heading(scene.estimate) if scene.estimate else "",
            placed=scene.estimate is not None and is_placed(scene.estimate, self._mailbox.plan),
            places=self._shared.taps.places(scene.estimate, scene.numbers) if scene.estimate else "",
            trail=self._mailbox.trail.part(begin, scene.trail_count),
            trail_from=begin,
            particles=scene.particles if scene.particles is not self._particles else None,
            guidance=self._guidance(scene),
            goal=self._mailbox.goal,
            errand=self._mailbox.errand,
            orders=self._mailbox.orders,
            play=self._player.state() if self._player else None,
            marks=self._mailbox.marks if self._marks is not self._mailbox.marks else None,
            drawing=(drawing or NO_DRAWING) if drawing is not self._drawing else None,
            team=self._mailbox.team if self._team is not self._mailbox.team else None,
            ended=self._mailbox.summary if self._player is None or self._player.at_end else None,
        )
        self._marks, self._team, self._drawing = self._mailbox.marks, self._mailbox.team, drawing
        self._orders = self._mailbox.orders
        self._last, self._trail_count, self._particles = scene, scene.trail_count, scene.particles
        return protocol.frame(scene, parts)

    def _heading(self, estimate: Estimate) -> str:
        """The heading in words."""
        return f"heading {heading_words(self._mailbox.plan, estimate.heading_rad, estimate.heading_sd_rad)}"

    def _guidance(self, scene: PageScene) -> ShownGuidance | None:
        """Guidance to the destination chosen on a page, else the run's; starts a search for a route when one is due."""
        if not (scene.estimate and self._destination) or (scene.guidance and scene.guidance.own):
            return scene.guidance
        guidance = self._destination.guidance_at(scene.estimate)
        is_searched = not (self._mailbox.goes_back and self._destination.goal == EXIT)
        if is_searched and self._destination.needs_route(scene.estimate):
            self._destination.searching = True
            task = asyncio.create_task(self._search(self._destination, scene.estimate))
            self._searches.add(task)
            task.add_done_callback(self._searches.discard)
        return guidance

    def _way(self, estimate: Estimate, goal: Goal) -> Route:
        """The route to a destination past what is closed."""
        here = RoutePlace(estimate.x_m, estimate.y_m, estimate.level)
        return self._shared.ways.past(self._mailbox.closed).way(here, goal)

    async def _search(self, destination: Destination, estimate: Estimate) -> None:
        """Search for the route to a destination in a thread; frames are sent meanwhile."""
        try:
            route = await asyncio.to_thread(self._way, estimate, destination.goal)
            destination.set_route(route, "", estimate)
        except EchostepError as error:
            destination.set_route(None, str(error), estimate)
        except Exception as error:  # a search that fails must not seem to go on for ever
            destination.set_route(None, self._shared.faults.note(error), estimate)
        self._frame_due = True
        self._news.set()
