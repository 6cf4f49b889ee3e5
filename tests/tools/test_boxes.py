# SPDX-License-Identifier: MIT
"""The printed boxes: closed surfaces, room for their boards, pictures of the present sources; and the check of surfaces itself."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hardware import boxes
from hardware.solids import Triangles, faults, picture, read_stl, volume

needs_openscad = pytest.mark.skipif(
    shutil.which("openscad") is None, reason="openscad is not installed: no box is made"
)
PRINTER_MM = 180.0  # bed of a small printer
BOARDS_MM = {  # boards that lie side by side in each box: length, width together, height with plugs and joints
    "belt_box": (81.0, 51.0 + 8.0, 26.0),
    "ranger_holder": (45.0, 20.0, 15.0),
    "imu_clip": (25.4, 17.78, 10.0),
    "ankle_box": (48.0, 18.0 + 17.78, 12.0),
}


def cube(side: float) -> Triangles:
    corners = np.array([[x, y, z] for x in (0, side) for y in (0, side) for z in (0, side)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.array([corners[[a, b, c]] for p, q, r, s in faces for a, b, c in ((p, q, r), (p, r, s))])


def test_a_cube_is_closed_and_has_its_volume() -> None:
    assert faults(cube(2.0)) == []
    assert volume(cube(2.0)) == pytest.approx(8.0)


def test_surfaces_that_are_not_closed_are_found() -> None:
    whole = cube(2.0)
    assert faults(whole[1:]) == ["3 open edges"]
    assert faults(whole[:, ::-1]) == ["no volume"]
    flipped = whole.copy()
    flipped[0] = flipped[0, ::-1]
    assert "3 edges of more than two faces" in faults(flipped)
    touching = np.concatenate([whole, whole + [2.0, 2.0, 0.0]])  # two cubes that share an edge only
    assert faults(touching) == ["2 edges of more than two faces"]


def test_a_picture_shows_three_sides() -> None:
    seen = picture(cube(10.0), 120)
    colours, counts = np.unique(seen.reshape(-1, 3), axis=0, return_counts=True)
    assert sum(counts > 0.05 * counts.sum()) == 4  # three sides and the paper
    assert (colours[counts.argmax()] > 0).all()


@pytest.mark.parametrize("name", boxes.NAMES)
def test_the_picture_and_what_is_printed_are_of_the_present_source(name: str) -> None:
    """`make hardware` after a change of a source. A binary STL file: 80 bytes, a count, and 50 bytes a facet [3D Systems, 1989]."""
    with Image.open(boxes.BOXES / f"{name}.png") as image:
        assert image.info["Source"] == boxes.sources(name)
    for part in boxes.PARTS:
        stl = (boxes.BOXES / f"{name}-{part}.stl").read_bytes()
        assert stl[:80].decode().split()[-1] == boxes.sources(name)
        facets = np.frombuffer(stl[84:], np.uint8).reshape(int.from_bytes(stl[80:84], "little"), 50)
        assert faults(facets[:, 12:48].copy().view("<f4").reshape(-1, 3, 3).astype(float)) == []


@pytest.mark.process
@needs_openscad
@pytest.mark.parametrize("name", boxes.NAMES)
def test_a_box_and_its_lid_are_closed_fit_the_printer_and_hold_their_boards(name: str, tmp_path: Path) -> None:
    box, lid = (boxes.compiled(name, part, tmp_path) for part in boxes.PARTS)
    assert faults(box) == []
    assert faults(lid) == []
    for part in (box, lid):
        assert np.ptp(part.reshape(-1, 3), axis=0).max() < PRINTER_MM
    outer = np.ptp(lid.reshape(-1, 3), axis=0)[:2]
    depth = np.ptp(box.reshape(-1, 3), axis=0)[2] - 2.0
    length, width, height = BOARDS_MM[name]
    assert outer[0] - 4.0 >= length + 1.0
    assert outer[1] - 4.0 >= width + 1.0
    assert depth >= height
    assert volume(box) < 40_000.0  # mm3: about 50 g of PETG
    assert read_stl(tmp_path / f"{name}-box.stl").shape == box.shape
