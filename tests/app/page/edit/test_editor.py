# SPDX-License-Identifier: MIT
"""`plan edit`: hostile posts, a file that is whole at any time, and drawing in Chromium."""

from __future__ import annotations

import http.client
import json
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from board_runs import ROOT
from echostep.errors import EchostepError
from echostep.plan import load_plan, parse_plan
from echostep_app.page import editor as plan_edit
from echostep_app.page.editor import EditServer
from echostep_app.plan.writer import plan_json, save_plan
from page.browser import overflow, spot, violations, wait_for
from page.edit.drawing import PICTURES, answer, click, drag, opened, saved
from waiting import PATIENCE_S

DEMO = ROOT / "host/core/echostep/plans/demo.json"
APART = """(() => {
    const boxes = [...document.querySelectorAll('#marks text')].map((e) => e.getBoundingClientRect());
    const apart = (a, b) => a === b || a.left >= b.right || a.right <= b.left || a.top >= b.bottom || a.bottom <= b.top;
    return boxes.length > 3 && boxes.every((a) => boxes.every((b) => apart(a, b)));
})()"""


def asked(
    server: EditServer, place: str, body: bytes | None = None, **headers: str
) -> tuple[int, bytes, http.client.HTTPMessage]:
    at = urlsplit(server.url)
    line = http.client.HTTPConnection("127.0.0.1", at.port or 0, timeout=PATIENCE_S)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    line.request("GET" if body is None else "POST", place if place.startswith("/") else at.path + place, body, named)
    try:
        answer = line.getresponse()
        return answer.status, answer.read(), answer.headers
    finally:
        line.close()


def test_the_page_the_plan_and_nothing_else(served: EditServer) -> None:
    token = urlsplit(served.url).path
    assert asked(served, "")[0] == 200
    status, raw, headers = asked(served, "plan")
    assert (status, raw.decode()) == (200, plan_json(load_plan(DEMO)))
    assert "default-src 'none'" in headers["content-security-policy"]
    assert asked(served, "picture")[0] == 204
    assert asked(served, "static/geometry.js")[2]["content-type"].startswith("text/javascript")
    for place in ("/", "/plan", "/x/plan", token + "static/..%2fserver.py", token + "static/main.py", token + "plan/x"):
        assert asked(served, place)[0] == 404, place
    assert asked(served, "plan", host="evil.example")[0] == 404
    assert asked(served, "plan", origin="http://evil.example")[0] == 404


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "status", "names"),
    [
        (b"", 422, "not a plan"),
        (b"\xff\xfe", 422, "not a plan"),
        (b"[" * 100_000, 422, "not a plan"),
        (b"[]", 422, "the file"),
        (b'{"echostep_plan": 2}', 422, "echostep_plan"),
        (b'{"echostep_plan": 1, "levels": []}', 422, "levels"),
        (b'{"echostep_plan": 1, "levels": [{"walls": [[0, 0, NaN, 1]]}]}', 422, "levels[0].walls[0]"),
        (b'{"echostep_plan": 1, "levels": [{"walls": [[0, 0, 1e999, 1]]}]}', 422, "levels[0].walls[0]"),
        (
            b'{"echostep_plan": 1, "levels": [{"walls": [], "doors": [{"line": [0, 0, 0]}]}]}',
            422,
            "levels[0].doors[0].line",
        ),
        (b" " * (plan_edit.MOST_BODY + 1), 413, "larger"),
    ],
)
def test_what_is_no_plan_is_refused_by_its_field(served: EditServer, body: bytes, status: int, names: str) -> None:
    before = served.file.path.read_bytes()
    found, raw, _ = asked(served, "plan", body)
    assert (found, names in json.loads(raw)["error"]) == (status, True), raw
    assert served.file.path.read_bytes() == before
    assert [path.name for path in served.file.path.parent.iterdir()] == ["plan.json"]


