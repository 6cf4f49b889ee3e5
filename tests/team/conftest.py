# SPDX-License-Identifier: MIT
"""Certificates for TLS, made once a module."""

from __future__ import annotations

import pytest

from team.team_broker import Certificates


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Certificates:
    return Certificates(tmp_path_factory.mktemp("certificates"))
