# SPDX-License-Identifier: MIT
"""`echostep command` as a program: a broker, a tracker's outbox, the page over its socket; guards against other sites."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from command_line import PROGRAM, echostep
from operation.teams import ServedTeam, whole_team
from page.frames import next_frame, opened_url
from team.network import box_to
from team.team_broker import Broker, needs_broker
from team.team_reports import POSITION, report
from waiting import PATIENCE_S, until
from walks import DEMO


@needs_broker
def test_the_command_serves_what_a_tracker_reports(tmp_path: Path) -> None:
    with Broker(tmp_path) as broker:
        command = [*PROGRAM, "command", broker.url, "--plan", str(DEMO), "--port", "0", "--json"]
        command += ["--out", str(tmp_path / "operation.mcap")]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "PYTHONUNBUFFERED": "1"}
        running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
        assert running.stderr
        found = re.search(r"(http://127\.0\.0\.1:\d+)/\S*", running.stderr.readline())
        assert found
        box = box_to(broker.url)
        with opened_url(found[0]) as page:
            hello = json.loads(page.recv(PATIENCE_S))
            assert (hello["kind"], hello["plan"]["name"]) == ("hello", "Demo office")

            def rows() -> Any:
                box.offer(report("anna", position=replace(POSITION, protection_m=0.4)))
                header = next_frame(page)
                page.send(json.dumps({"kind": "drawn", "seq": header["seq"]}))
                return header["list"]

            assert until(lambda: any(row["name"] == "anna" and "within 0.4 m" in row["words"] for row in rows() or []))
        box.close()
        running.send_signal(signal.SIGINT)
        out, _ = running.communicate(timeout=PATIENCE_S)
    assert [member["name"] for member in json.loads(out)["members"]] == ["anna"]


def test_the_table_in_a_file_ends_its_last_line(tmp_path: Path) -> None:
    """What comes behind it, as an error, has a line of its own."""
    nobody = "mqtt://127.0.0.1:9"  # the port `discard` [RFC 863]
    done = echostep(
        "command", nobody, "--plan", DEMO, "--seconds", 0.2, "--no-page", "--out", tmp_path / "o.mcap", ends=0
    )
    assert done.stdout.endswith("no connection to the broker\n")


def test_other_sites_cannot_open_the_socket_and_hostile_requests_do_nothing() -> None:
    with ServedTeam(whole_team()) as served:
        url = served.page.url
        with pytest.raises(InvalidStatus):
            connect(url.replace("http", "ws", 1) + "socket", origin=Origin("http://evil.example")).__enter__()
        with opened_url(url) as page:
            page.recv(PATIENCE_S)
            first = next_frame(page)
            assert len(first["list"]) == 8
            hostile = ["", "[]", "{", '{"kind":"choose","id":-1}', '{"kind":"choose","id":"x"}', "[" * 1500]
            for text in [*hostile, '{"kind":"drawn","seq":1e99}', json.dumps({"kind": "choose", "id": 1 << 60})]:
                page.send(text)
            assert until(lambda: served.page.server.counts.unknown == len(hostile) + 2)
            page.send(json.dumps({"kind": "choose", "id": first["list"][0]["id"]}))
            chosen = next_frame(page)
            assert chosen["details"]["id"] == first["list"][0]["id"]
            assert chosen["trail"] == 0  # the page has it already


def test_a_page_that_draws_nothing_is_sent_two_frames_and_no_more() -> None:
    with ServedTeam(whole_team()) as served:
        url = served.page.url
        with opened_url(url) as page:
            page.recv(PATIENCE_S)
            first = next_frame(page)
            served.show()
            page.recv(PATIENCE_S)
            for _ in range(5):
                served.show()
            served.team.pass_time(60.0)
            served.show()
            page.send(json.dumps({"kind": "drawn", "seq": first["seq"]}))
            newest = next_frame(page)
    assert newest["seq"] == first["seq"] + 2
    assert "silent" in newest["list"][2]["words"]  # it has the newest scene, not one of those that it missed
