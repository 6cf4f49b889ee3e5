"""What the commands do: a source, a recorder, a tracker, a view.

In: paths, ports and options. Out: recording, track.csv, track.png and a summary on the terminal. Owns nothing of its own.
"""

from __future__ import annotations

import importlib.metadata
import json
import math
import platform
import shlex
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.resources import as_file, files
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console

from echostep.board.frames import encode
from echostep.board.messages import SCHEMA_HASH, Identify
from echostep.errors import EchostepError
from echostep.foot.alignment import aligned
from echostep.foot.steps import Track, walk_track
from echostep.guidance.cues import Cue, arrow_sign, describe_cue
from echostep.guidance.guided_run import GuidedRun, destination
from echostep.legs.strides import StrideSettings
from echostep.localization.estimate import Estimate, digest
from echostep.localization.metrics import Truth, errors, load_truth
from echostep.localization.particles import ANY_LEVEL
from echostep.offline import leg_csv as leg_file
from echostep.offline.imu_csv import Imu, checked, describe_track, load_imu, write_foot_track
from echostep.output.derived import Derived
from echostep.output.terminal import TerminalView
from echostep.output.track_plot import draw_foot, draw_track, write_track
from echostep.page.live import LivePage
from echostep.page.server import Address
from echostep.papers import fischer2008
from echostep.plan.importers.formats import open_plan
from echostep.plan.model import Plan, Pose
from echostep.plan.routing import RoutePlace
from echostep.ports.check_in import PERSON
from echostep.ports.chunks import BOARD, GATEWAY, MTX, Chunk, Portion, SerialPorts, portion_of
from echostep.recording.capture import Decoder, as_json, read_capture
from echostep.recording.recorder import Recorder, Recording, open_recording
from echostep.settings import parse_settings, read_settings
from echostep.timing.timeline import MtxTiming
from echostep.tracker import Tracker
from echostep.xsens.onboard_filter import orientations
from echostep.xsens.reader import warm_up
from echostep.xsens.startup import MtxStart

if TYPE_CHECKING:
    from echostep.team.endpoint import Outlet
    from echostep.team.publish import Source

DEMO_PACE = 8.0
HEADLESS_CHUNKS = 1000
TAPPED = "tapped"  # where a recording says that its start is a check-in
BAUD = {BOARD: 115200, MTX: 115200, GATEWAY: 115200}
console = Console(soft_wrap=True)  # one message, one line, however wide the terminal


Tell = Callable[[list[Estimate]], None]


@dataclass(frozen=True, slots=True)
class Views:
    """Who looks at a run: the terminal, the page at an address; `stays`: the page is served until Ctrl-C when a replay is over."""

    terminal: bool = True
    page: Address | None = None
    stays: bool = False


def demo(
    out: Path, seed: int, board_command: str | None, views: Views, outlet: Outlet | None = None, *, guide: bool = False
) -> None:
    """Track a simulated walk; the sensor board is a program that speaks the bench protocol, or the Python board."""
    from echostep.simulation.devices.beacon_gateway import with_beacons
    from echostep.simulation.devices.board import BoardProcess, PythonBoard
    from echostep.simulation.scenario import demo_scenario

    board = BoardProcess(shlex.split(board_command)) if board_command else PythonBoard(seed=seed)
    player = "the real firmware in the simulator" if board_command else "the Python board, not the real firmware"
    console.print(f"A simulated walk in a simulated building; the sensor board is {player}.")
    out = _folder(out)
    with as_file(files("echostep") / "plans" / "demo.json") as plan_path:
        plan = open_plan(plan_path)
    scenario = demo_scenario(plan, seed, board)
    try:
        scenario.write_truth(out / "truth.csv")
        truth = load_truth(out / "truth.csv")
        tracker = Tracker(plan, scenario.start, seed=seed)
        guided = GuidedRun(tracker, RoutePlace(*scenario.truth[-1, 1:3].tolist())) if guide else None
        about = _about(plan, scenario.start, seed, "", "simulated walk, simulated sensors")
        title = "echostep demo (simulated)"
        watched = views.terminal or views.page is not None
        with _page(tracker, title, views, guided) as page, _published(outlet, tracker, "simulated") as tell:
            with Recorder(out / "walk.mcap", about) as recorder:
                walked = with_beacons(scenario, plan, seed) if guide else scenario.chunks()
                chunks = _with_check_ins(_paced(walked) if watched else walked, page)
                portions = _portions(_kept(chunks, recorder), 1 if watched else HEADLESS_CHUNKS)
                estimates = _run(
                    tracker, portions, title, lambda: scenario.fraction, views, page, tell, recorder, guided
                )
            _say(recorder.notices)
            _finish(out, tracker, estimates, truth, "simulated walk", guided=guided)
            _linger(page, views)
    finally:
        scenario.close()


