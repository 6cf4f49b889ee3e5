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

LAYERS = ("twin", "browser", "process", "study")
STUDIES = Path(__file__).with_name("studies")
ADVICE = "A test that starts a process is marked: @pytest.mark.process"
_layer_of: list[tuple[pytest.Mark, str]] = []


def needs(layer: str, *, missing: bool, reason: str) -> pytest.MarkDecorator:
    """A mark of the tests of a layer, which are skipped where something of it is missing."""
    decorator = pytest.mark.skipif(missing, reason=reason)
    _layer_of.append((decorator.mark, layer))
    return decorator


def mark(item: pytest.Item) -> None:
    """Give a test the marks that follow from its folder, its fixtures and what it says it needs."""
    own = list(item.iter_markers())
    for need, layer in _layer_of:
        if need in own:
            item.add_marker(layer)
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
