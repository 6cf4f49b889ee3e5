# SPDX-License-Identifier: MIT
"""`plan edit`: hostile posts, and a file that is whole at any time."""

from __future__ import annotations

import http.client
import json
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from echostep.errors import EchostepError
from echostep.plan import load_plan, parse_plan
from echostep_app.page import editor as plan_edit
from echostep_app.page.editor import EditServer
from echostep_app.plan.writer import plan_json, save_plan
from waiting import PATIENCE_S
from walks import PLAN


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
    assert (status, raw.decode()) == (200, plan_json(PLAN))
    assert "default-src 'none'" in headers["content-security-policy"]
    assert asked(served, "picture")[0] == 204
    assert asked(served, "edit/geometry.js")[2]["content-type"].startswith("text/javascript")
    for place in ("/", "/plan", "/x/plan", token + "static/..%2fserver.py", token + "edit/main.py", token + "plan/x"):
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


def test_other_sites_and_wrong_tokens_cannot_post(served: EditServer) -> None:
    before, body = served.file.path.read_bytes(), plan_json(PLAN).encode()
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
