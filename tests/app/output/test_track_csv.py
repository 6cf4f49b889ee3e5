# SPDX-License-Identifier: MIT
"""track.csv: every estimate, its radius and its hypotheses, in numbers that read back to the same bits."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

from echostep.localization import LikelyPlace, TrackStatus
from echostep.walk.table import write_track
from page.frames import told


def test_each_estimate_is_a_row_with_its_hypotheses(tmp_path: Path) -> None:
    places = (LikelyPlace(0.58, 12.31, 4.5, 0, 1.0, 0.0), LikelyPlace(0.4, 2.0, 7.5, 1, 1.0, 0.0))
    spread = replace(told(x_m=0.1 + 0.2, status=TrackStatus.LOST), hypotheses=places, right=0.3, plan_fits=0.25)
    write_track(tmp_path / "track.csv", [told(), spread])
    sure, unsure = csv.DictReader((tmp_path / "track.csv").read_text().splitlines())
    assert (sure["hypotheses"], sure["status"], sure["protection_m"]) == ("", "tracking", "inf")
    assert float(unsure["x_m"]) == 0.1 + 0.2
    assert unsure["hypotheses"] == "0.58:12.3,4.5,0 0.40:2.0,7.5,1"
    assert [unsure[name] for name in ("right", "outside", "plan_fits")] == ["0.3", "0.0", "0.25"]
