# SPDX-License-Identifier: MIT
"""What is derived has times in UTC where the time of day is known, and the same estimates as without it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from echostep.localization import Estimate, digest
from echostep.plan import load_plan
from echostep.recording import open_recording, utc_offset_ns
from echostep_app.output.track_files import export
from echostep_app.recording.recorder import Recorder
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of
from walks import DEMO, walk_chunks

CLOCK = {"started_utc": "2026-11-26T10:00:00.123+00:00", "started_ns": "0"}


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated walk with derived messages, without a time of day."""
    return recorded_and_exported(tmp_path_factory.mktemp("plain"), {})


@pytest.fixture(scope="module")
def dated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same walk with the time of day of its start."""
    return recorded_and_exported(tmp_path_factory.mktemp("dated"), CLOCK)


def recorded_and_exported(folder: Path, clock: dict[str, str]) -> Path:
    with Recorder(folder / "walk.mcap", {"seed": "3"} | clock) as recorder:
        for chunk in walk_chunks(12.0):
            recorder.write(chunk)
    out = folder / "derived.mcap"
    export(folder / "walk.mcap", DEMO, out, lambda recording, on: tracker_of(recording, on, TrackingOptions(DEMO)))
    return out


def messages(path: Path) -> list[tuple[str, int, bytes]]:
    with path.open("rb") as file:
        return [
            (channel.topic, m.log_time, m.data)
            for _, channel, m in make_reader(file).iter_messages(log_time_order=False)
        ]


def replayed(path: Path) -> list[Estimate]:
    recording = open_recording(path)
    tracker = tracker_of(recording, load_plan(DEMO), TrackingOptions(DEMO))
    return [e for portion in recording.portions() for e in tracker.take(portion)]


def undated(body: Any, offset_ns: int) -> Any:
    """A derived message with its stamps back on the clock of the arrivals."""
    if isinstance(body, list):
        return [undated(part, offset_ns) for part in body]
    if not isinstance(body, dict):
        return body
    if "timestamp" in body:
        stamp = body["timestamp"]["sec"] * 10**9 + body["timestamp"]["nsec"] - offset_ns
        body["timestamp"] = {"sec": stamp // 10**9, "nsec": stamp % 10**9}
    return {key: undated(value, offset_ns) for key, value in body.items()}


def test_all_messages_are_the_same_but_for_the_clock(plain: Path, dated: Path) -> None:
    offset_ns = utc_offset_ns(CLOCK)
    assert offset_ns
    without, with_clock = messages(plain), messages(dated)
    assert {topic for topic, _, _ in without} >= {
        "/board/bytes",
        "/estimate",
        "/pose",
        "/scene",
        "/echo/left",
        "/status",
    }
    assert [topic for topic, _, _ in with_clock] == [topic for topic, _, _ in without]
    assert [t_ns - offset_ns for _, t_ns, _ in with_clock] == [t_ns for _, t_ns, _ in without]
    for (topic, t_ns, data), (_, _, other) in zip(with_clock, without, strict=True):
        if topic.endswith("/bytes"):
            assert data == other
            continue
        body = json.loads(data)
        if "timestamp" in body:
            assert body["timestamp"] == {"sec": t_ns // 10**9, "nsec": t_ns % 10**9}
        assert undated(body, offset_ns) == json.loads(other)


def test_a_replay_computes_the_same_bits(plain: Path, dated: Path) -> None:
    assert replayed(dated)
    assert digest(replayed(dated)) == digest(replayed(plain)) == digest(replayed(plain.with_name("walk.mcap")))
