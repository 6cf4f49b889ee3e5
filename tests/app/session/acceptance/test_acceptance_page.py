# SPDX-License-Identifier: MIT
"""The page of an acceptance walk: errors at the points, the same bytes from the recording alone, and nothing that a wearer would not publish."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from board_runs import needs_twin
from command_line import echostep
from echostep.board.messages import SCHEMA_HASH
from echostep.errors import EchostepError
from echostep.ports.chunks import POINT, Chunk
from echostep_app.ports.tap import Tap
from echostep_app.session.acceptance.page import page
from echostep_app.session.acceptance.protocol import FIELD
from echostep_app.session.acceptance.walked import Walked, by_point, score_taps, walk_again
from session.acceptance.simulated_walk import record, walk

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated walk with a tap that was taken back, and two that name no point; the taps reach a run that is 2 s behind."""
    protocol, chunks, taps = walk()
    late = [replace(tap, t_arrival_ns=tap.t_arrival_ns + 2_000_000_000) for tap in taps]
    odd = (Tap(4).encode(), Tap(None).encode(), Tap(5).encode(), b"\xff{")
    after = [Chunk(POINT, late[2].t_arrival_ns + k, body) for k, body in enumerate(odd, 1)]
    return record(tmp_path_factory.mktemp("walk") / "walk.mcap", protocol, chunks, late, after)


@pytest.fixture(scope="module")
def walked(recording: Path) -> Walked:
    """The walk, tracked again."""
    return walk_again(recording)


def test_the_errors_at_the_points_are_those_of_the_track(walked: Walked) -> None:
    _, _, taps = walk()
    assert (len(walked.taps.kept), walked.taps.taken_back, walked.taps.bad) == (len(taps), 1, 2)
    scored = score_taps(walked, walked.timed)
    card = scored.card
    assert card.points == len(taps)
    assert 0.0 < card.ce50_m < card.ce95_m < 0.3
    assert card.radius95_holds is not None
    assert card.radius95_holds > 0.9
    assert (card.vertical, card.floor_probability) == (None, None)
    rows = by_point(walked, scored)
    assert [(row.name, row.taps) for row in rows] == [("1", 3), ("2", 4), ("3", 4), ("4", 4), ("5", 2)]
    assert np.average([row.mean_m for row in rows], weights=[row.taps for row in rows]) == pytest.approx(
        card.horizontal.mean_m
    )


def test_a_tap_is_timed_to_a_hundredth_of_a_second(walked: Walked) -> None:
    _, chunks, taps = walk()
    begin_ns = chunks[0].t_arrival_ns
    told_s = np.array([tap.t_s for tap in walked.timed])
    true_s = np.array([tap.t_arrival_ns - begin_ns for tap in taps]) * 1e-9
    assert np.ptp(told_s - true_s) < 0.01


def test_taps_of_the_wrong_points_show(walked: Walked) -> None:
    swapped = [tap._replace(point=(tap.point + 1) % 5) for tap in walked.timed]
    assert score_taps(walked, swapped).card.ce50_m > 1.0


def test_walls_of_a_corridor_are_heard_square_on(walked: Walked) -> None:
    text = page(walked, score_taps(walked, walked.timed))
    for ranger in ("left", "right"):
        shares = re.search(rf">{ranger}</th><td>0 to 10 degrees</td><td[^>]*>(\d+)</td><td[^>]*>(\d+) %", text)
        assert shares, ranger
        assert int(shares[1]) > 100
        assert int(shares[2]) > 95


def test_the_page_is_made_again_from_a_copy_of_the_recording(recording: Path, tmp_path: Path) -> None:
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    copy = Path(shutil.copy(recording, folder / "other-name.mcap"))
    pages = []
    for path in (recording, copy):
        done = echostep("acceptance", "--recording", path, ends=0)
        assert "(simulated)" in done.stdout
        pages.append(path.with_suffix(".html").read_bytes())
    assert pages[0] == pages[1]
    text = pages[0].decode()
    assert "Simulated: no board was worn" in text
    assert "Measured" not in text
    assert f"protocol 0x{SCHEMA_HASH:08X}" in text
    assert not [part for part in (str(recording.parent), "walk.mcap", str(Path.home()), ' src="http') if part in text]


@pytest.mark.long
@needs_twin
def test_the_page_of_the_real_firmware(tmp_path: Path) -> None:
    """The firmware in the twin, whose wearer walks the protocol; the taps come at the moments when the trunk is at the points."""
    done = echostep("acceptance", "--recording", record(tmp_path / "walk.mcap", *walk(twin=True)), ends=0)
    figures = re.search(
        r"17 taps with a position: mean [\d.]+ m, CE50 ([\d.]+) m, CE95 ([\d.]+) m \(simulated\)", done.stdout
    )
    assert figures, done.stdout
    assert float(figures[1]) < 0.15
    assert float(figures[2]) < 0.3
    rows = dict(re.findall(r'row">([^<]+)</th><td[^>]*>([^<]*)</td></tr>', (tmp_path / "walk.html").read_text()))
    assert re.fullmatch(rf"[\d.]+, protocol 0x{SCHEMA_HASH:08X}", rows["firmware of the board"])
    assert rows["taps"] == "17, 0 taken back, 0 unusable"
    assert rows["MTx against the board"].endswith("ppm, by SyncOut edges")
    assert rows["recording"] == "whole"


def test_a_recording_without_taps_or_protocol_says_so(tmp_path: Path) -> None:
    protocol, chunks, _ = walk()
    silent = record(tmp_path / "silent.mcap", protocol, chunks[:200])
    done = echostep("acceptance", "--recording", silent)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "no tap in it" in done.stderr
    for name, fields in (("none", {}), ("bad", {FIELD: "{"}), ("plan", {FIELD: '{"points":[],"plan_text":""}'})):
        other = record(tmp_path / f"{name}.mcap", protocol, chunks[:200], metadata=fields)
        with pytest.raises(EchostepError, match="no acceptance walk" if name == "none" else "protocol is damaged"):
            walk_again(other)