def live(
    plan_path: Path, board: str, mtx: str | None, out: Path, start: Pose | None,
    settings_path: Path | None, seed: int, seconds: float | None, views: Views, outlet: Outlet | None = None,
    *, beacons: str | None = None, guide: str | None = None,
) -> None:  # fmt: skip
    """Track from one or two serial ports until Ctrl-C."""
    plan = open_plan(plan_path)
    text = read_settings(settings_path) if settings_path else ""
    tracker = Tracker(plan, start, parse_settings(text, str(settings_path)), seed, waits=views.page is not None)
    guided = GuidedRun(tracker, destination(guide, plan)) if guide else None
    tracker.warm_up()
    out = _folder(out)
    ports = _ports(board, mtx, beacons)
    try:
        ports.send(BOARD, encode(Identify(), 0))
        about = {**_about(plan, tracker.start, seed, text, "live"), **_now()}
        with (
            _page(tracker, "echostep live", views, guided) as page,
            _published(outlet, tracker, "live") as tell,
            Recorder(out / "walk.mcap", about) as recorder,
        ):
            chunks = _until(ports, recorder, tracker.settings.mtx.rate_hz, seconds, page)
            estimates = _run(tracker, _one_by_one(chunks), "echostep live", None, views, page, tell, recorder, guided)
        _say(recorder.notices)
    finally:
        ports.close()
    _finish(out, tracker, estimates, None, "live", guided=guided)


def record(board: str, mtx: str | None, out: Path, seconds: float | None, beacons: str | None = None) -> None:
    """Record from one or two serial ports until Ctrl-C."""
    warm_up()
    ports = _ports(board, mtx, beacons)
    count = {BOARD: 0, MTX: 0, GATEWAY: 0}
    try:
        ports.send(BOARD, encode(Identify(), 0))
        with Recorder(out, {**_versions(), **_now(), "note": "recorded without tracking"}) as recorder:
            for chunk in filter(None, _until(ports, recorder, MtxTiming().rate_hz, seconds, None)):
                count[chunk.port] += len(chunk.data)
        _say(recorder.notices)
    finally:
        ports.close()
    console.print(
        f"{out}: {count[BOARD]} bytes from the board, {count[MTX]} from the MTx"
        + (f", {count[GATEWAY]} from the gateway" if beacons else "")
    )


def replay(
    path: Path, plan_path: Path, out: Path, start: Pose | None, settings_path: Path | None,
    seed: int | None, truth_path: Path | None, views: Views, outlet: Outlet | None = None,
    *, guide: str | None = None,
) -> None:  # fmt: skip
    """Track a recording again."""
    recording, plan = open_recording(path), open_plan(plan_path)
    about = recording.about
    if about.get("plan_sha256", plan.digest) != plan.digest:
        console.print(f"Note: {plan_path} is not the plan that {path} was tracked on.")
    truth = load_truth(truth_path) if truth_path else None
    tracker = tracker_of(recording, plan, start, settings_path, seed)
    out = _folder(out)
    if note := about.get("note"):
        console.print(f"Recording: {note}")
    guided = GuidedRun(tracker, destination(guide, plan)) if guide else None
    tracker.warm_up()
    title = f"echostep replay {path.name}"
    with _page(tracker, title, views, guided, replay=True) as page, _published(outlet, tracker, "replay") as tell:
        began = time.perf_counter()
        estimates = _run(
            tracker, recording.portions(), title, lambda: recording.fraction, views, page, tell, guided=guided
        )
        elapsed_s = time.perf_counter() - began
        if recording.truncated:
            console.print(f"{path}: the recording ends in the middle of a record; all before it was used")
        _finish(out, tracker, estimates, truth, path.name, elapsed_s, guided)
        _linger(page, views)


def tracker_of(
    recording: Recording, plan: Plan, start: Pose | None, settings_path: Path | None, seed: int | None
) -> Tracker:
    """A tracker as the recording was tracked, but for what is given; raises EchostepError when something is missing or damaged."""
    about, path = recording.about, recording.path
    text = read_settings(settings_path) if settings_path else about.get("settings_toml", "")
    settings = parse_settings(text, str(settings_path or path))
    first, seed = start or _recorded_start(about, path), _recorded_seed(about, path, seed)
    return Tracker(plan, first, settings, seed, waits=about.get("start") == TAPPED)