def test_two_points_are_fitted_and_nothing_is_written(served: EditServer) -> None:
    before = served.file.path.read_bytes()
    point = {"x_m": 0, "y_m": 0, "longitude_deg": 11.5, "latitude_deg": 48.1}
    points = [point, {"x_m": 0, "y_m": 11.1194, "longitude_deg": 11.5, "latitude_deg": 48.1001}]  # 1e-4 degrees north
    status, raw, _ = asked(served, "georeference", json.dumps({"points": points}).encode())
    fit = json.loads(raw)
    assert (status, fit["plan_m"], fit["earth_m"]) == (200, 11.1194, pytest.approx(11.12, abs=0.01))
    assert fit["georeference"]["origin"] == pytest.approx([11.5, 48.1], abs=1e-6)
    assert fit["georeference"]["rotation_deg"] == pytest.approx(0.0, abs=1e-6)
    for body, code, names in (
        (json.dumps({"points": [point, point]}).encode(), 422, "0.00 m apart on the plan"),
        (json.dumps({"points": [point]}).encode(), 422, "a list of two points"),
        (b" " * (plan_edit.MOST_BODY + 1), 413, "larger"),
    ):
        status, raw, _ = asked(served, "georeference", body)
        assert (status, names in json.loads(raw)["error"]) == (code, True), raw
    assert (
        asked(served, "georeference", json.dumps({"points": points}).encode(), origin="http://evil.example")[0] == 404
    )
    assert served.file.path.read_bytes() == before


def test_other_sites_and_wrong_tokens_cannot_post(served: EditServer) -> None:
    before, body = served.file.path.read_bytes(), plan_json(load_plan(DEMO)).encode()
    assert asked(served, "plan", body, origin="http://evil.example")[0] == 404
    assert asked(served, "plan", body, origin="null")[0] == 404
    assert asked(served, "plan", body, host="evil.example")[0] == 404
    assert asked(served, "/wrong-token/plan", body)[0] == 404
    assert asked(served, "/plan", body)[0] == 404
    assert served.file.path.read_bytes() == before


def test_saving_keeps_the_former_file(served: EditServer) -> None:
    path, before = served.file.path, served.file.path.read_bytes()
    path.chmod(0o600)
    tree = json.loads(asked(served, "plan")[1])
    tree["levels"][0]["walls"][0] = [0, 0, 1.25, 2]
    status, _, headers = asked(served, "plan", json.dumps(tree).encode())
    assert status == 200
    assert path.with_name("plan.json.bak").read_bytes() == before
    assert load_plan(path).levels[0].walls[0].tolist() == [0.0, 0.0, 1.25, 2.0]
    assert headers["etag"] == f'"{load_plan(path).digest}"'
    assert asked(served, "plan", json.dumps(tree).encode())[0] == 200  # nothing new: the former file stays
    assert path.with_name("plan.json.bak").read_bytes() == before
    rights = {found.name: found.stat().st_mode & 0o777 for found in path.parent.iterdir()}
    assert rights == {"plan.json": 0o600, "plan.json.bak": 0o600}


def test_a_page_that_read_an_older_file_is_told(served: EditServer) -> None:
    _, raw, headers = asked(served, "plan")
    save_plan(parse_plan(raw.replace(b"demo", b"other")), served.file.path)
    before = served.file.path.read_bytes()
    status, said, _ = asked(served, "plan", raw, if_match=headers["etag"])
    assert (status, b"has changed" in said) == (409, True)
    assert served.file.path.read_bytes() == before


def test_a_save_that_fails_leaves_the_file_whole(served: EditServer, monkeypatch: pytest.MonkeyPatch) -> None:
    before = served.file.path.read_bytes()

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    status, raw, _ = asked(served, "plan", b'{"echostep_plan": 1, "levels": [{"walls": []}]}')
    assert (status, b"No space left" in raw) == (500, True)
    assert served.file.path.read_bytes() == before
    assert [path.name for path in served.file.path.parent.iterdir()] == ["plan.json"]


def test_a_folder_in_the_place_of_the_former_file_is_named(served: EditServer) -> None:
    before = served.file.path.read_bytes()
    served.file.path.with_name("plan.json.bak").mkdir()
    status, raw, _ = asked(served, "plan", b'{"echostep_plan": 1, "levels": [{"walls": []}]}')
    assert (status, b"plan.json.bak: cannot write the plan: Is a directory" in raw) == (500, True)
    assert served.file.path.read_bytes() == before


