# SPDX-License-Identifier: MIT
"""The benchmark runs and says what it measured; how fast is not a test's business."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from waiting import PATIENCE_S


@pytest.mark.long
@pytest.mark.process
def test_a_tiny_benchmark(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "echostep_studies.speed.bench", "--tiny", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=10.0 * PATIENCE_S, check=False)
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "bench.json").read_text())
    assert len(rows) >= 8
    for row in rows:
        assert set(row) == {"name", "ratio", "median_s", "peer_s"}
        assert row["name"].split(";")[0] in done.stdout.replace("\n", " ")
        assert row["ratio"] > 0.0
        assert row["median_s"] > 0.0
        assert row["peer_s"] > 0.0
    assert (tmp_path / "bench.png").stat().st_size > 1000