def foot(path: Path, out: Path, profile: str, *, plot: bool) -> None:
    """Track a recorded foot IMU by our own method or a paper's."""
    if profile not in FOOT_PROFILES:
        raise EchostepError(f"--profile {profile}: the foot has no such profile; it has {', '.join(FOOT_PROFILES)}")
    imu = load_imu(path)
    for note in imu.notes:
        console.print(f"{path.name}: {note}")
    track = FOOT_PROFILES[profile](imu, path.name)
    write_foot_track(out, track)
    console.print(f"{path.name}: {describe_track(track)}")
    if plot:
        draw_foot(out.with_suffix(".png"), track, path.name)
        console.print(f"{out} and {out.with_suffix('.png')}")


def _own_track(imu: Imu, name: str) -> Track:
    return checked(aligned(walk_track(imu.t_s, imu.accel, imu.gyro, mag=imu.mag)), name)


def _fischer2008_track(imu: Imu, name: str) -> Track:
    """The paper's method needs the MTx's own matrices, which no CSV holds: a model of its filter makes them."""
    if imu.mag is None:
        console.print(f"{name}: no columns mx,my,mz: the MTx's filter is modelled without its magnetometer.")
    good = fischer2008.usable(imu.t_s, imu.accel, imu.gyro)[0]
    matrices = np.full((len(imu.t_s), 3, 3), np.nan)
    mag = None if imu.mag is None else imu.mag[good]
    matrices[good] = orientations(imu.t_s[good], imu.accel[good], imu.gyro[good], mag)
    return fischer2008.walk_track(imu.t_s, imu.accel, imu.gyro, matrices)


FOOT_PROFILES = {"default": _own_track, "fischer2008": _fischer2008_track}


def legs(
    path: Path, thigh_m: float, shank_m: float, out: Path, profile: str, scale: float | None, walked_m: float | None
) -> None:
    """Track a recorded leg by our own method or a paper's."""
    if profile not in leg_file.PROFILES:
        raise EchostepError(f"--profile {profile}: legs have no such profile; they have {', '.join(leg_file.PROFILES)}")
    if scale is not None and not 0.5 < scale < 2.0:
        raise EchostepError(f"--scale {scale:g}: expected about 1, as --walked prints it")
    lengths = leg_file.segments(thigh_m, shank_m, scale or 1.0)
    samples = leg_file.load_legs(path)
    for note in samples.notes:
        console.print(f"{path.name}: {note}")
    if lengths.measured_to_floor and profile == "default":
        console.print(f"--shank {shank_m:g} is taken as knee to floor: {lengths.to_ankle_m:.3f} m to the ankle")
    track = leg_file.PROFILES[profile](samples, StrideSettings(lengths, calibrated=scale is not None))
    leg_file.write_leg_track(out, track)
    console.print(f"{path.name}: {leg_file.describe_legs(track)}")
    if walked_m is not None:
        found = leg_file.calibrated_scale(float(track.rows[-1, 1]) if len(track.rows) else 0.0, walked_m)
        console.print(f"--scale {(scale or 1.0) * found:.4f} makes this walk {walked_m:g} m long")


def decode(path: Path) -> None:
    """Print a capture as JSON lines, and on stderr what was rejected."""
    decoder = Decoder()
    for message in read_capture(path, decoder):
        sys.stdout.write(json.dumps(as_json(message)) + "\n")
    board, mtx = decoder.board.counts, decoder.mtx.counts
    print(f"board: {board}\nmtx: {mtx}", file=sys.stderr)


def parse_pose(text: str) -> Pose:
    """X,Y,DEG[,LEVEL] as a pose, the level by its number from 0 or `?` for any; raises EchostepError."""
    parts = text.split(",")
    try:
        x, y, degrees = (float(part) for part in parts[:3])
        level = 0 if len(parts) < 4 else ANY_LEVEL if parts[3] == "?" else int(parts[3])
    except ValueError as error:
        raise EchostepError(f"--start {text}: expected X,Y,DEG[,LEVEL], for instance 1.5,2,90 or 1.5,2,90,3") from error
    if not all(math.isfinite(v) and abs(v) < 1e6 for v in (x, y, degrees)) or len(parts) > 4 or level < ANY_LEVEL:
        raise EchostepError(f"--start {text}: not a place")
    return Pose(x, y, math.radians(degrees), level)


