# SPDX-License-Identifier: MIT
"""The layers of the suite: which tests need the twin, a browser, a process, a study or long; `make quick` runs the others.

In: collected tests. Out: their marks, and a failure of every other test that starts a process. Owns the rules by which a test gets its mark.
"""

from __future__ import annotations

import contextlib
import subprocess
from collections.abc import Iterator
from multiprocessing.process import BaseProcess
from pathlib import Path
from unittest import mock

import pytest

from board_runs import needs_twin
from team.team_broker import needs_broker

LAYERS = ("twin", "browser", "process", "study")
STUDIES = Path(__file__).with_name("studies")
ADVICE = "A test that starts a process is marked: @pytest.mark.process"


def mark(item: pytest.Item) -> None:
    """Give a test the marks that follow from its folder, its fixtures and what it says it needs."""
    own = list(item.iter_markers())
    if needs_twin.mark in own:
        item.add_marker("twin")
    if needs_broker.mark in own:
        item.add_marker("process")
    if "browser" in getattr(item, "fixturenames", ()):
        item.add_marker("browser")
    if STUDIES in item.path.parents:
        item.add_marker("study")


def is_alone(item: pytest.Item) -> bool:
    """Whether a test does without any other process."""
    return not any(map(item.get_closest_marker, LAYERS))


@contextlib.contextmanager
def no_process() -> Iterator[None]:
    """A process that is started meanwhile fails the test, with the advice to mark it."""
    refusal = AssertionError(ADVICE)
    with (
        mock.patch.object(subprocess.Popen, "__init__", side_effect=refusal),
        mock.patch.object(BaseProcess, "start", side_effect=refusal),
    ):
        yield
