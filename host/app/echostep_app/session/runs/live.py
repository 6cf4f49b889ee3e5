# SPDX-License-Identifier: MIT
"""`echostep live` and `echostep record`: chunks from serial ports, until Ctrl-C or for a given time.

In: ports. Out: a recording; from `live` also track and summary. Owns the ports while the run lasts.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, suppress
from datetime import UTC, datetime
from pathlib import Path

from echostep.board.frames import BoardReader, StaleFirmwareError, encode
from echostep.board.messages import Identify
from echostep.board.reports import SUBSCRIBE
from echostep.errors import EchostepError
from echostep.localization import Start
from echostep.plan import Plan
from echostep.ports.chunks import BOARD, FOOT, GATEWAY, LINES, MTX, Chunk
from echostep.settings import Settings, parse_settings, read_settings
from echostep.timing.timeline import MtxTiming
from echostep.tracker import Tracker
from echostep.xsens.reader import warm_up
from echostep_app.board.subscription import BoardSubscription
from echostep_app.interruption import holding_signals, is_asked
from echostep_app.kernel_parts import SEARCH, TRACKING
from echostep_app.ports.access import usb_number
from echostep_app.ports.arrival_clock import SleepWatch, now_ns
from echostep_app.ports.serial_ports import SerialPorts, check_different
from echostep_app.printing.console import console, print_notices
from echostep_app.printing.lines import put_aside
from echostep_app.printing.people import outlast_output
from echostep_app.printing.progress import with_bar
from echostep_app.recording.recorder import Recorder
from echostep_app.session.chunk_streams import portions_of, recorded, with_messages
from echostep_app.session.last_place import FILE, DamagedPlaceError, PlaceKeeper, read_kept, start_last
from echostep_app.session.metadata import (
    LAST,
    check_start,
    clock_metadata,
    plan_of,
    run_metadata,
    start_given,
    start_recording,
    version_metadata,
)
from echostep_app.session.options import OutputOptions, PortOptions, TrackingOptions
from echostep_app.session.results import output_folder
from echostep_app.session.runs.line_foot import LineFoot, port_of
from echostep_app.session.runs.port_roles import with_right_names, with_role_check
from echostep_app.session.session import Session
from echostep_app.xsens.startup import MtxStart

BAUD = dict.fromkeys((BOARD, MTX, FOOT, GATEWAY, LINES), 115200)


def live(tracking: TrackingOptions, ports: PortOptions, output: OutputOptions) -> None:
    """Track a wearer and record everything."""
    plan = plan_of(tracking)
    if port_of(ports.foot) is None:
        _live(plan, tracking, ports, output)
        return
    with closing(_open_ports(ports)) as opened:
        _live(plan, tracking, ports, output, opened)


def _live(
    plan: Plan,
    tracking: TrackingOptions,
    ports: PortOptions,
    output: OutputOptions,
    early: SerialPorts | None = None,
) -> None:
    """The run; `early`: open ports whose lines tell the rate of the foot's samples."""
    path = tracking.settings_path
    settings_toml = read_settings(path) if path else ""
    lines = LineFoot(early, str(ports.foot)) if early else None
    settings_toml = lines.settings(settings_toml, str(path)) if lines else settings_toml
    settings, seed = parse_settings(settings_toml, str(path)), tracking.seed or 0
    number, is_last = usb_number(ports.board or ""), tracking.start == LAST
    start = _last_start(output.folder, plan, number, settings) if is_last else start_given(tracking, plan)
    tracker = Tracker(plan, start, settings, seed)
    check_start(plan, tracker.start, given=tracking.start is not None and not is_last, recorded=is_last)
    if early is None and not all(part.is_compiled for part in (*TRACKING, SEARCH)):
        _open_ports(ports).close()  # a port that is missing or busy is told before a minute of compiling
    session = Session(tracker, "echostep live", "live", output, tracking.guide_to)
    session.prepare(SEARCH)  # a search may begin with the first steps
    folder = output_folder(output.folder)
    tracker.watchers.append(PlaceKeeper(folder, tracker, number).note)
    with closing(early or _open_ports(ports)) as opened:
        _identify(opened)
        metadata = run_metadata(plan, tracker.start, seed, "live", settings_toml) | clock_metadata()
        session.arrivals.urls = opened.urls
        with session:
            with start_recording(folder / "walk.mcap", metadata, ports.keep, ports.split) as recorder:
                chunks = _recorded_chunks(opened, recorder, settings.mtx.rate_hz, ports.seconds, session, lines)
                session.track(portions_of(chunks, 1), None, recorder)
            print_notices(recorder.notices)
            session.finish("live")
            if lines:
                console.print(lines.report(), markup=False, highlight=False)
        recorder.check_whole()


def _last_start(folder: Path, plan: Plan, board: str, settings: Settings) -> Start:
    """The start where the last run in a folder ended; it is printed. Anywhere when that is damaged: a tracker starts after a power failure."""
    try:
        kept = read_kept(folder)
    except DamagedPlaceError:
        put_aside(folder / FILE, "the whole building is searched")
        return Start()
    start, words = start_last(kept, plan, board, settings.climb, datetime.now(UTC))
    console.print(words, markup=False, highlight=False)
    return start


