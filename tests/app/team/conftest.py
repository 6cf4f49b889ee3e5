# SPDX-License-Identifier: MIT
"""Certificates for TLS, made once a module."""

from __future__ import annotations

import pytest

from echostep_app.team import inbox, outbox
from team.team_broker import Certificates
from waiting import PATIENCE_S


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A broken connection is tried again at once."""
    for module in (inbox, outbox):
        monkeypatch.setattr(module, "RETRY_PAUSES_S", (0.02, 0.1))


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """No report becomes too old to be sent, nor its position lost by its age, however long other programs have the cores."""
    for name in ("FRESH_S", "SETTLED_S", "CLOSING_S"):
        monkeypatch.setattr(outbox, name, PATIENCE_S)


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Certificates:
    return Certificates(tmp_path_factory.mktemp("certificates"))
