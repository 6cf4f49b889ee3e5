# SPDX-License-Identifier: MIT
"""Where the estimates of a run go: page, commander, team, recording and viewers, terminal.

In: portions, each after the tracker has taken it, with its estimates. Out: calls that show, send or record them. Owns nothing: `Session` opens
and closes what the sinks write to.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from echostep.localization import Estimate
from echostep.ports.chunks import Portion
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.cues import arrow_sign, describe_cue
from echostep_app.output.terminal import TerminalView
from echostep_app.printing.console import console, print_notices

if TYPE_CHECKING:
    from echostep_app.page.live import LivePage
    from echostep_app.recording.recorder import DerivedMessage
    from echostep_app.session.team.feeds import MarkFeed
    from echostep_app.session.team.teammate_feed import TeammateFeed

Take = Callable[[Portion, list[Estimate]], None]


def _nothing(*_: object) -> None:
    """Of a sink that this does not concern."""


@dataclass(frozen=True, slots=True)
class Sink:
    """One place where estimates go. `take`: the tracker has taken a portion and made these estimates of it.

    `arrive`: bytes have arrived, and the tracker takes them next; `end`: the run is over, with a summary.
    """

    take: Take
    arrive: Callable[[], None] = _nothing
    end: Callable[[str], None] = _nothing


def page_sink(page: LivePage) -> Sink:
    """The page of the run; it has the estimates from the tracker, and counts its latency from the arrival of bytes."""

    def take(portion: Portion, _: list[Estimate]) -> None:
        page.publish(portion)
        page.note_alive()
        print_notices(page.server.shared.faults.notices)

    return Sink(take, page.note_arrival, page.mailbox.end)


def teammate_sink(teammates: TeammateFeed, tracker: Tracker, page: LivePage | None) -> Sink:
    """Exchange with teammates: this wearer's beacons for them when they are due, their names for the page when they change."""

    def take(_: Portion, estimates: list[Estimate]) -> None:
        names = teammates.news()
        if estimates:
            teammates.share(tracker.own_beacons)
        if page and names is not None:
            page.mailbox.set_team(names)

    return Sink(take)


def mark_sink(marks: MarkFeed, page: LivePage) -> Sink:
    """For the page: the commanders' marks and orders, and the way to a wearer in distress; from it: understood orders."""
    from echostep_app.page.mailbox import popped

    def take(_: Portion, __: list[Estimate]) -> None:
        if (news := marks.news()) is not None:
            page.mailbox.set_marks(news)
        for identity in popped(page.mailbox.understood):
            marks.understand(identity)
        page.mailbox.set_orders(marks.orders())
        if errand := marks.new_errand():
            page.set_errand(errand.x_m, errand.y_m, errand.level, errand.words)

    return Sink(take)


def derived_sink(
    tracker: Tracker, writers: Sequence[Callable[[list[DerivedMessage]], None]], log_offset_ns: int = 0
) -> Sink:
    """Messages that are derived from estimates, for the recording and for viewers."""
    from echostep_app.output.derived import Derived

    derived = Derived(tracker, log_offset_ns)

    def take(portion: Portion, estimates: list[Estimate]) -> None:
        messages = derived.take(portion, estimates)
        for write in writers:
            write(messages)

    return Sink(take)


def terminal_sink(view: TerminalView, guided: CueList | None) -> Sink:
    """The terminal view, with the newest cue."""

    def take(_: Portion, estimates: list[Estimate]) -> None:
        cue = guided.cue if guided else None
        view.show(estimates, describe_cue(cue) if cue else "")

    return Sink(take)


def spoken_cue_sink(guided: CueList) -> Sink:
    """A line for each cue that is spoken, where there is no terminal view."""

    def take(_: Portion, __: list[Estimate]) -> None:
        for cue in guided.news():
            if cue.spoken:
                console.print(f"{cue.t_s:7.1f} s  {arrow_sign(cue.arrow_rad)}  {cue.spoken}")

    return Sink(take)
