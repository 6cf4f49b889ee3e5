# SPDX-License-Identifier: MIT
"""What the check finds, that it finds nothing in sound plans, and the pictures; drawn storeys that are no plan."""

from __future__ import annotations

import json
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from typer.testing import CliRunner

from echostep.errors import EchostepError
from echostep.plan import Level, Plan, parse_plan
from echostep_app.cli import app
from echostep_app.plan.check import check_plan
from echostep_app.plan.cropping import within
from echostep_app.plan.pictures.drawing import draw_plan
from echostep_app.plan.places.findings import PlanFinding, refusals
from localization.test_drawn_places import ROOM as DRAWN
from localization.test_drawn_places import drawing
from snapshots import expect
from walks import DEMO, PLAN


def flat(walls: Sequence[Any], **fields: Any) -> Plan:
    return house([{"name": "ground", "walls": walls} | fields])


def house(levels: list[dict[str, Any]], **fields: Any) -> Plan:
    return parse_plan(json.dumps({"echostep_plan": 1, "levels": levels} | fields).encode())


def box(x: float = 0.0, y: float = 0.0, wide: float = 4.0, high: float = 3.0) -> list[list[float]]:
    """Four walls, without the door from x + 1 to x + 2 in the south."""
    u, v = x + wide, y + high
    return [[x, y, x + 1, y], [x + 2, y, u, y], [u, y, u, v], [u, v, x, v], [x, v, x, y]]


def door(x: float = 0.0, y: float = 0.0) -> dict[str, Any]:
    return {"line": [x + 1, y, x + 2, y]}


ROOM = {"name": "A", "at": [2, 1]}
UP = {"name": "up", "at": [3, 2]}
SHUT: list[list[float]] = [*box(), [1, 0, 2, 0]]
WIDE: list[list[float]] = [[0, 0, 1, 0], [3, 0, 4, 0], *box()[2:]]
HALF_OPEN: list[list[float]] = [*box(0, 0, 8), [4, 0, 4, 1], [4, 1.9, 4, 3]]
TWO_ROOMS = [ROOM, {"name": "B", "at": [6, 1]}]
APART = {"rooms": [ROOM, {"name": "B", "at": [12, 1]}], "doors": [door(), door(10)]}
STAIRS = {"kind": "stairs", "name": "S", "levels": [0, 1], "outline": [[0.5, 0.5], [1.5, 0.5], [1.5, 1.5], [0.5, 1.5]]}
STOREY = {"walls": box(), "doors": [door()], "rooms": [ROOM]}
TWO = [{"name": name, **STOREY} for name in "gh"]
AROUND_STAIRS: list[list[float]] = [
    [0.4, 0.4, 1.6, 0.4],
    [1.6, 0.4, 1.6, 1.6],
    [1.6, 1.6, 0.4, 1.6],
    [0.4, 1.6, 0.4, 0.4],
]
AJAR: list[list[float]] = [*AROUND_STAIRS[:2], [1.6, 1.6, 1.4, 1.6], [0.6, 1.6, 0.4, 1.6], AROUND_STAIRS[3]]
SPLIT = {"name": "g", "walls": box(), "doors": [door()], "rooms": [ROOM, {"name": "B", "at": [3, 1]}]}


def in_metres(height_m: float) -> Plan:
    return house(
        [{"name": str(k), "height_m": k * height_m, **STOREY, "rooms": []} for k in (0, 1)], connectors=[STAIRS]
    )


def meeting(y: float) -> Plan:
    """The wall in the east begins at this y."""
    return flat(box()[:2] + [[4.0, y, 4.0, 3.0]] + box()[3:], doors=[door()])


def over(walls: list[list[float]], **upper: Any) -> Plan:
    """Two storeys with stairs; the upper one has more walls."""
    return house([TWO[0], TWO[1] | {"walls": [*box(), *walls]} | upper], connectors=[STAIRS])


