# SPDX-License-Identifier: MIT
"""A page for other machines is named by addresses that these reach, and by a QR code on a terminal.

On a computer of several users its address has a token, on loopback too.
"""

from __future__ import annotations

import io
import os
import pwd
import socket
import sys

import numpy as np
import pytest
from rich.console import Console

from echostep_app.page.server import Address
from echostep_app.page.web import access, addresses
from echostep_app.page.web.access import has_other_users
from echostep_app.page.web.addresses import HALVES, own_addresses, page_urls, print_page, qr_code
from page.frames import fetched, served

URL = "http://192.168.1.20:8420/AbCdEfGhIjKlMnOpQrStUv/"


def test_all_interfaces_are_the_addresses_of_each_the_route_to_everywhere_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = ["127.0.0.1", "169.254.3.4", "10.42.0.1", "192.168.1.20"]
    monkeypatch.setattr(addresses, "_of_interfaces", lambda: iter(found))
    monkeypatch.setattr(addresses, "_routed", lambda: iter(["192.168.1.20"]))
    assert own_addresses() == ["192.168.1.20", "10.42.0.1"]
    urls = page_urls("0.0.0.0", 8420, "t")
    assert urls == ("http://192.168.1.20:8420/t/", "http://10.42.0.1:8420/t/")
    assert page_urls("127.0.0.1", 8420, None) == ("http://127.0.0.1:8420/",)
    assert page_urls("fd00::7", 1, "t") == ("http://[fd00::7]:1/t/",)


@pytest.mark.skipif(sys.platform != "linux", reason="interfaces are asked for their addresses on Linux")
def test_interfaces_are_asked_for_their_addresses() -> None:
    assert "127.0.0.1" in list(addresses._of_interfaces())


def test_a_machine_without_a_network_has_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(addresses, "own_addresses", list)
    assert page_urls("::", 1, "t") == (f"http://{socket.gethostname()}:1/t/",)


def test_each_address_that_is_named_answers() -> None:
    with served(address=Address("0.0.0.0", 0)) as (server, _):
        for url in server.urls:
            host, port = url.split("/")[2].rsplit(":", 1)
            with socket.create_connection((host, int(port)), timeout=5.0):
                pass


def test_the_qr_code_has_the_modules_of_the_address() -> None:
    segno = pytest.importorskip("segno", reason="segno is not installed: pip install 'echostep[page]'")
    modules = {half: pair for pair, half in HALVES.items()}
    pairs = [[modules[half] for half in line] for line in qr_code(URL).splitlines()]
    rows = np.array([[pair[k] for pair in line] for line in pairs for k in (0, 1)])
    wanted = np.array([list(row) for row in segno.make_qr(URL).matrix], dtype=bool)
    size = len(wanted)
    assert np.array_equal(rows[2 : 2 + size, 2 : 2 + size], wanted)
    assert wanted[:7, :7].sum() == 33  # a finder's pattern
    assert rows.sum() == wanted.sum()  # the border is light


@pytest.mark.parametrize(
    ("url", "terminal", "coded"), [(URL, True, True), (URL, False, False), ("http://127.0.0.1:8420/", True, False)]
)
def test_a_code_is_printed_for_other_machines_on_a_terminal(url: str, terminal: bool, coded: bool) -> None:
    pytest.importorskip("segno", reason="segno is not installed: pip install 'echostep[page]'")
    said = io.TextIOWrapper(io.BytesIO(), "utf-8")
    print_page(Console(file=said, force_terminal=terminal, soft_wrap=True), (url, URL))
    said.seek(0)
    text = said.read()
    assert f"The page: {url}\nor: {URL}\n" in text
    assert ("█▀▀▀▀▀█" in text) == coded


def account(name: str, uid: int, shell: str) -> pwd.struct_passwd:
    return pwd.struct_passwd((name, "x", uid, uid, "", f"/home/{name}", shell))


@pytest.mark.parametrize(
    ("uid", "shell", "counts"),
    [(4321, "/bin/bash", True), (4321, "/usr/sbin/nologin", False), (33, "/bin/sh", False), (65534, "/bin/sh", False), (-1, "/bin/sh", False)],
)  # fmt: skip
def test_a_person_with_a_shell_is_another_user(
    monkeypatch: pytest.MonkeyPatch, uid: int, shell: str, counts: bool
) -> None:
    """Not a service, and not this process's own user (-1)."""
    monkeypatch.setattr(os, "getuid", lambda: 1234)
    monkeypatch.setattr(
        pwd, "getpwall", lambda: [account("root", 0, "/bin/sh"), account("one", 1234 if uid < 0 else uid, shell)]
    )
    assert has_other_users() == counts


@pytest.mark.parametrize("several", [True, False])
def test_a_computer_of_several_users_asks_for_the_token(monkeypatch: pytest.MonkeyPatch, several: bool) -> None:
    monkeypatch.setattr(access, "has_other_users", lambda: several)
    with served() as (server, _):
        assert server.url.startswith("http://127.0.0.1:")
        assert (server.url.count("/") == 4) == several
        assert fetched(server.url).status == 200
        root = server.url[: server.url.index("/", 8)] + "/"
        assert fetched(root).status == (404 if several else 200)
