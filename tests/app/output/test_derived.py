# SPDX-License-Identifier: MIT
"""Derived messages: viewers can read them, in UTC where the time of day is known; the tracker does not notice that they are written."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader

from echostep.localization import Estimate, digest
from echostep.plan import Georeference, Plan
from echostep.ports.chunks import portion_of
from echostep.recording import open_recording, utc_offset_ns
from echostep.tracker import Tracker
from echostep_app.output.derived import TOPICS, Derived, east_north
from echostep_app.output.foxglove import FRAME, LOCATION, POSE, SCENE
from echostep_app.output.track_files import export
from echostep_app.recording.recorder import Recorder
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of
from recording.damages import write_recording
from walks import DEMO, PLAN, walk_chunks

TAY = Georeference(-2.978, 56.46, math.radians(30.0))


def tracked(out: Path | None, plan: Plan, most: int = 50) -> list[Estimate]:
    """A simulated walk, with derived messages written if there is somewhere to write them."""
    tracker = Tracker(plan, seed=1)
    derived, estimates = Derived(tracker), []
    recorder = Recorder(out, {"note": "a test"}) if out else None
    chunks = walk_chunks()
    for begin in range(0, len(chunks), most):
        portion = portion_of(chunks[begin : begin + most])
        if recorder:
            for chunk in portion.chunks():
                recorder.write(chunk)
        new = tracker.take(portion)
        estimates += new
        if recorder:
            recorder.write_derived(derived.take(portion, new))
    if recorder:
        recorder.close()
    return estimates


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Estimate]]:
    path = tmp_path_factory.mktemp("derived") / "walk.mcap"
    return path, tracked(path, dataclasses.replace(PLAN, georeference=TAY))


def derived_of(path: Path) -> list[tuple[Any, Any, int, dict[str, Any]]]:
    """Channel, schema, time and body of each derived message, read by the format's own library, in order of time."""
    with path.open("rb") as file:
        return [
            (channel, schema, message.log_time, json.loads(message.data))
            for schema, channel, message in make_reader(file).iter_messages()
            if channel.message_encoding == "json"
        ]


def closed(schema: Any) -> Any:
    """The schema with no other fields allowed than those that it names."""
    if isinstance(schema, dict):
        strict = {k: closed(v) for k, v in schema.items()}
        return {**strict, "additionalProperties": False} if "properties" in schema else strict
    return schema


@pytest.mark.slow
def test_every_message_is_what_its_schema_says(recorded: tuple[Path, list[Estimate]]) -> None:
    checks: dict[str, Any] = {}
    for channel, schema, _, body in derived_of(recorded[0]):
        assert schema.encoding == "jsonschema"
        rules = json.loads(schema.data)
        assert schema.name == rules["title"]
        check = checks.setdefault(channel.topic, jsonschema.Draft202012Validator(closed(rules)))
        check.validate(body)
    assert checks.keys() == {t.name for t in (*TOPICS, POSE, FRAME, SCENE, LOCATION)}


@pytest.mark.slow
def test_estimates_and_poses_are_the_trackers(recorded: tuple[Path, list[Estimate]]) -> None:
    path, estimates = recorded
    found = derived_of(path)
    bodies = [body for channel, _, _, body in found if channel.topic == "/estimate"]
    assert [(b["t_s"], b["x_m"], b["yy_m2"], b["status"]) for b in bodies] == [
        (e.t_s, e.x_m, e.yy_m2, e.status.value) for e in estimates
    ]
    poses = [body["pose"] for channel, _, _, body in found if channel.topic == "/pose"]
    for pose, e in zip(poses, estimates, strict=True):
        assert pose["position"]["x"] == pytest.approx(e.x_m, abs=1e-4)
        assert 2.0 * math.atan2(pose["orientation"]["z"], pose["orientation"]["w"]) == pytest.approx(e.heading_rad)


@pytest.mark.slow
def test_messages_stand_at_their_own_time(recorded: tuple[Path, list[Estimate]]) -> None:
    path, estimates = recorded
    chunks = list(open_recording(path).chunks())
    times = [t_ns for channel, _, t_ns, _ in derived_of(path) if channel.topic == "/estimate"]
    apart = np.diff(times) * 1e-9 - np.diff([e.t_s for e in estimates])
    assert np.abs(apart).max() < 0.01
    assert chunks[0].t_arrival_ns <= times[0] <= times[-1] <= chunks[-1].t_arrival_ns


def test_steps_echoes_and_pressure_are_plausible(recorded: tuple[Path, list[Estimate]]) -> None:
    found = derived_of(recorded[0])
    by_topic: dict[str, list[dict[str, Any]]] = {}
    for channel, _, _, body in found:
        by_topic.setdefault(channel.topic, []).append(body)
    steps = by_topic["/step"]
    assert [s["step"] for s in steps] == sorted({e.step for e in recorded[1]} - {0})
    assert all(0.1 < s["length_m"] < 2.0 for s in steps)
    heard = [e["range_m"] for side in ("left", "right") for e in by_topic[f"/echo/{side}"] if e["heard"]]
    assert heard
    assert all(0.1 < range_m < 7.0 for range_m in heard)
    assert all(95_000 < p["pressure_pa"] < 105_000 for p in by_topic["/pressure"])
    names = [entity["id"] for body in by_topic["/scene"] for entity in body["entities"]]
    assert sum(name.startswith("plan") for name in names) == 1


@pytest.mark.slow
def test_a_recording_with_derived_messages_replays_to_the_same_estimates(recorded: tuple[Path, list[Estimate]]) -> None:
    path, estimates = recorded
    assert tuple(open_recording(path).chunks()) == walk_chunks()
    assert digest(tracked(None, PLAN, most=7)) == digest(estimates)


def test_covariance_on_earth_is_the_turned_one() -> None:
    c, s = math.cos(TAY.rotation_rad), math.sin(TAY.rotation_rad)
    turn = np.array([[c, -s], [s, c]])
    expected = turn @ np.array([[0.5, 0.1], [0.1, 0.2]]) @ turn.T
    east, both, north = east_north(TAY.rotation_rad, 0.5, 0.1, 0.2)
    assert np.array([[east, both], [both, north]]) == pytest.approx(expected)


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
    write_recording(folder / "walk.mcap", walk_chunks(12.0), {"seed": "3"} | clock)
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
    tracker = tracker_of(recording, PLAN, TrackingOptions(DEMO))
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
