# SPDX-License-Identifier: MIT
"""Who may open the page on a computer of several users: its address has a token there, on loopback too."""

from __future__ import annotations

import os
import pwd

import pytest

from echostep_app.page.web import users
from echostep_app.page.web.users import has_other_users
from page.frames import fetched, served


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
    monkeypatch.setattr(users, "has_other_users", lambda: several)
    with served() as (server, _):
        assert server.url.startswith("http://127.0.0.1:")
        assert (server.url.count("/") == 4) == several
        assert fetched(server.url).status == 200
        root = server.url[: server.url.index("/", 8)] + "/"
        assert fetched(root).status == (404 if several else 200)
