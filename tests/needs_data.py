# SPDX-License-Identifier: MIT
"""Tests on public recordings are skipped, with one message, where these are not."""

from __future__ import annotations

from pathlib import Path

import pytest

from echostep_studies.frame.recordings import DATA


def needs_data(name: str = "") -> pytest.MarkDecorator:
    """Skip unless this file or folder of the recordings is there."""
    return pytest.mark.skipif(not (DATA / name).exists(), reason=_absent(name))


def data_or_skip(folder: str) -> Path:
    """The same for fixtures: the folder."""
    if not (DATA / folder).is_dir():
        pytest.skip(_absent(folder))
    return DATA / folder


def _absent(name: str) -> str:
    return f"skipped: no recordings in {DATA / name} (../shared/data or $ECHOSTEP_DATA): host/studies/README.md says where they come from"
