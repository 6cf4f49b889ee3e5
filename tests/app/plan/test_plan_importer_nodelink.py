# SPDX-License-Identifier: MIT
"""Importing node and link text: biba, a small building, and what a damaged one gets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import command_line
from echostep.errors import EchostepError
from echostep_app.plan.importers.formats import import_plan
from echostep_studies.frame.recordings import DATA
from needs_data import needs_data

SMALL = {
    "core.txt": "byProgram\nfloor,2,0.jpg,1.jpg\nheight,4.5\nstart,1\nscale,0.5\nnode,node.txt\n",
    "node.txt": "id,layer,x,y\n0,0,0,0\n1,0,10,0\n2,0,10,8\n3,0,20,0\n4,0,14,6\n5,0,14,2\n",
    "link.txt": "id,type,nodeID0,nodeID1\n7,0,0,1\n8,0,1,2\n9,0,1,3\n",
    "polygon.txt": "id,type,nodeNumber,nodeIDs\n5,1,3,1,2,3\n",
    "arrow.txt": "id,type,nodeID0,nodeID1\n0,1,5,5\n",
}


def write(folder: Path, **changed: str) -> Path:
    for name, text in SMALL.items():
        (folder / name).write_text(changed.get(name.removesuffix(".txt"), text))
    return folder


def test_a_small_building(tmp_path: Path) -> None:
    """Pixels of half a metre, y down: node 2 is the lowest; links 7 and 9 are one wall."""
    plan = import_plan(write(tmp_path))
    assert [level.height_m for level in plan.levels] == [0.0, 4.5]
    walls = {tuple(sorted((tuple(w[:2]), tuple(w[2:])))) for w in plan.levels[0].walls}
    assert walls == {((0.0, 4.0), (10.0, 4.0)), ((5.0, 0.0), (5.0, 4.0))}
    assert [(c.kind, c.levels) for c in plan.connectors] == [("stairs", (0, 1))]
    assert plan.start is None


@pytest.mark.process
def test_a_source_without_doors_and_rooms_is_named(tmp_path: Path) -> None:
    done = command_line.echostep("plan", "import", write(tmp_path) / "core.txt", "-o", tmp_path / "plan.json")
    assert "neither door openings nor rooms: ways are the gaps" in done.stdout


@needs_data("maps/biba")
def test_biba() -> None:
    plan = import_plan(DATA / "maps/biba" / "core.txt")
    assert [level.height_m for level in plan.levels] == [0, 4.5, 9, 13.5]
    assert [len(level.walls) for level in plan.levels] == [183, 194, 93, 52]
    assert sum(np.hypot(*(level.walls[:, 2:] - level.walls[:, :2]).T).sum() for level in plan.levels) > 5000
    assert {(0, 1), (0, 1, 2, 3)} <= {c.levels for c in plan.connectors}


@pytest.mark.parametrize(("file", "text", "named"), [
    ("core", "byProgram\nfloor,0\nheight,4\nscale,1\n", "core.txt: floor"),
    ("core", "byProgram\nfloor,2\nheight,nan\nscale,1\n", "core.txt: height.*finite"),
    ("core", "byProgram\nfloor,2\nheight,4\n", "core.txt: scale"),
    ("core", SMALL["core.txt"] + "node,../node.txt", "core.txt: node"),
    ("node", "id,layer,x,y\n0,0,0\n", r"node.txt: line 2: expected 4"),
    ("node", "id,layer,x,y\n0,9,0,0\n", r"node.txt: line 2: floor 9"),
    ("node", "id,layer,x,y\n0,0,a,0\n", r"node.txt: line 2: 'a'"),
    ("node", "id,layer,x,y\n0,0,inf,0\n", r"node.txt: line 2: 'inf'"),
    ("node", "id,layer,x,y\n0,0,1e9,0\n", r"node.txt: line 2: further"),
    ("link", "id,type,nodeID0,nodeID1\n7,0,0,77\n", r"link.txt: line 2: there is no node '77'"),
    ("polygon", "id,type,nodeNumber,nodeIDs\n5,1,3,1,2\n", r"polygon.txt: line 2: a zone"),
    ("arrow", "id,type,nodeID0,nodeID1\n0,5,5,5\n", r"arrow.txt: line 2: type '5'"),
    ("arrow", 'id,type\n"' + "x" * 200_000, r"arrow.txt: field"),
])  # fmt: skip
def test_what_is_wrong_is_named(tmp_path: Path, file: str, text: str, named: str) -> None:
    with pytest.raises(EchostepError, match=named):
        import_plan(write(tmp_path, **{file: text}))


def test_a_binary_file(tmp_path: Path) -> None:
    write(tmp_path)
    (tmp_path / "link.txt").write_bytes(b"\x00\x9f\x00")
    with pytest.raises(EchostepError, match="not UTF-8"):
        import_plan(tmp_path)
