# SPDX-License-Identifier: MIT
"""What a page says beside the errors: clocks, losses and damage, versions and digests.

In: a `Walked`. Out: rows of name and text. Owns their order. No path, no name of a person or of a device's number is among them.
"""

from __future__ import annotations

import hashlib
import math
from importlib.metadata import version

from echostep.board.messages import SCHEMA_HASH, Part
from echostep_app.board.faults.findings import PART_NAMES
from echostep_app.board.faults.health import all_findings
from echostep_app.recording.capture_summary import refusals
from echostep_app.session.acceptance.walked import Walked

Row = tuple[str, str]


def clock_rows(walked: Walked) -> list[Row]:
    """The clocks of foot sensor, board and host against each other."""
    streams, timeline = walked.tracker.streams, walked.tracker.front_end.timeline
    ppm = 1e6 * timeline.foot_against_board
    how = "by SyncOut edges" if streams.synchronised else "by arrival times: no SyncOut wire"
    return [
        (f"{streams.foot_name} against the board", "-" if math.isnan(ppm) else f"{ppm:+.1f} ppm, {how}"),
        ("edges on SyncOut that were none", str(streams.front_end.stray_edges)),
        ("restarts of the board's clock", str(streams.board_restarts)),
        ("steps of the host's clock", str(streams.front_end.clock_steps)),
        ("arrival times that contradict a counter", str(streams.front_end.bad_arrivals)),
    ]


def loss_rows(walked: Walked) -> list[Row]:
    """What was lost or damaged on the way, and what the tracker did not use."""
    streams, taps = walked.tracker.streams, walked.taps
    board, foot, front_end = streams.board, streams.mtx, streams.front_end
    refused = refusals(foot)
    rows = [
        ("walk", walked.losses.describe(walked.arrivals.worn_s)),
        ("board", f"{board.good} frames, {board.rejected} damaged, {board.lost} lost"),
        (
            streams.foot_name,
            f"{foot.good} samples, {foot.bad_checksum} damaged, {foot.lost} lost"
            + (f", refused {refused}" if refused else ""),
        ),
        ("pings", f"{streams.pings}, {front_end.late_pings} late, {front_end.dropped_pings} dropped"),
        ("messages with impossible times", str(front_end.bad_times)),
        ("chunks of unknown ports", str(front_end.unknown_ports)),
        ("taps", f"{len(taps.kept)}, {taps.taken_back} taken back, {taps.bad} unusable"),
        ("counters of the board", _counters(walked)),
        ("findings", "; ".join(map(str, all_findings(streams.reports, streams.foot_reports))) or "none"),
        ("ports", "; ".join(walked.arrivals.silent()) or "all sent to the end"),
        ("recording", "; ".join(walked.recording.damage()) or "whole"),
    ]
    return [row for row in rows if row[1]]


def _counters(walked: Walked) -> str:
    """Those of the board's own counters of drops, errors and bad frames that are not zero, by the newest report."""
    status = walked.tracker.streams.status
    if status is None:
        return "the board has sent none"
    counted = {
        name: value
        for name, value in status._asdict().items()
        if name.startswith(("dropped_", "errors_")) or name in ("bus_recoveries", "bad_frames")
    }
    return ", ".join(f"{name} {value}" for name, value in counted.items() if value) or "all zero"


def version_rows(walked: Walked) -> list[Row]:
    """Versions and digests by which a second person gets the same page."""
    metadata, settings = walked.recording.metadata, walked.recording.metadata.get("settings_toml", "")
    return [
        ("firmware of the board", _firmware(walked)),
        ("parts", _parts(walked)),
        ("recorded with echostep", f"{metadata.get('version', '-')} ({metadata.get('versions', '-')})"),
        ("page made with echostep", f"{version('echostep')}, protocol 0x{SCHEMA_HASH:08X}"),
        ("recording, SHA-256", hashlib.sha256(walked.recording.path.read_bytes()).hexdigest()),
        ("plan, SHA-256", walked.plan.digest),
        ("settings, SHA-256", f"{hashlib.sha256(settings.encode()).hexdigest()}{'' if settings else ' (defaults)'}"),
    ]


def _firmware(walked: Walked) -> str:
    identity = walked.tracker.streams.identity
    if identity is None:
        return "the board did not say"
    numbers = (identity.version_major, identity.version_minor, identity.version_patch)
    return f"{'.'.join(map(str, numbers))}, protocol 0x{identity.schema_hash:08X}"


def _parts(walked: Walked) -> str:
    """The part in each place of the board, where it has named them."""
    parts = walked.tracker.streams.reports.parts
    if parts is None:
        return "the board did not say"
    places = {name.removeprefix("part_"): value for name, value in parts._asdict().items() if name.startswith("part_")}
    named = {place: PART_NAMES.get(Part(value), "?") for place, value in places.items()}
    return ", ".join(f"{place.replace('_', ' ')} {part}" for place, part in named.items())