def record(ports: PortOptions, out: Path) -> None:
    """Record the ports without tracking."""
    outlast_output()
    warm_up()
    byte_count: Counter[str] = Counter()
    with closing(_open_ports(ports)) as opened:
        lines = LineFoot(opened, str(ports.foot)) if LINES in opened.names else None
        _identify(opened)
        metadata = version_metadata() | clock_metadata() | {"note": "recorded without tracking"}
        metadata |= {"settings_toml": lines.settings("", "")} if lines else {}
        with (
            start_recording(out, metadata, ports.keep, ports.split) as recorder,
            suppress(KeyboardInterrupt),
            holding_signals(),
        ):
            chunks = _recorded_chunks(opened, recorder, MtxTiming().rate_hz, ports.seconds, lines=lines)
            for chunk in with_bar(chunks, "recording; Ctrl-C ends it", _passed(ports.seconds)):
                if chunk is not None:
                    byte_count[chunk.port] += len(chunk.data)
        print_notices(recorder.notices)
    from_gateway = f", {byte_count[GATEWAY]} from the gateway" if ports.beacons else ""
    name, device = (FOOT, "the foot board") if ports.foot else (MTX, "the MTx")
    foot = f"{byte_count[LINES]} in the foot's lines" if lines else f"{byte_count[name]} from {device}"
    console.print(f"{recorder.path}: {byte_count[BOARD]} bytes from the board, {foot}{from_gateway}")
    recorder.check_whole()


def _passed(seconds: float | None) -> Callable[[], float | None]:
    """The share of the given time that has passed; None without one."""
    began_s = time.monotonic()
    return lambda: None if seconds is None else (time.monotonic() - began_s) / max(seconds, 1e-3)


def _identify(ports: SerialPorts) -> None:
    """Request each board's identity."""
    for name in (BOARD, FOOT):
        if name in ports.names:
            ports.send(name, encode(Identify(), 0))


def _open_ports(options: PortOptions) -> SerialPorts:
    """The ports of a run; raises EchostepError when two uses of the run have the same one."""
    if options.mtx is not None and options.foot is not None:
        raise EchostepError("--mtx and --foot: only one of them is on the foot: give that one")
    lines = port_of(options.foot)
    foot = options.foot if lines is None else None
    urls = {BOARD: options.board, MTX: options.mtx, FOOT: foot, GATEWAY: options.beacons, LINES: lines}
    given = {name: url for name, url in urls.items() if url is not None}
    check_different(given)
    return SerialPorts(given, BAUD)


def _recorded_chunks(
    ports: SerialPorts,
    recorder: Recorder,
    rate_hz: float,
    seconds: float | None,
    session: Session | None = None,
    lines: LineFoot | None = None,
) -> Iterator[Chunk | None]:
    """Chunks of the ports, check-ins and meetings of the page, messages of teammates, each recorded before it is used; the MTx is set up."""
    chunks = with_right_names(_chunks_for(ports, seconds), ports)
    chunks = lines.with_samples(chunks) if lines else chunks
    if session is not None:
        chunks = with_messages(chunks, session.message_sources, lambda _: now_ns())
    chunks = _with_subscription(with_role_check(recorded(chunks, recorder), ports.urls), ports)
    return _with_mtx_setup(chunks, ports, rate_hz) if MTX in ports.names else chunks


def _chunks_for(ports: SerialPorts, seconds: float | None) -> Iterator[Chunk | None]:
    """Chunks of the ports for so many seconds or until a signal; then what has arrived. None when nothing came for a while."""
    end_s = math.inf if seconds is None else time.monotonic() + seconds
    watch = SleepWatch()
    for chunk in ports.chunks():
        print_notices(ports.notices)
        if slept_s := watch.slept_s():
            console.print(f"The computer slept for {slept_s:.0f} s: nothing was received; the position is uncertain")
        yield chunk
        if is_asked() or time.monotonic() >= end_s:
            ports.stop()


def _with_subscription(chunks: Iterable[Chunk | None], ports: SerialPorts) -> Iterator[Chunk | None]:
    """The same chunks, while each board is asked for its optional messages at the start and whenever it has restarted."""
    boards = {name: (BoardReader(), BoardSubscription()) for name in (BOARD, FOOT)}
    for chunk in chunks:
        if chunk is not None and chunk.port in boards:
            board, subscription = boards[chunk.port]
            with suppress(StaleFirmwareError):  # the tracker reports it
                for message in board.feed(chunk.data):
                    if subscription.is_due(message):
                        ports.send(chunk.port, encode(SUBSCRIBE, 0))
        yield chunk


def _with_mtx_setup(chunks: Iterable[Chunk | None], ports: SerialPorts, rate_hz: float) -> Iterator[Chunk | None]:
    """The same chunks, while the MTx is set up at the start and whenever it wakes up."""
    start = MtxStart(rate_hz, lambda request: ports.send(MTX, request), console.print)
    for chunk in chunks:
        start.advance(chunk)
        yield chunk
