# SPDX-License-Identifier: MIT
"""The study of the kits: its rows, on the same steps."""

from __future__ import annotations

import numpy as np
import pytest

from echostep_studies.frame.report import rows_by_name
from echostep_studies.girard2011 import kit_feet, kits
from echostep_studies.simulation.sites import otb


@pytest.mark.long
def test_both_kinds_of_rangers_hold_the_papers_figure_on_the_same_steps() -> None:
    rows = kits.one_run(3)
    names = [row.name for row in rows]
    of_rangers = [row for row in rows if not row.name.startswith("foot alone")]
    assert len(set(names)) == 12 + 8
    assert len(of_rangers) == 12
    assert all(len(row.errors_m) == 52 for row in of_rangers)
    means = {row.name: float(np.mean(row.errors_m)) for row in rows}
    assert means["default, SRF02"] < 0.13  # what the paper's system reached with ranging [Girard 2011, Table 1]
    assert means["default, pulse"] < 0.13
    assert means["default, MaxSonar"] < 0.13
    assert [group[0].name for group in rows_by_name(rows)]
    walks = [kits._walk(otb(), 3, kind) for kind in kits.kinds().values()]
    assert all(np.array_equal(walk.trunk_m, walks[0].trunk_m) for walk in walks)
    assert all(np.array_equal(walk.heading_rad, walks[0].heading_rad) for walk in walks)


@pytest.mark.parametrize(("name", "reach_m"), [("SRF02", 6.0), ("pulse", 4.5), ("MaxSonar", 7.65)])
def test_the_tracker_and_the_simulation_agree_on_the_reach_of_rangers(name: str, reach_m: float) -> None:
    kind = kits.kinds()[name]
    assert (kind.echo.maximum_m, kind.acoustics.maximum_m) == (reach_m, reach_m)
    assert kind.echo.minimum_m == kind.acoustics.minimum_m
    pings = kits._walk(otb(), 3, kind).pings
    heard_m = pings.range_m[np.isfinite(pings.range_m)]
    assert kind.acoustics.minimum_m <= heard_m.min()
    assert 0.5 * reach_m < heard_m.max() <= reach_m + 0.1
    assert np.diff(pings.t_s[pings.ranger == 0]).mean() == pytest.approx(2.0 * kind.half_s, abs=1e-3)


def test_a_foot_board_is_as_good_as_an_mtx_on_the_same_steps() -> None:
    rows = [kit_feet.rows(seed) for seed in (1, 2, 3)]
    means = {
        row.name: float(np.mean([np.mean(of_seed[k].errors_m) for of_seed in rows])) for k, row in enumerate(rows[0])
    }
    assert all(len(row.errors_m) > 20 for of_seed in rows for row in of_seed)
    for pace in kit_feet.PACES:
        assert means[f"foot alone, {pace}, foot board, calibrated"] < 2.0 * means[f"foot alone, {pace}, MTx 18 g"] + 0.1
    assert max(means.values()) < 3.0
