# SPDX-License-Identifier: MIT
"""`echostep.replay`: the estimates of the command, as tables and pictures."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import echostep
from echostep.errors import EchostepError
from echostep.plan import NO_PLAN, Pose, load_plan
from echostep.walk.table import write_track
from walks import DEMO, WALK, foot_track

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def walk() -> echostep.Walk:
    """The recorded walk on its plan."""
    return echostep.replay(WALK, DEMO)


DIGESTS = """
import sys, echostep
from echostep.localization import digest
for start in (None, echostep.Start()):
    print(digest(echostep.replay(*sys.argv[1:], start=start).estimates))
"""
WIDE = "X86_V4 AVX512_ICL AVX512_SPR AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL"  # names of numpy 2.4 and before
PROCESSORS = {
    "kernels without wide vectors": {"NUMBA_CPU_NAME": "generic"},
    "numpy without AVX-512": {"NPY_DISABLE_CPU_FEATURES": WIDE},
    "OpenBLAS of an old processor": {"OPENBLAS_CORETYPE": "Prescott"},
}


def digests(environment: dict[str, str]) -> list[str]:
    """Of the estimates from the recorded start and from an unknown one, by a process with this environment."""
    command = [
        sys.executable,
        "-W",
        "ignore",
        "-c",
        DIGESTS,
        str(WALK),
        str(DEMO),
    ]  # numpy warns of what this processor lacks
    return subprocess.check_output(command, env=os.environ | environment, text=True).split()


@pytest.mark.process
@pytest.mark.long
@pytest.mark.parametrize("processor", PROCESSORS)
def test_a_walk_has_the_same_bytes_on_another_processor(processor: str) -> None:
    assert digests(PROCESSORS[processor]) == digests({})


def test_a_table_holds_what_track_csv_does(walk: echostep.Walk, tmp_path: Path) -> None:
    write_track(tmp_path / "track.csv", walk.estimates)
    rows = list(csv.DictReader((tmp_path / "track.csv").read_text().splitlines()))
    table = walk.to_numpy()
    assert table.dtype.names == (*list(rows[0])[:-1], "longitude_deg", "latitude_deg")
    for name in list(rows[0])[:-1]:
        assert [str(value) for value in table[name].tolist()] == [row[name] for row in rows], name
    assert np.allclose(table["latitude_deg"], 48.21, atol=1e-3)


def test_a_data_frame_has_the_time_as_its_index(walk: echostep.Walk) -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    frame = walk.to_pandas()
    assert frame.index.tolist() == [e.t_s for e in walk.estimates]
    assert list(frame.columns) == list(walk.to_numpy().dtype.names or ())[1:]
    assert set(frame["status"]) == {"tracking"}


def test_without_pandas_the_extra_is_named(walk: echostep.Walk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(EchostepError, match=r"to_pandas needs pandas, .*: pip install 'echostep\[pandas\]'"):
        walk.to_pandas()


def test_reprs_are_a_line_with_the_figures_that_matter(walk: echostep.Walk) -> None:
    plan = load_plan(DEMO)
    assert repr(walk) == "<Walk 'walk.mcap': 5 estimates, 2.0 s, 100% tracking, on 'Demo office'>"
    assert repr(plan) == "<Plan 'Demo office': 'Ground floor'; 37 walls, 9 rooms>"
    assert repr(plan.levels[0]) == "<Level 'Ground floor', 0 m: 37 walls, 9 rooms>"
    assert repr(foot_track()) == "<Track: 1 steps, 3.0 s, 0.7 m>"
    room = echostep.Start(room_m=np.zeros((4, 2)), level=0)
    assert repr(room) == "Start(room_m=<4 corners>, level=0)"
    assert repr(echostep.Settings()) == "Settings()"


def test_objects_take_the_place_of_what_was_recorded(walk: echostep.Walk) -> None:
    moved = echostep.replay(str(WALK), load_plan(DEMO), start=Pose(9.0, 7.5, 0.0))
    assert moved.estimates[0].x_m == pytest.approx(9.0, abs=0.2)
    assert echostep.replay([WALK], DEMO, seed=0).estimates == walk.estimates
    assert echostep.replay(WALK).plan is NO_PLAN


def test_settings_are_an_object_or_a_file(tmp_path: Path) -> None:
    (tmp_path / "wide.toml").write_text("[cloud]\nstart_sd_m = 0.5\n")
    cloud = type(echostep.Settings().cloud)(start_sd_m=0.5)
    from_file = echostep.replay(WALK, DEMO, settings=tmp_path / "wide.toml")
    assert from_file.estimates == echostep.replay(WALK, DEMO, settings=echostep.Settings(cloud=cloud)).estimates
    assert from_file.estimates[0].xx_m2 > 0.1


def test_what_cannot_be_read_is_one_error(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match=r"none\.mcap"):
        echostep.replay(tmp_path / "none.mcap", DEMO)
    with pytest.raises(EchostepError, match=r"none\.json: cannot read the plan"):
        echostep.replay(WALK, tmp_path / "none.json")
