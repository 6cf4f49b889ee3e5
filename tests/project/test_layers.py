# SPDX-License-Identifier: MIT
"""What `make quick` leaves out, and that nothing else starts a process."""

from __future__ import annotations

import multiprocessing
import re
import subprocess
import sys

import pytest

from board_runs import ROOT
from layers import ADVICE, LAYERS


def test_a_test_of_the_quick_layer_starts_no_process() -> None:
    """A test without a mark, as the one here, is of that layer."""
    with pytest.raises(AssertionError, match=ADVICE):
        subprocess.run([sys.executable, "-c", ""], check=True)
    with pytest.raises(AssertionError, match=ADVICE):
        multiprocessing.get_context("spawn").Process(target=int).start()


@pytest.mark.process
def test_a_marked_test_may_start_one() -> None:
    assert subprocess.run([sys.executable, "-c", ""], check=True).returncode == 0


def test_make_quick_leaves_out_the_other_layers() -> None:
    (left_out,) = re.findall(r'^QUICK := -m "not \((.*)\)"$', (ROOT / "Makefile").read_text(), flags=re.M)
    assert left_out.split(" or ") == [*LAYERS, "slow", "long", "speed"]
