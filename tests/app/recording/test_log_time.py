# SPDX-License-Identifier: MIT
"""Times in a file: UTC for other programs where the time of day is known, and the clock of the arrivals for the tracker."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from mcap.reader import make_reader

from echostep.ports.chunks import Chunk
from echostep.recording import open_parts, open_recording, utc_offset_ns
from echostep.recording.mcap_records import METADATA_NAME
from echostep_app.recording.recorder import begin_file
from echostep_app.recording.repair.contents import info
from echostep_app.recording.repair.edit import cut, repair
from echostep_app.recording.splitting import SplitLimit, numbered_recorder
from recording.damages import write_recording

STARTED_NS = 987_654_321_987
CLOCK = {"started_utc": "2026-11-26T10:00:00.123+00:00", "started_ns": str(STARTED_NS)}
UTC_NS = 1_795_687_200_123_000_000  # of STARTED_NS
CHUNKS = [Chunk("board", STARTED_NS + k * 10_000_003, b"x" * (k % 7 + 1)) for k in range(200)]


def recorded(path: Path, metadata: dict[str, str]) -> Path:
    write_recording(path, CHUNKS, metadata)
    return path


def old_recording(path: Path) -> Path:
    """As files were written before they had times in UTC: the clock is in the metadata, log times are arrival times."""
    with path.open("wb") as file:
        writer = begin_file(file)
        writer.add_metadata(METADATA_NAME, CLOCK)
        channel = writer.register_channel("/board/bytes", "application/octet-stream", 0)
        for k, chunk in enumerate(CHUNKS):
            writer.add_message(channel, chunk.t_arrival_ns, chunk.data, chunk.t_arrival_ns, k)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def log_times(path: Path) -> list[tuple[int, int]]:
    """Log and publish times, as the format's own library reads them."""
    with path.open("rb") as file:
        return [(message.log_time, message.publish_time) for _, _, message in make_reader(file).iter_messages()]


def test_other_programs_see_the_time_of_day(tmp_path: Path) -> None:
    path = recorded(tmp_path / "a.mcap", CLOCK)
    expected = [UTC_NS + chunk.t_arrival_ns - STARTED_NS for chunk in CHUNKS]
    assert log_times(path) == [(t_ns, t_ns) for t_ns in expected]
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary
    assert summary.statistics
    began = datetime.fromtimestamp(summary.statistics.message_start_time * 1e-9, UTC)
    assert began.isoformat(timespec="milliseconds") == CLOCK["started_utc"]


def test_what_is_read_has_the_arrival_times(tmp_path: Path) -> None:
    """Of a file with times in UTC, of an older one, of one without a time of day, of a part of a file, and of what is made of them."""
    path = recorded(tmp_path / "a.mcap", CLOCK)
    assert list(open_recording(path).chunks()) == CHUNKS
    assert [c for portion in open_recording(path).portions_from(0) for c in portion.chunks()] == CHUNKS
    recording = open_recording(path)
    first = next(recording.portions())
    rest = open_recording(path).portions_from(recording.resume)
    assert [*first.chunks(), *(c for portion in rest for c in portion.chunks())] == CHUNKS
    assert list(open_recording(old_recording(tmp_path / "old.mcap")).chunks()) == CHUNKS
    assert list(open_recording(recorded(tmp_path / "simulated.mcap", {"seed": "1"})).chunks()) == CHUNKS
    for origin in (path, tmp_path / "old.mcap"):
        repair(origin, tmp_path / f"repaired_{origin.name}")
        assert list(open_recording(tmp_path / f"repaired_{origin.name}").chunks()) == CHUNKS
        cut(origin, 0.0, 1.0, tmp_path / f"piece_{origin.name}")
        assert list(open_recording(tmp_path / f"piece_{origin.name}").chunks()) == CHUNKS[:100]


def test_parts_have_the_time_of_day_each(tmp_path: Path) -> None:
    recorder = numbered_recorder(tmp_path / "walk.mcap", CLOCK, split=SplitLimit(size=4000))
    with recorder:
        for chunk in CHUNKS:
            recorder.write(chunk)
    parts = sorted(tmp_path.glob("walk-*"))
    assert len(parts) > 1
    expected = [UTC_NS + chunk.t_arrival_ns - STARTED_NS for chunk in CHUNKS]
    assert sorted(t for part in parts for t in log_times(part)) == [(t_ns, t_ns) for t_ns in expected]
    assert list(open_parts([tmp_path]).chunks()) == CHUNKS


def test_without_a_time_of_day_nothing_is_invented(tmp_path: Path) -> None:
    simulated = recorded(tmp_path / "simulated.mcap", {"seed": "1", "log_time": "UTC"})
    assert log_times(simulated)[0] == (STARTED_NS, STARTED_NS)
    assert "log_time" not in open_recording(simulated).metadata
    assert any("no time of day was recorded" in line for line in info(simulated))
    assert any(
        "export FILE --plan PLAN -o NEW.mcap writes UTC" in line for line in info(old_recording(tmp_path / "b.mcap"))
    )
    told = info(recorded(tmp_path / "a.mcap", CLOCK))
    assert "  log_time: UTC" in told
    assert not any(line.startswith("  times:") for line in told)


@pytest.mark.parametrize(
    ("written", "damaged", "shift_ns"),
    [
        (b"2026-11-26T10", b"2926-11-26T10", UTC_NS - STARTED_NS),  # later than every message: log times stay
        (b"2026-11-26T10", b"2025-11-26T10", 365 * 86_400 * 10**9),
        (b"2026-11-26T10", b"2026-11-x6T10", UTC_NS - STARTED_NS),
        (b"log_time", b"lag_time", UTC_NS - STARTED_NS),
    ],
)
def test_a_damaged_clock_shifts_all_times_alike(tmp_path: Path, written: bytes, damaged: bytes, shift_ns: int) -> None:
    path = recorded(tmp_path / "a.mcap", CLOCK)
    content = path.read_bytes()
    assert content.count(written) == 1
    path.write_bytes(content.replace(written, damaged))
    recording = open_recording(path)
    assert [c.t_arrival_ns - shift_ns for c in recording.chunks()] == [c.t_arrival_ns for c in CHUNKS]
    assert recording.own_damage.altered


@pytest.mark.parametrize(
    "clock",
    [
        {},
        {"started_utc": "soon", "started_ns": "1"},
        {"started_utc": "2026-11-21", "started_ns": "1"},
        {"started_utc": "2026-11-21T00:00:00Z"},
        {"started_utc": "2026-11-21T00:00:00Z", "started_ns": "9" * 40},
        {"started_utc": "2026-11-21T00:00:00Z", "started_ns": "-" + "9" * 40},
        {"started_utc": "1970-01-01T00:00:01Z", "started_ns": "5000000000"},  # a clock that was never set
    ],
)
def test_a_clock_that_cannot_be_used_is_none(clock: dict[str, str], tmp_path: Path) -> None:
    assert utc_offset_ns(clock) is None
    assert list(open_recording(recorded(tmp_path / "a.mcap", clock | {"log_time": "UTC"})).chunks()) == CHUNKS
