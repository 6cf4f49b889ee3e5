# SPDX-License-Identifier: MIT
"""Where the estimates of a run go: page, commander, team, recording and viewers, terminal.

In: portions, each after the tracker has taken it, with its estimates. Out: calls of what shows, sends or records them. Owns nothing: `Session` opens
and closes what the sinks write to.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from echostep.localization.estimate import Estimate
from echostep.ports.chunks import Portion
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.cues import arrow_sign, describe_cue
from echostep_app.output.derived import Derived
from echostep_app.output.terminal import TerminalView
from echostep_app.recording.recorder import DerivedMessage
from echostep_app.session.console import console, print_notices

if TYPE_CHECKING:
    from echostep_app.page.live import LivePage
    from echostep_app.page.shared_drawing import SharedDrawing
    from echostep_app.session.team.mark_feed import MarkFeed
    from echostep_app.session.team.teammate_feed import TeammateFeed
    from echostep_app.team.publish import Publishing


class Sink:
    """One place where estimates go; a sink overrides what concerns it."""

    def arrive(self) -> None:
        """Bytes have arrived; the tracker takes them next."""

    def take(self, portion: Portion, estimates: list[Estimate], /) -> None:
        """The tracker has taken a portion and made these estimates of it."""

    def end(self, summary: str, /) -> None:
        """The run is over; `summary` describes it."""


class PageSink(Sink):
    """The page of the run."""

    def __init__(self, page: LivePage) -> None:
        self._page = page

    def arrive(self) -> None:
        """Note the time, from which the page counts its latency."""
        self._page.note_arrival()

    def take(self, portion: Portion, _estimates: list[Estimate], /) -> None:
        """Publish scenes; the page has the estimates from the tracker."""
        self._page.publish(portion)
        print_notices(self._page.notices)

    def end(self, summary: str, /) -> None:
        """Show the end and the summary."""
        self._page.end(summary)


class ReportSink(Sink):
    """Reports to commanders."""

    def __init__(self, publishing: Publishing) -> None:
        self._publishing = publishing

    def take(self, _portion: Portion, estimates: list[Estimate], /) -> None:
        """Report estimates, and without any that the run goes on."""
        self._publishing.publish(estimates)


class TeammateSink(Sink):
    """Exchange with teammates: this wearer's beacons and drawing for them, their names for the page."""

    def __init__(
        self, teammates: TeammateFeed, tracker: Tracker, page: LivePage | None, drawing: SharedDrawing | None
    ) -> None:
        self._teammates, self._tracker, self._page, self._drawing = teammates, tracker, page, drawing

    def take(self, _portion: Portion, estimates: list[Estimate], /) -> None:
        """Share beacons and drawing when they are due, and offer meetings with teammates when their names have changed."""
        names = self._teammates.news()
        if estimates:
            self._teammates.share(self._tracker.own_beacons)
        if self._drawing:
            self._teammates.share_drawing(self._drawing)
        if self._page and names is not None:
            self._page.set_team(names)

    def end(self, _summary: str, /) -> None:
        """Report a drawing that was too large to be shared."""
        if self._drawing and self._drawing.too_long:
            console.print("The drawing became too large for the team: what was drawn later was not sent")


class MarkSink(Sink):
    """The commanders' marks and the wearer's errand, for the page."""

    def __init__(self, marks: MarkFeed, page: LivePage) -> None:
        self._marks, self._page = marks, page

    def take(self, _portion: Portion, _estimates: list[Estimate], /) -> None:
        """Show the marks when they have changed, and the way to the one in distress."""
        if (marks := self._marks.news()) is not None:
            self._page.set_marks(marks)
        if errand := self._marks.new_errand():
            self._page.set_errand(errand.x_m, errand.y_m, errand.level, errand.words)


class DerivedSink(Sink):
    """Messages that are derived from estimates, for the recording and for viewers."""

    def __init__(
        self, tracker: Tracker, writers: Sequence[Callable[[list[DerivedMessage]], None]], log_offset_ns: int = 0
    ) -> None:
        self._derived, self._writers = Derived(tracker, log_offset_ns), writers

    def take(self, portion: Portion, estimates: list[Estimate], /) -> None:
        """Write the messages of a portion."""
        messages = self._derived.take(portion, estimates)
        for write in self._writers:
            write(messages)


class TerminalSink(Sink):
    """The terminal view, with the newest cue."""

    def __init__(self, view: TerminalView, guided: CueList | None) -> None:
        self._view, self._guided = view, guided

    def take(self, _portion: Portion, estimates: list[Estimate], /) -> None:
        """Show estimates and cue."""
        cue = self._guided.cue if self._guided else None
        self._view.show(estimates, describe_cue(cue) if cue else "")


class SpokenCueSink(Sink):
    """A line for each cue that is spoken, where there is no terminal view."""

    def __init__(self, guided: CueList) -> None:
        self._guided = guided

    def take(self, _portion: Portion, _estimates: list[Estimate], /) -> None:
        """Print the new cues."""
        for cue in self._guided.news():
            if cue.spoken:
                console.print(f"{cue.t_s:7.1f} s  {arrow_sign(cue.arrow_rad)}  {cue.spoken}")