SOUND = {
    "the demo": PLAN,
    "a room": flat(box(), doors=[door()], rooms=[ROOM]),
    "nothing": flat([]),
    "storeys at one height": in_metres(0.0),
    "storeys": in_metres(3.5),
    "a gap between two rooms and one to the outside": flat(HALF_OPEN, rooms=TWO_ROOMS),
    "walls that meet": meeting(0.004),
    "walls apart": meeting(0.2),
    "faces of a wall with an open end": flat([[0, 0, 5, 0], [0, 0.08, 5, 0.08]]),
    "a wall that crosses another": flat([[0, 0, 5, 0], [2, -0.06, 2, 0.06]]),
    "walls in a row": flat([[0, 0, 5, 0], [5, 0, 9, 0], [2, 0, 2, 4]]),
    "two rooms with doors": flat([*box(), *box(10)], **APART),
    "reached from the start": house([{"walls": SHUT, "rooms": [ROOM]}], start={"x": 3, "y": 2, "heading_deg": 0}),
    "a door somewhat narrower than its gap": flat(box(), doors=[{"line": [1.05, 0, 1.95, 0]}]),
    "storeys with stairs": house(TWO, connectors=[STAIRS]),
    "stairs in a room of their own": over(AJAR, rooms=[], doors=[{"line": [0.6, 1.6, 1.4, 1.6]}, door()]),
    "an upper room without a door": house([SPLIT, {"name": "h", "walls": SHUT, "rooms": [UP]}], connectors=[STAIRS]),
}  # fmt: skip
FAULTY = {
    "drawn in centimetres": flat([[100 * v for v in wall] for wall in box()], doors=[{"line": [100, 0, 200, 0]}]),
    "a height in centimetres": in_metres(-350.0),
    "an open room": flat(WIDE, rooms=[ROOM]),
    "a room without walls": flat([], rooms=[ROOM]),
    "a hole in the east": flat([[0, 0, 4, 0], [4, 0, 4, 2.6], [4, 3, 0, 3], [0, 3, 0, 0]], rooms=[ROOM]),
    "a closed gap": flat([*HALF_OPEN, [4.0, 1.0, 4.0, 1.9]], rooms=TWO_ROOMS),
    "walls that almost meet": meeting(0.04),
    "overlapping walls": flat([[0, 0, 5, 0], [4, 0, 9, 0], [5, 0, 5, 3]]),
    "a wall twice": flat([[0, 0, 5, 0], [5, 0, 0, 0]]),
    "a window over a wall": flat([[0, 0, 5, 0]], windows=[[1, 0, 2, 0]]),
    "a closed house": flat([*box(), *box(10), [11.0, 0.0, 12.0, 0.0]], **APART | {"doors": [door()]}),
    "a start outside": house([{"walls": SHUT, "rooms": [ROOM]}], start={"x": 9, "y": 2, "heading_deg": 0}),
    "a start in a wall": house([STOREY], start={"x": 4.0, "y": 2, "heading_deg": 0}),
    "a door on the moon": flat(box(), doors=[door(), {"line": [10, 1, 11, 1], "name": "moon"}]),
    "a door beside its wall": flat(box(), doors=[{"line": [1, 0.3, 2, 0.3]}]),
    "a wall through a door": flat(SHUT, doors=[door()]),
    "a door between the faces of its wall": flat([*SHUT, [0, 0.2, 4, 0.2]], doors=[{"line": [1, 0.1, 2, 0.1]}]),
    "a door near its wall": flat(SHUT, doors=[{"line": [1, 0.08, 2, 0.08]}]),
    "a house without an exit": house([{"walls": [*SHUT, [2.5, 0, 2.5, 1], [2.5, 1.9, 2.5, 3]]}] * 2, connectors=[STAIRS]),
    "a half without a name that no way leads into": flat([*box(0, 0, 8), [4, 0, 4, 3]], doors=[door()]),
    "storeys without stairs": house(TWO),
    "stairs outside": house(TWO, connectors=[STAIRS | {"outline": [[10, 0], [11, 0], [11, 1]]}]),
    "a roof": house([*TWO, {"name": "roof", "walls": box()}], connectors=[STAIRS]),
    "stairs behind walls": over(AROUND_STAIRS, rooms=[]),
    "stairs that cross themselves": house(TWO, connectors=[STAIRS | {"outline": [[0, 0], [1, 1], [1, 0], [0, 1]]}]),
    "stairs without area": house(TWO, connectors=[STAIRS | {"outline": [[0, 0], [1, 1], [2, 2]]}]),
    "stairs across the town": house(TWO, connectors=[STAIRS | {"outline": [[-1e5, 0], [1e5, 1], [1e5, 0]]}]),
    "a cut upper storey": house(
        [SPLIT, {"name": "h", "walls": [*SHUT, [2.5, 0, 2.5, 3]], "rooms": [UP]}], connectors=[STAIRS]
    ),
    "six closed rooms beside one that has a door": house(
        [{
            "walls": [*box(), *(wall for x in range(10, 70, 10) for wall in (*box(x), [x + 1, 0, x + 2, 0]))],
            "doors": [door()],
            "rooms": [ROOM, *({"name": f"C{k}", "at": [12 + 10 * k, 1]} for k in range(6))],
        }],
        start={"x": 2, "y": 1, "heading_deg": 0},
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", SOUND)
def test_sound_plans(case: str) -> None:
    assert check_plan(SOUND[case]) == []


@pytest.mark.parametrize("case", FAULTY)
def test_what_is_found(case: str) -> None:
    plan = FAULTY[case]
    said = [f"{f.kind}, level {f.level}, at {f.position_m}, {len(f.lines_m)} lines: {f.text}" for f in check_plan(plan)]
    expect("plan check", {case: said}, within=0.01)


SMALL = st.integers(0, 5).map(float)
WALLS = st.lists(st.tuples(SMALL, SMALL, SMALL, SMALL).filter(lambda w: w[:2] != w[2:]), max_size=12)


@given(WALLS, st.lists(st.tuples(SMALL, SMALL), max_size=3))
@settings(max_examples=60, deadline=None)
def test_any_walls_can_be_checked(walls: list[tuple[float, ...]], rooms: list[tuple[float, float]]) -> None:
    plan = flat([list(w) for w in walls], rooms=[{"name": "r", "at": list(at)} for at in rooms])
    findings = check_plan(plan)
    assert [finding.number for finding in findings] == list(range(1, len(findings) + 1))
    once = {tuple(sorted((w[:2], w[2:]))) for w in walls}
    if len(once) < len(walls):
        assert "overlap" in {finding.kind for finding in findings}


def test_walls_of_a_rectangle() -> None:
    walls = np.array([[0, 0, 10, 0], [20, 20, 30, 30], [-5, 5, 15, 5], [4, 4, 4.01, 4]], dtype=np.float64)
    assert within(walls, (0, -1, 10, 10)).tolist() == walls[[0, 2, 3]].tolist()
    assert not len(within(walls, (100, 100, 101, 101)))


@pytest.mark.slow
def test_pictures(tmp_path: Path) -> None:
    draw_plan(PLAN, tmp_path / "plan.png", [0])
    seen = imread(tmp_path / "plan.png")[..., :3]
    draw_plan(PLAN, tmp_path / "part.png", [0], (0, 0, 5, 5))
    draw_plan(PLAN, tmp_path / "wrong.png", [0], None, [PlanFinding("gap", 0, (5.0, 5.0), "x", ((1, 1, 9, 9),), 1)])
    wrong = imread(tmp_path / "wrong.png")[..., :3]
    assert (seen.min(axis=2) < 0.4).mean() > 0.002  # walls
    assert seen.shape == wrong.shape
    red = (wrong[..., 0] > 0.7) & (wrong[..., 1] < 0.2)
    assert red.sum() > 100
    assert ((seen[..., 0] > 0.7) & (seen[..., 1] < 0.2)).sum() == 0
    draw_plan(PLAN, tmp_path / "plan.svg", [0])
    first = (tmp_path / "plan.svg").read_bytes()
    draw_plan(PLAN, tmp_path / "plan.svg", [0])
    assert b"<svg" in first
    assert first == (tmp_path / "plan.svg").read_bytes()
    for label in ("x / m", "y / m", "wall", "start"):
        assert f"<!-- {label} -->".encode() in first
    with pytest.raises(EchostepError, match=r"\.svg or \.pdf"):
        draw_plan(PLAN, tmp_path / "plan.gif", [0])
    with pytest.raises(EchostepError, match="cannot write"):
        draw_plan(PLAN, tmp_path / "none" / "plan.png", [0])


@pytest.mark.slow
def test_any_name_is_drawn(tmp_path: Path) -> None:
    names = ("$x^$", "$\\frac{1}", "a\tb\nc", "x" * 5000, "\U0001f600", "$$", "&<>")
    levels = [{"name": name, "walls": box(), "rooms": [{"name": name, "at": [2, 1]}]} for name in names]
    plan = house(levels, connectors=[STAIRS | {"name": name} for name in names])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # letters that the font lacks
        draw_plan(plan, tmp_path / "plan.svg", list(range(len(names))), None, check_plan(plan))
        draw_plan(plan, tmp_path / "plan.png", [0])
    ET.parse(tmp_path / "plan.svg")


@pytest.mark.slow
def test_many_walls_become_pixels(tmp_path: Path) -> None:
    at = np.arange(30_000) * 0.01
    walls = np.column_stack((at, at, at + 0.01, at + 0.01))
    plan = Plan("line", (Level("g", 0.0, walls),), None, "")
    draw_plan(plan, tmp_path / "line.png", [0])
    dark = imread(tmp_path / "line.png")[..., :3].max(axis=2) < 0.4
    assert dark.any(axis=0).mean() > 0.8  # the diagonal crosses nearly all columns
    assert dark.mean() < 0.02


def test_commands(tmp_path: Path) -> None:
    run = CliRunner().invoke
    good = run(app, ["plan", "check", str(DEMO)])
    assert (good.exit_code, "nothing wrong" in good.output) == (0, True)
    (tmp_path / "bad.json").write_text(
        '{"echostep_plan": 1, "levels": [{"name": "g", "walls": [[0,0,1,0],[1.05,0,1.05,4]]}]}'
    )
    bad = run(app, ["plan", "check", str(tmp_path / "bad.json"), "--picture", str(tmp_path / "bad.png")])
    assert bad.exit_code == 1
    assert "1. g, x 1.00 m, y 0.00 m: walls almost meet: 0.050 m apart" in bad.output
    assert (tmp_path / "bad.png").stat().st_size > 1000
    assert f"picture: {tmp_path / 'bad.png'}\n" in bad.output
    shown = run(app, ["plan", "show", str(DEMO), "-o", str(tmp_path / "show.svg"), "--level", "Ground floor"])
    assert shown.exit_code == 0
    for wrong in (["--level", "7"], ["--bounds", "1,2,3"], ["--bounds", "1,2,0,3"], ["--bounds", "1,2,nan,3"]):
        failed = run(app, ["plan", "show", str(DEMO), "-o", str(tmp_path / "x.png"), *wrong])
        assert isinstance(failed.exception, EchostepError)


@pytest.mark.slow
def test_no_label_covers_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rooms too close for their names, findings on one spot: what is drawn is apart, and the title counts the names left out."""
    rooms = [{"name": f"a long name of a room {k}", "at": [4 + 0.3 * (k % 5), 4 + 0.2 * (k // 5)]} for k in range(40)]
    plan = flat([[0, 0, 10, 0], [10, 0, 10, 10], [10, 10, 0, 10], [0, 10, 0, 0]], rooms=rooms)
    findings = [PlanFinding("gap", 0, (2.0, 2.0), "x", (), k) for k in range(1, 5)]
    figures: list[Figure] = []
    save = FigureCanvasAgg.print_png

    def kept(canvas: FigureCanvasAgg, *arguments: Any, **options: Any) -> None:
        figures.append(canvas.figure)
        save(canvas, *arguments, **options)  # type: ignore[no-untyped-call]

    monkeypatch.setattr(FigureCanvasAgg, "print_png", kept)
    draw_plan(plan, tmp_path / "plan.png", [0], None, findings)
    (axes,) = figures[0].axes
    boxes = [text.get_window_extent() for text in axes.texts]
    assert {"1", "2", "3", "4"} < {text.get_text() for text in axes.texts}
    assert len(boxes) < 4 + 40
    assert not [(a, b) for k, a in enumerate(boxes) for b in boxes[:k] if a.overlaps(b)]
    assert f"({44 - len(boxes)} names do not fit" in axes.get_title()


def test_a_drawn_storey_that_is_not_known_to_a_room_is_refused() -> None:
    """Its walls are compared with no echo, and a sentence names it; doubtful walls of one that is known are compared."""
    known, refused = (drawing([2.0, 4.0, sd_m]).levels[0] for sd_m in (0.3, 1.2))
    partly = replace(known, walls=DRAWN[:1], doubtful=DRAWN[1:])
    assert (len(partly.heard), len(partly.solid)) == (4, 1)
    plan = Plan("by anna", (known, replace(refused, name="1", walls=DRAWN[:0], doubtful=DRAWN)), None, "")
    (sentence,) = refusals(plan)
    assert sentence.startswith("floor 1 of by anna is refused as a plan")
    assert len(plan.levels[1].heard) == 0
    assert refusals(drawing()) == []