def _run(
    tracker: Tracker, portions: Iterable[Portion], title: str, progress: Callable[[], float] | None,
    views: Views, page: LivePage | None, tell: Tell, recorder: Recorder | None = None, guided: GuidedRun | None = None,
) -> list[Estimate]:  # fmt: skip
    """Feed everything; Ctrl-C ends a run like its last chunk does. `recorder`: what is derived is recorded, once it has been shown."""
    derived = Derived(tracker)
    view = TerminalView(tracker, title, progress, console) if views.terminal else None
    estimates: list[Estimate] = []
    shown: AbstractContextManager[object] = view or nullcontext()
    with shown:
        try:
            for portion in portions:
                if page:
                    page.coming()
                new = tracker.take(portion)
                if page:
                    page.shown(portion)
                estimates += new
                tell(new)
                cues = guided.news() if guided else []
                if view:
                    view.show(new, describe_cue(guided.cue) if guided and guided.cue else "")
                else:
                    _speak(cues)
                if recorder:
                    recorder.notes(derived.take(portion, new))
        except KeyboardInterrupt:
            if page:
                page.wanted = False
    return estimates


def _speak(cues: Sequence[Cue]) -> None:
    """Sentences as they would be spoken, for a run without a view."""
    for cue in cues:
        if cue.spoken:
            console.print(f"{cue.t_s:7.1f} s  {arrow_sign(cue.arrow_rad)}  {cue.spoken}")


@contextmanager
def _page(
    tracker: Tracker, title: str, views: Views, guided: GuidedRun | None, *, replay: bool = False
) -> Iterator[LivePage | None]:
    """The live page while the run lasts, if anybody wants one; its address is said."""
    if views.page is None:
        yield None
        return
    with LivePage(tracker, title, views.page, guided, replay=replay) as page:
        console.print(f"The page: {page.url}", highlight=False)
        yield page


def _linger(page: LivePage | None, views: Views) -> None:
    """Serve the page when the run is over: as long as somebody looks, or until Ctrl-C if asked."""
    if page is None or not page.wanted or not (views.stays or page.pages):
        return
    console.print(
        f"The page stays at {page.url} {'until' if views.stays else 'while it is open, or until'} Ctrl-C.",
        highlight=False,
    )
    try:
        while views.stays or page.pages:
            time.sleep(0.2)
    except KeyboardInterrupt:
        pass


def _with_check_ins(chunks: Iterable[Chunk], page: LivePage | None) -> Iterator[Chunk]:
    """Every chunk, and before it what people said on the page since the last one."""
    for chunk in chunks:
        for said in page.said() if page else ():
            yield Chunk(PERSON, chunk.t_arrival_ns, said)
        yield chunk


@contextmanager
def _published(outlet: Outlet | None, tracker: Tracker, source: Source) -> Iterator[Tell]:
    """What to do with new estimates: tell a commander, or nothing."""
    if outlet is None:
        yield lambda _: None
        return
    from echostep.team.publish import Publishing

    with Publishing(outlet, tracker, source, partial(console.print, markup=False, highlight=False)) as publishing:
        yield publishing.tell


def _paced(chunks: Iterable[Chunk]) -> Iterator[Chunk]:
    """Not faster than `DEMO_PACE` times real time, so that one can watch."""
    began, first_ns = time.monotonic(), None
    for chunk in chunks:
        first_ns = chunk.t_arrival_ns if first_ns is None else first_ns
        ahead_s = (chunk.t_arrival_ns - first_ns) * 1e-9 / DEMO_PACE - (time.monotonic() - began)
        if ahead_s > 0.02:
            time.sleep(ahead_s)
        yield chunk


def _kept(chunks: Iterable[Chunk], recorder: Recorder) -> Iterator[Chunk]:
    """Every chunk, after it has been written."""
    for chunk in chunks:
        recorder.write(chunk)
        recorder.settle(chunk)
        _say(recorder.notices)
        yield chunk


def _say(notices: deque[str]) -> None:
    while notices:
        console.print(notices.popleft())


def _portions(chunks: Iterable[Chunk], most: int) -> Iterator[Portion]:
    """Portions of so many chunks; with one, no chunk waits for the next."""
    rest = iter(chunks)
    while taken := list(islice(rest, most)):
        yield portion_of(taken)


def _one_by_one(chunks: Iterable[Chunk | None]) -> Iterator[Portion]:
    """Portions of one chunk; an empty one when nothing came, so that the views go on."""
    for chunk in chunks:
        yield portion_of([chunk] if chunk else [])


def _ports(board: str, mtx: str | None, beacons: str | None) -> SerialPorts:
    urls = {BOARD: board, MTX: mtx, GATEWAY: beacons}
    return SerialPorts({name: url for name, url in urls.items() if url is not None}, BAUD)


