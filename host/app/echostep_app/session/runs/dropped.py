# SPDX-License-Identifier: MIT
"""`echostep page`: a page that plays the recordings that are dropped onto it.

In: files that pages post: recordings, plans. Out: the replay on the page. Owns the newest recording, the newest plan and the server. A file is opened
while its page waits for the answer; the tracking runs in the main thread, as of every run.
"""

from __future__ import annotations

import queue
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from echostep.errors import EchostepError, words_of
from echostep.localization import Estimate
from echostep.plan import NO_PLAN, Plan, load_plan
from echostep.recording import open_parts
from echostep.tracker import Tracker
from echostep.walk.recorded import shown_name
from echostep_app.interruption import is_asked, until_asked
from echostep_app.kernel_parts import LATER, PREPARING, TRACKING, compile_parts
from echostep_app.page.elements.scene import PageScene
from echostep_app.page.live import LivePage
from echostep_app.page.mailbox import Mailbox
from echostep_app.page.server import Address, PageServer
from echostep_app.page.web.addresses import print_page
from echostep_app.page.web.uploads import Uploads
from echostep_app.plan.importers.limited import open_limited
from echostep_app.printing.console import console, print_notices
from echostep_app.scorecard.truth import is_recording
from echostep_app.session.options import TrackingOptions
from echostep_app.session.results import summary_words
from echostep_app.session.runs.replay import plan_note, tracker_of
from echostep_app.session.session import open_browser

DEMO_PLAN = Path(str(files("echostep"))) / "plans" / "demo.json"
WAITING = "drop a recording and its plan here"
POLL_S = 0.2


@dataclass(frozen=True, slots=True)
class Drop:
    """A recording that is to be played on a plan."""

    path: Path
    tracker: Tracker
    title: str


class DroppedFiles:
    """`open_file` takes a file and names missing ones; once there is a recording with a plan, `drops` has a new `Drop`."""

    def __init__(self) -> None:
        self.drops: queue.Queue[Drop] = queue.Queue()
        self._recording: Path | None = None
        self._plan: Plan | None = None

    def open_file(self, path: Path) -> str:
        """Take a recording or a plan; raises EchostepError for a file that is neither."""
        if not is_recording(path):
            self._plan = open_limited(path)
            _remove(path)
            return self._play(self._plan) if self._recording else f"{self._plan.name}: now drop a recording."
        metadata = open_parts([path]).metadata
        if metadata.get("kind") == "operation":
            raise EchostepError(f"{path}: a recorded operation: echostep command FILE --plan PLAN shows it")
        previous, self._recording = self._recording, path
        plan = self._plan_of(metadata.get("plan_sha256", ""))
        if previous is not None:
            _remove(previous)
        return self._play(plan) if plan else f"{path.name}: now drop its plan ({metadata.get('plan_name', 'unknown')})."

    def play_without_plan(self) -> str:
        """Play the recording without a plan."""
        if self._recording is None:
            raise EchostepError("drop a recording first")
        return self._play(NO_PLAN)

    def _plan_of(self, digest: str) -> Plan | None:
        """The plan for a recording: none where it was tracked without one, the demo's own, else the one that was dropped."""
        if digest == NO_PLAN.digest:
            return NO_PLAN
        demo = load_plan(DEMO_PLAN)
        return demo if digest == demo.digest else self._plan

    def _play(self, plan: Plan) -> str:
        """Queue the recording; raises EchostepError when its start or its settings are damaged."""
        assert self._recording
        recording = open_parts([self._recording])
        tracker = tracker_of(recording, plan, TrackingOptions(None))
        self.drops.put(Drop(self._recording, tracker, shown_name(self._recording, recording.metadata)))
        return plan_note(plan, recording)


def serve_drops(address: Address, *, browser: bool) -> None:
    """Serve the page until Ctrl-C."""
    files = DroppedFiles()
    with (
        Uploads(files.open_file, files.play_without_plan) as uploads,
        PageServer(_waiting(WAITING), address, uploads) as server,
        suppress(KeyboardInterrupt),
    ):
        print_page(console, server.urls)
        console.print("Drop a recording onto the page, until Ctrl-C.", highlight=False)
        if browser:
            open_browser(server.url)
        drop = _next(files, server)
        while True:
            _prepare(drop.tracker, server)
            drop = _play(drop, files, server)


def _prepare(tracker: Tracker, server: PageServer) -> None:
    """Compile missing kernels; the page shows the share."""
    mailbox = _waiting(PREPARING)
    server.show(mailbox)
    compile_parts([*TRACKING, *LATER], lambda share: mailbox.show(_says(f"{PREPARING}: {share:.0%}")))
    tracker.warm_up()


def _play(drop: Drop, files: DroppedFiles, server: PageServer) -> Drop:
    """Track a recording and show it, until there is another one."""
    with LivePage(drop.tracker, drop.title, server, replay=True) as page:
        try:
            estimates = _track(drop, files, page)
            page.mailbox.end(summary_words(estimates, None))
        except EchostepError as error:
            page.fail(words_of(error))
        return _next(files, server)


def _track(drop: Drop, files: DroppedFiles, page: LivePage) -> list[Estimate]:
    """Track the recording, until its end or until there is another one."""
    estimates: list[Estimate] = []
    for portion in until_asked(open_parts([drop.path]).portions()):
        if not files.drops.empty():
            break
        page.note_arrival()
        estimates += drop.tracker.take(portion)
        page.publish(portion)
    return estimates


def _next(files: DroppedFiles, server: PageServer) -> Drop:
    """Wait for the next recording."""
    while not is_asked():
        print_notices(server.shared.faults.notices)
        with suppress(queue.Empty):
            return files.drops.get(timeout=POLL_S)
    raise KeyboardInterrupt


def _remove(path: Path) -> None:
    """Remove a file that is not needed any more; one that is still open on Windows goes with its folder."""
    with suppress(OSError):
        path.unlink()


def _waiting(words: str) -> Mailbox:
    """What the page shows while nothing is played."""
    mailbox = Mailbox(NO_PLAN, "echostep page", replay=False)
    mailbox.publish(_says(words))
    return mailbox


def _says(words: str) -> PageScene:
    return PageScene(0, 0.0, None, None, (), None, 0, words)