def test_pictures_and_plans_that_are_none(tmp_path: Path) -> None:
    (tmp_path / "text.png").write_text("no picture")
    (tmp_path / "text.json").write_text("[]")
    with pytest.raises(EchostepError, match="neither PNG"):
        EditServer(tmp_path / "new.json", tmp_path / "text.png", 0)
    with pytest.raises(EchostepError, match="cannot read the picture"):
        EditServer(tmp_path / "new.json", tmp_path / "missing.png", 0)
    with pytest.raises(EchostepError, match=r"text\.json: the file"):
        EditServer(tmp_path / "text.json", None, 0)
    with pytest.raises(EchostepError, match="there is no folder"):
        EditServer(tmp_path / "no/new.json", None, 0)


def test_two_walls_a_door_and_the_scale(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    page.click('[data-tool="scale"]')  # 400 px are 20 m at first; the rectangle's upper side is 15 m
    click(page, 2.5, 12.5)
    click(page, 17.5, 12.5)
    answer(page, "7.5")
    picture = page.evaluate("echostep.sheet.picture")
    assert [picture["perPx"], picture["x"], picture["y"]] == pytest.approx([0.025, 1.25, 6.25], abs=0.02)
    page.click("#whole")
    page.click('[data-tool="wall"]')
    for place in ((3.01, 7.02), (8.02, 7.05), (8.04, 11.0)):
        click(page, *place)
    page.keyboard.press("Escape")
    page.click('[data-tool="door"]')
    click(page, 5.5, 7.0)
    level = saved(page, drawn)
    assert not page.wrong
    assert level.walls.tolist() == [[3.0, 7.0, 5.05, 7.0], [5.95, 7.0, 8.0, 7.0], [8.0, 7.0, 8.0, 11.0]]
    assert level.doors[0].line == (5.05, 7.0, 5.95, 7.0)
    page.click('[data-tool="select"]')  # drag the door along, then the corner away
    page.mouse.move(*spot(page, 5.5, 7.0))
    page.mouse.down()
    page.mouse.move(*spot(page, 6.5, 7.1), steps=4)
    page.mouse.up()
    page.mouse.move(*spot(page, 8.0, 11.0))
    page.mouse.down()
    page.mouse.move(*spot(page, 8.0, 9.5), steps=4)
    page.mouse.up()
    level = saved(page, drawn)
    assert level.doors[0].line == (6.05, 7.0, 6.95, 7.0)
    assert sorted(level.walls.tolist()) == [[3.0, 7.0, 6.05, 7.0], [6.95, 7.0, 8.0, 7.0], [8.0, 7.0, 8.0, 9.5]]
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    page.click('[data-tool="erase"]')
    click(page, 5.5, 7.0)
    level = saved(page, drawn)
    assert not level.doors
    assert sorted(level.walls.tolist()) == [[3.0, 7.0, 8.0, 7.0], [8.0, 7.0, 8.0, 11.0]]
    assert not page.wrong


def test_drawing_does_not_move_the_sheet_and_moving_it_draws_nothing(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    view, walls = "[echostep.view.x, echostep.view.y, echostep.view.scale]", "echostep.sheet.level.walls"
    begin, count = page.evaluate(view), page.evaluate(f"{walls}.length")
    page.click('[data-tool="wall"]')
    drag(page, (2.0, 4.0), (6.0, 4.0))
    drag(page, (2.0, 6.0), (6.0, 6.0))
    assert page.evaluate(f"{walls}.slice({count})") == [[2, 4, 6, 4], [2, 6, 6, 6]]
    assert page.evaluate(view) == begin
    for tool in ("door", "erase", "scale"):
        page.click(f'[data-tool="{tool}"]')
        drag(page, (4.0, 5.0), (4.0, 4.0))
    assert page.evaluate(f"{walls}.length") == count + 2
    assert page.evaluate(view) == begin
    page.click('[data-tool="wall"]')
    click(page, 8.0, 4.0)
    drag(page, (9.0, 4.0), (8.0, 5.0), "right")
    assert page.evaluate(view) != begin
    click(page, 8.0, 6.0)  # the wall that was begun goes on
    assert page.evaluate(f"{walls}.at(-1)") == [8, 4, 8, 6]
    page.keyboard.press("Escape")
    moved = page.evaluate(view)
    page.click('[data-tool="select"]')
    drag(page, (4.0, 5.0), (4.5, 5.5))
    assert page.evaluate(view) != moved
    assert page.evaluate(f"{walls}.length") == count + 3


def test_a_plan_is_traced_from_a_picture(browser: Any, tmp_path: Path) -> None:
    walls = load_plan(DEMO).levels[0].walls  # 1 to 25 m, 1 to 13 m
    lines = "".join(f"M{20 * x0} {280 - 20 * y0}L{20 * x1} {280 - 20 * y1}" for x0, y0, x1, y1 in walls)
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="520" height="280">'
    (tmp_path / "picture.svg").write_text(f'{head}<path d="{lines}" fill="none" stroke="#999" stroke-width="6"/></svg>')
    with EditServer(tmp_path / "new.json", tmp_path / "picture.svg", 0) as server:
        page = opened(browser, server, viewport={"width": 1000, "height": 560})
        page.click('[data-tool="scale"]')  # 20 m wide at first, in truth 26 m
        click(page, 20 / 26, 20 / 26)
        click(page, 25 * 20 / 26, 20 / 26)
        answer(page, "24")
        page.click('[data-tool="origin"]')
        page.mouse.move(*spot(page, 3, 3))
        page.mouse.down()
        page.mouse.move(*spot(page, 3 + 3 / 13, 3 + 3 / 13), steps=4)  # the first point stayed where it was
        page.mouse.up()
        page.click("#whole")
        page.click('[data-tool="wall"]')
        for place in ((1, 1), (25, 1), (25, 13), (1, 13), (1, 1), (1, 8.5), (25, 8.5)):
            click(page, *place)
        page.keyboard.press("Escape")
        page.click('[data-tool="door"]')
        for x in (3.5, 9.5):
            click(page, x, 8.5)
        page.click('[data-tool="room"]')
        click(page, 3.6, 11.3)
        answer(page, "Office 1")
        page.click('[data-tool="wall"]')
        click(page, 6.2, 8.5)
        page.mouse.move(*spot(page, 6.2, 12.0))
        page.screenshot(path=(PICTURES or tmp_path) / "plan-edit.png")
        page.keyboard.press("Escape")
        level = saved(page, server)
        picture = page.evaluate("echostep.sheet.picture")
        assert not page.wrong
    assert picture["perPx"] == pytest.approx(0.05, abs=1e-3)
    assert (picture["x"], picture["y"]) == (pytest.approx(0.0, abs=0.1), pytest.approx(0.0, abs=0.1))
    assert level.walls[:4].tolist() == [[1, 1, 25, 1], [25, 1, 25, 13], [25, 13, 1, 13], [1, 13, 1, 1]]
    assert (len(level.walls), len(level.doors), [room.name for room in level.rooms]) == (7, 2, ["Office 1"])


def test_keys_alone_draw_a_wall_a_door_and_a_room(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    page.focus("#map")
    page.evaluate("echostep.tools.cross = [5, 5]")
    press = page.keyboard.press
    press("w")
    press("Enter")
    for _ in range(20):
        press("ArrowRight")
    reached = page.evaluate("echostep.tools.cross[0]")
    press("Enter")
    press("Escape")
    for _ in range(10):
        press("ArrowLeft")
    press("d")
    press("Enter")
    press("ArrowUp")
    press("ArrowUp")
    press("n")
    press("Enter")
    answer(page, "Hall")
    assert page.evaluate("echostep.sheet.level.rooms.length") == 1
    press("Control+s")
    page.get_by_text("Saved new.json").wait_for()
    level = load_plan(drawn.file.path).levels[0]
    assert not page.wrong
    assert (level.walls[0, :2].tolist(), level.walls[-1, 2:].tolist()) == ([5.0, 5.0], [pytest.approx(reached), 5.0])
    assert level.doors[0].width_m == pytest.approx(0.9)
    assert [room.name for room in level.rooms] == ["Hall"]


def test_geometry(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    rng = np.random.default_rng(7)
    geometry = "import(location.href + 'static/geometry.js')"
    for _ in range(30):  # a door cut anywhere and filled again is the wall that was
        x0, y0, x1, y1 = wall = rng.uniform(-50, 50, 4).round(2).tolist()
        t = rng.random()
        p, width = [x0 + t * (x1 - x0), y0 + t * (y1 - y0)], 0.9
        level, filled = page.evaluate(
            f"""async ([wall, p, w]) => {{ const g = await {geometry}, cut = g.cutDoor({{ walls: [wall] }}, 0, p, w);
            return [cut, g.fillDoor(cut, 0)]; }}""",
            [wall, p, width],
        )
        x2, y2, x3, y3 = level["doors"][0]["line"]
        assert np.hypot(x3 - x2, y3 - y2) == pytest.approx(width, abs=2e-4)
        lengths = [np.hypot(c - a, d - b) for a, b, c, d in level["walls"]]
        assert sum(lengths) + width == pytest.approx(np.hypot(x1 - x0, y1 - y0), abs=1e-3)
        assert sorted([filled["level"]["walls"][0][:2], filled["level"]["walls"][0][2:]]) == sorted(
            [[x0, y0], [x1, y1]]
        )
    short, snapped, moved = page.evaluate(
        f"""async () => {{ const g = await {geometry}, walls = [[0, 0, 4, 0], [4, 0, 4, 3]];
        return [g.cutDoor({{ walls }}, 0, [1, 0], 5), [
          g.snap([3.9, 0.1], {{ walls }}), g.snap([1.02, 1.53], {{ walls }}), g.snap([2.04, 0.1], {{ walls }}),
          g.snap([2.13, 2.12], {{ from: [1, 1], before: [0, 0] }}), g.snap([1.07, 3.02], {{ from: [1, 1] }}),
          g.snap([3.93, 2.02], {{ walls, from: [1, 2] }})],
          g.moveWall({{ walls: [[0, 0, 1, 0], [2, 0, 4, 0], [4, 0, 4, 3]], doors: [{{ line: [1, 0, 2, 0] }}] }}, 0, [0, 0.5])]; }}"""
    )
    assert short is None
    assert [(row["kind"], row["at"]) for row in snapped] == [
        ("end", [4, 0]),
        ("grid", [1.0, 1.55]),
        ("wall", [2.04, 0]),
        ("right angle", pytest.approx([1 + 1.6 * 0.5**0.5, 1 + 1.6 * 0.5**0.5], abs=1e-4)),
        ("right angle", [1, 3]),
        ("wall", [4, 2]),
    ]
    assert moved["walls"] == [[0, 0.5, 1, 0.5], [2, 0.5, 4, 0.5], [4, 0.5, 4, 3]]
    assert moved["doors"] == [{"line": [1, 0.5, 2, 0.5]}]


@pytest.mark.parametrize("look", ["bright", "dark", "contrast"])
def test_nothing_keeps_anybody_out(browser: Any, served: EditServer, look: str, tmp_path: Path) -> None:
    phone = {"viewport": {"width": 360, "height": 640}, "has_touch": True, "is_mobile": True}
    page = opened(browser, served, **({} if look == "dark" else phone))
    page.select_option("#look", look)
    page.click('[data-tool="wall"]')
    found = violations(page)
    page.screenshot(path=tmp_path / f"edit-{look}.png")
    assert not page.wrong
    assert found == []
    assert overflow(page) == (0, 0)
    page.set_viewport_size({"width": 320, "height": 256})
    wait_for(page, "echostep.view.width < 250")
    page.click("#whole")
    wait_for(page, APART)  # names that would cover others are left out