def _until(
    ports: SerialPorts, recorder: Recorder, rate_hz: float, seconds: float | None, page: LivePage | None
) -> Iterator[Chunk | None]:
    """Chunks of the ports and check-ins, for so long or until Ctrl-C, each recorded before anything looks at it; None when nothing came for a while.

    The MTx is set up on the way. What happens to the ports and to the MTx is said.
    """
    end = math.inf if seconds is None else time.monotonic() + seconds
    start = MtxStart(rate_hz, lambda sent: ports.send(MTX, sent), console.print) if MTX in ports.names else None
    try:
        for chunk in ports.chunks():
            _say(ports.notices)
            _say(recorder.notices)
            if chunk is not None:
                recorder.write(chunk)
            if start is not None:
                start.follow(chunk)
            yield chunk
            for said in page.said() if page else ():
                check_in = Chunk(PERSON, time.monotonic_ns(), said)
                recorder.write(check_in)
                yield check_in
            if time.monotonic() >= end:
                return
    except KeyboardInterrupt:
        return


def _finish(
    out: Path,
    tracker: Tracker,
    estimates: list[Estimate],
    truth: Truth | None,
    title: str,
    elapsed_s: float | None = None,
    guided: GuidedRun | None = None,
) -> None:
    """Write the track and say how it went; a disk that is full is said last."""
    off = errors(estimates, truth) if truth else None
    title = f"{title}: mean error {off.mean_m:.2f} m" if off else title
    trouble = None
    try:
        write_track(out / "track.csv", estimates)
        places = tracker.beacon_places(estimates[-1].t_s) if estimates else []
        draw_track(out / "track.png", tracker.plan, estimates, truth, title, guided.route if guided else None, places)
        if guided:
            guided.write(out / "cues.csv")
    except OSError as error:
        trouble = EchostepError(f"{out}: cannot write the track: {error.strerror}")
    if not estimates:
        console.print("No estimate: the foot never stood still, or no MTx bytes came; without an MTx, nobody walked.")
        return
    if off is not None:
        console.print(
            f"error: mean {off.mean_m:.2f} m, sd {off.sd_m:.2f}, max {off.max_m:.2f}, end {off.ending_m:.2f} m; "
            f"RMSE {off.rmse_m:.2f} m; truth inside the 95 % ellipse {100 * off.coverage95:.0f} % of the time"
        )
    if elapsed_s:
        span = estimates[-1].t_s - estimates[0].t_s
        console.print(f"{span:.0f} s of walk in {elapsed_s:.2f} s: {span / elapsed_s:.0f} x real time")
    written = f"; track.csv and track.png are in {out}" if trouble is None else ""
    console.print(f"{len(estimates)} estimates, sha256 {digest(estimates)[:16]}{written}")
    if trouble is not None:
        raise trouble


def _about(plan: Plan, start: Pose | None, seed: int, settings_toml: str, note: str) -> dict[str, str]:
    first = {"start": TAPPED}
    if start is not None:
        first = {"start_x_y_rad": f"{start.x_m!r},{start.y_m!r},{start.heading_rad!r},{start.level}"}
    return {
        **_versions(),
        "plan_name": plan.name,
        "plan_sha256": plan.digest,
        **first,
        "seed": str(seed),
        "settings_toml": settings_toml,
        "note": note,
    }


def _recorded_start(about: dict[str, str], path: Path) -> Pose | None:
    try:
        text = about.get("start_x_y_rad")
        if text is None:
            return None
        x, y, heading, *level = (float(v) for v in text.split(","))
        return Pose(x, y, heading, int(level[0]) if level else 0)
    except (ValueError, TypeError, OverflowError) as error:
        raise EchostepError(f"{path}: its recorded start is not known: give one with --start X,Y,DEG") from error


def _recorded_seed(about: dict[str, str], path: Path, seed: int | None) -> int:
    try:
        return int(about.get("seed", "0")) if seed is None else seed
    except ValueError as error:
        raise EchostepError(f"{path}: its recorded seed is damaged: give one with --seed N") from error


def _folder(out: Path) -> Path:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EchostepError(f"{out}: cannot make the folder: {error.strerror}") from error
    return out


def _versions() -> dict[str, str]:
    """Of everything that an estimate depends on."""
    named = {name: importlib.metadata.version(name) for name in ("numpy", "numba")}
    return {
        "version": importlib.metadata.version("echostep"),
        "versions": ", ".join(
            f"{name} {version}" for name, version in {"python": platform.python_version(), **named}.items()
        ),
        "protocol": f"0x{SCHEMA_HASH:08X}",
    }


def _now() -> dict[str, str]:
    """What the clock on the wall says, and the clock of the arrivals at the same time."""
    return {"started_utc": datetime.now(UTC).isoformat(timespec="milliseconds"), "started_ns": str(time.monotonic_ns())}
