# SPDX-License-Identifier: MIT
"""One tracked run: the tracker, and everything that shows, publishes, guides by or records its estimates.

In: a tracker, portions of chunks. Out: estimates to the views, the page, the commander and the recording; result files at the end.
Owns the estimates, the page and the connection to the commander while the run lasts.

`demo`, `live` and `replay` differ only in where their portions come from: all of them pass through `Session.track`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack, nullcontext
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING, Self

from echostep.errors import words_of
from echostep.localization import Estimate
from echostep.ports.chunks import LINES, Portion
from echostep.ports.people.check_in import PERSON
from echostep.ports.people.meeting import MEETING
from echostep.ports.people.team_beacons import TEAM_BEACONS
from echostep.recording import Recording, clock_of, utc_offset_ns
from echostep.tracker import Tracker
from echostep_app.extras import lacks
from echostep_app.guidance.guided_run import guidance_of
from echostep_app.interruption import holding_signals, is_asked
from echostep_app.kernel_parts import LATER, PREPARING, TRACKING, Part, compile_parts, compiling_later
from echostep_app.output.terminal import TerminalView
from echostep_app.plan.places.findings import refusals
from echostep_app.plan.routing import EXIT
from echostep_app.printing.console import console, print_notices
from echostep_app.printing.people import FaultNews, outlast_output
from echostep_app.printing.progress import progress_line
from echostep_app.scorecard.track_columns import ScoredPath
from echostep_app.session.chunk_streams import MessageSource
from echostep_app.session.losses import Arrivals, Losses
from echostep_app.session.options import OutputOptions
from echostep_app.session.results import Result, summary_words, write_results
from echostep_app.session.sinks import (
    Sink,
    derived_sink,
    mark_sink,
    page_sink,
    spoken_cue_sink,
    teammate_sink,
    terminal_sink,
)

if TYPE_CHECKING:
    from echostep_app.page.live import LivePage
    from echostep_app.recording.recorder import DerivedMessage, Recorder
    from echostep_app.session.team.subscription import TeamSubscription
    from echostep_app.team.endpoint import Endpoint, Outlet
    from echostep_app.team.publish import Publishing, Source
import os
import sys
import webbrowser

PAGE_POLL_S = 0.2
IMPORTED = "imported from"  # begins the note of a recording of another maker's sensor
_print_line = partial(console.print, markup=False, highlight=False)


class Session:
    """Serves the page and publishes estimates while it is entered; `track` feeds the tracker, `finish` writes the results."""

    def __init__(
        self,
        tracker: Tracker,
        title: str,
        source: Source,
        output: OutputOptions,
        guide_to: str | None = None,
        recorded: Recording | None = None,
    ) -> None:
        """`source`: origin of the estimates, as stated in reports to commanders; `recorded`: the recording that is replayed.

        `guide_to`: the destination as given. Raises EchostepError for one that there is not.
        """
        outlast_output()
        self.tracker = tracker
        self.title = title
        self.source = source
        self.recorded = recorded
        self.output = output
        self.guided, self._leaves = guidance_of(tracker, guide_to), guide_to == EXIT
        self.losses = Losses(tracker)
        self.arrivals = Arrivals()
        self.page: LivePage | None = None
        self.estimates: list[Estimate] = []
        self.message_sources: list[MessageSource] = []  # what people and team send during the run
        self._publishing: Publishing | None = None
        self._truth: ScoredPath | None = None
        self._sinks: list[Sink] = []
        self._writers: list[Callable[[list[DerivedMessage]], None]] = []  # of what is derived from estimates
        self._opened = ExitStack()
        self._interrupted = False

    def __enter__(self) -> Self:
        for sentence in refusals(self.tracker.plan):
            _print_line(sentence)
        with ExitStack() as opened:  # closes what is open already when a later part cannot be opened
            self._open_page(opened)
            self._open_publishing(opened)
            self._open_team(opened)
            self._open_foxglove(opened)
            self._opened = opened.pop_all()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self.page and error is not None and not isinstance(error, KeyboardInterrupt):
            self.page.fail(words_of(error))
        self._opened.__exit__(kind, error, at)

    @property
    def _broker(self) -> Endpoint | None:
        """The first broker that the run publishes to."""
        return self.output.outlet.broker if self.output.outlet else None

    def _open_page(self, opened: ExitStack) -> None:
        address = self.output.page
        if address is None:
            return
        from echostep_app.page.live import LivePage
        from echostep_app.page.web.addresses import print_page

        replays, keeps = self.recorded is not None, self.source == "simulated"
        page = LivePage(self.tracker, self.title, address, self.guided, replay=replays, keeps=keeps)
        print_page(console, page.server.urls)
        if self._leaves and self.recorded is None:  # past what is struck out on a page
            page.mailbox.set_goal(EXIT)
        page.fault_sources.append(FaultNews().words)
        page.rate_meter.ports.update(self.arrivals.urls)
        note = self.recorded.metadata.get("note", "") if self.recorded else ""
        if LINES in self.arrivals.urls or note.startswith(IMPORTED):
            page.rate_meter.foot = "foot IMU"
        self.page = opened.enter_context(page)
        self._sinks.append(page_sink(page))
        self.message_sources.append((PERSON, page.pop_check_ins))
        if self.output.browser and open_browser(page.url):
            page.wait_for_page()

    def prepare(self, *more: Part) -> None:
        """Compile missing kernels, before the first bytes come: the tracker's, and more."""
        announce = self.page.announce if self.page else lambda _: None
        announce(PREPARING)
        with progress_line(PREPARING.capitalize()) as show:
            compile_parts([*TRACKING, *more], show, lambda share: announce(f"{PREPARING}: {share:.0%}"))
            self.tracker.warm_up()

    def show_truth(self, truth: ScoredPath | None) -> None:
        """Show the true position and the estimate, on the page, and compare with it at the end."""
        self._truth = truth
        if self.page:
            from echostep_app.page.elements.scene import TruePath

            self.page.truth = TruePath.of(truth, self.tracker.plan)

    def _open_publishing(self, opened: ExitStack) -> None:
        if self.output.outlet is None:
            return
        from echostep_app.team.publish import Publishing

        clock = clock_of(self.recorded.metadata) if self.recorded else None
        publishing = Publishing(self.output.outlet, self.tracker, self.source, _print_line, clock)
        self._publishing = opened.enter_context(publishing)
        self._sinks.append(Sink(lambda _, made: publishing.publish(made), end=lambda _: publishing.end()))
        if self.page:
            self.page.receipt_of = publishing.receipt
            self.page.fault_sources.append(lambda: publishing.fault)

    def _open_foxglove(self, opened: ExitStack) -> None:
        if self.output.foxglove is None:
            return
        from echostep_app.output.foxglove_live import FoxgloveServer

        foxglove = opened.enter_context(FoxgloveServer(self.output.foxglove, self.title))
        self._writers.append(foxglove.write)
        console.print(f"Foxglove: open connection, Foxglove WebSocket, {foxglove.url}", highlight=False)

    def _open_team(self, opened: ExitStack) -> None:
        """A live run subscribes to its team at its first broker; in a replay what was received is in the recording."""
        outlet, publishing, broker = self.output.outlet, self._publishing, self._broker
        if self.recorded is not None:
            return
        if outlet is None or publishing is None or broker is None:
            return
        from echostep_app.session.team.subscription import TeamSubscription

        subscription = TeamSubscription(broker, _print_line)
        self._read_team(subscription, outlet, publishing.run)
        opened.callback(subscription.close)
        subscription.open()
        if self.page:  # a broker that is not there is told once
            self.page.fault_sources.append(lambda: "" if publishing.fault else subscription.fault)

    def _read_team(self, subscription: TeamSubscription, outlet: Outlet, run: str) -> None:
        """Read teammates and beacons, and for a page the commanders' marks."""
        from echostep_app.page.mailbox import popped
        from echostep_app.session.team.feeds import MarkFeed
        from echostep_app.session.team.teammate_feed import TeammateFeed

        page, plan = self.page, self.tracker.plan
        teammates = TeammateFeed(subscription, outlet, run, plan)
        self._sinks.append(teammate_sink(teammates, self.tracker, page))
        self.message_sources.append((TEAM_BEACONS, teammates.beacons))
        if page is None:
            return
        self.message_sources.append((MEETING, lambda: teammates.meetings(popped(page.mailbox.met))))
        marks = MarkFeed(subscription, outlet, run, plan.digest)
        page.answer_to = marks.answer_to
        self._sinks.append(mark_sink(marks, page))

    def track(
        self, portions: Iterable[Portion], progress: Callable[[], float] | None = None, recorder: Recorder | None = None
    ) -> None:
        """Feed all portions, until Ctrl-C ends their source; the second one ends the run at once.

        `progress` gives the finished fraction, 0 to 1. `recorder` gets the derived messages of each portion, after the portion was shown.
        """
        shown = self.output.terminal and console.is_terminal
        view = TerminalView(self.tracker, self.title, progress, console) if shown else None
        sinks = self._sinks + self._local_sinks(view, recorder)
        with compiling_later(LATER), view or nullcontext(), holding_signals():
            try:
                for portion in portions:
                    for sink in sinks:
                        sink.arrive()
                    self.arrivals.note(portion)
                    estimates = self.tracker.take(portion)
                    self.estimates += estimates
                    for sink in sinks:
                        sink.take(portion, estimates)
            except KeyboardInterrupt:
                self._interrupted = True
        self._interrupted = self._interrupted or is_asked()

    def _local_sinks(self, view: TerminalView | None, recorder: Recorder | None) -> list[Sink]:
        """The terminal, and what is derived from estimates, for the recording and for viewers."""
        sinks: list[Sink] = []
        if view:
            sinks.append(terminal_sink(view, self.guided))
        elif self.guided:
            sinks.append(spoken_cue_sink(self.guided))
        if writers := [*([recorder.write_derived] if recorder else []), *self._writers]:
            known_ns = utc_offset_ns(self.recorded.metadata) if self.recorded else None
            offset_ns = recorder.log_offset_ns if recorder else known_ns or 0
            sinks.append(derived_sink(self.tracker, writers, offset_ns))
            if self.tracker.plan.georeference and (words := lacks("/location", "pyproj")):
                console.print(f"Longitude and latitude are left out: {words}", markup=False, highlight=False)
        return sinks

    def finish(self, title: str, elapsed_s: float | None = None) -> None:
        """Write track.csv, track.png and cues.csv and print a summary; raises EchostepError when a file cannot be written.

        The page shows the end of the run, and its summary.
        """
        summary = summary_words(self.estimates, self._truth)
        for sink in self._sinks:
            sink.end(summary)
        losses = self.losses.describe(self.arrivals.worn_s)
        silent = [*self.arrivals.silent(), *self.tracker.streams.front_end.foot_doubts]
        result = Result(title, self.estimates, self._truth, elapsed_s, losses, silent)
        write_results(self.output.folder, self.tracker, self.guided, result)

    def keep_page_open(self, again: str = "") -> None:
        """Serve the page after the run: while a browser shows it, or until Ctrl-C if that was asked for.

        `again`: the command that shows the run again; it is printed where no browser shows the page.
        """
        page, stays = self.page, self.output.page_stays
        if page is None or self._interrupted:
            return
        if not (stays or page.server.pages):
            if again:
                console.print(
                    f"No browser shows the page. To see the walk again: {again}", highlight=False, markup=False
                )
            return
        end = "until" if stays else "while it is open, or until"
        console.print(f"The page stays at {page.url} {end} Ctrl-C.", highlight=False)
        try:
            while stays or page.server.pages:
                time.sleep(PAGE_POLL_S)
                print_notices(page.server.shared.faults.notices)
        except KeyboardInterrupt:
            pass


SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")  # one of them is set where windows can be shown, but for Windows and macOS


def open_browser(url: str) -> bool:
    """Start the user's browser; False on a machine without a screen, over ssh, or when none could be started."""
    has_screen = sys.platform in ("win32", "darwin") or any(os.environ.get(name) for name in SCREENS)
    if not has_screen or os.environ.get("SSH_CONNECTION"):
        return False
    try:
        return webbrowser.open(url)
    except webbrowser.Error:
        return False
