# SPDX-License-Identifier: MIT
"""Certificates for TLS, made once a module."""

from __future__ import annotations

import pytest

from echostep_app.team import inbox, outbox
from team.team_broker import Certificates


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A broken connection is tried again at once."""
    for module in (inbox, outbox):
        monkeypatch.setattr(module, "RETRY_PAUSES_S", (0.02, 0.1))


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Certificates:
    return Certificates(tmp_path_factory.mktemp("certificates"))
