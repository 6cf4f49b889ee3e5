# SPDX-License-Identifier: MIT
"""A page for other machines is named by addresses that these reach, and by a QR code on a terminal."""

from __future__ import annotations

import io
import socket
import sys

import numpy as np
import pytest
from rich.console import Console

from echostep_app.page.server import Address
from echostep_app.page.web import addresses
from echostep_app.page.web.addresses import HALVES, own_addresses, page_urls, print_page, qr_code
from page.frames import served

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


def test_without_the_package_its_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("echostep_app.extras.find_spec", lambda _: None)
    said = io.TextIOWrapper(io.BytesIO(), "utf-8")
    print_page(Console(file=said, force_terminal=True, soft_wrap=True), (URL,))
    said.seek(0)
    assert "its QR code needs segno, which is not installed: pip install 'echostep[page]'" in said.read()
