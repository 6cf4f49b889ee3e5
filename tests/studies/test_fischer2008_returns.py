# SPDX-License-Identifier: MIT
"""The guided returns of [Fischer 2008, 4]: magnetic sources, measurements, the paper's fusion, intervals, each system's success, resampling."""

from __future__ import annotations

import copy
import json
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from command_line import echostep
from echostep.beacons.model import BeaconSettings
from echostep_simulation.world.beacon_ground import OUTLIER_M, disturbance, ground, is_in_reach, measure
from echostep_studies.fischer2008.beacon_cloud import new_cloud, resample_beliefs
from echostep_studies.fischer2008.paper_fusion import FUSION, fuse
from echostep_studies.fischer2008.simulator import OURS, PAPER, PDR, guided_return
from echostep_studies.fischer2008.study import NOMINAL, UNCERTAIN, Case, cases, one_return, wilson95


def test_source_turns_the_heading_once_by_the_side_of_approach() -> None:
    sources, inside = np.array([[5.0, 1.0, 2.0, 0.5]]), np.zeros(1, bool)
    east = [disturbance(sources, inside, x, 0.0, 0.0) for x in np.arange(0.0, 10.0, 0.1)]
    west = [disturbance(sources, inside, x, 0.0, math.pi) for x in np.arange(10.0, 0.0, -0.1)]
    assert [v for v in east if v] == [0.5]  # on the left
    assert [v for v in west if v] == [-0.5]


def test_measurements_have_the_papers_spread() -> None:
    world = ground(NOMINAL, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    x, y, axis = world.beacons[3]
    seen = np.array([measure(world, 3, x + 3.0, y, rng) for _ in range(20_000)])
    far = seen[:, 0] > 3.0 + OUTLIER_M / 2
    assert abs(far.mean() - 0.1) < 0.01
    assert abs(seen[~far, 0].std() - 0.05) < 0.002
    assert abs(np.degrees(np.angle(np.exp(1j * (seen[:, 1] + axis)))).std() - 30.0) < 1.0
    assert is_in_reach(world, 3, x + 7.9, y)
    assert not is_in_reach(world, 3, x + 8.1, y)


def test_fusion_leaves_small_discrepancies_alone_and_turns_about_the_last_reliable_place() -> None:
    w = np.zeros(1, FUSION)[0]
    w["x"] = 10.0
    beacon = np.array([10.0, 1.0, -0.5 * math.pi])
    fuse(w, beacon, 1.5, 0.0, 1.0)  # says (10, -0.5)
    assert (w["x"], w["y"], w["offset"]) == (10.0, 0.0, 0.0)
    beacon = np.array([0.0, 11.0, -0.5 * math.pi])
    fuse(w, beacon, 1.0, 0.0, 1.0)  # says (0, 10): a quarter to the left, seen from (0, 0)
    assert w["x"] == pytest.approx(0.0)
    assert w["y"] == pytest.approx(10.0)
    assert w["offset"] == pytest.approx(0.5 * math.pi)


def test_wilson_interval_against_the_published_example() -> None:
    """[Newcombe 1998, Table I]: 81 of 263 gives 0.2553 to 0.3662; 0 of 20 gives 0 to 0.1611."""
    assert wilson95(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson95(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert wilson95(20, 20)[1] == 1.0


@pytest.mark.long
def test_dead_reckoning_without_iron_is_exact_and_with_iron_fails() -> None:
    clean = replace(NOMINAL, sources=0)
    assert all(one_return(Case("", PDR, clean), seed) for seed in range(5))
    assert sum(one_return(Case("", PDR), seed) for seed in range(40)) < 10


@pytest.mark.long
def test_the_particle_filter_reaches_the_exit_where_the_paper_does_not_always() -> None:
    assert all(one_return(Case("", OURS), seed) for seed in range(20))
    assert sum(one_return(Case("", OURS, UNCERTAIN), seed) for seed in range(20)) >= 19
    paper = sum(one_return(Case("", PAPER, UNCERTAIN), seed) for seed in range(60))
    assert 30 < paper < 60


@pytest.mark.long
def test_nearly_all_return_by_a_map_that_was_learnt_on_the_way_in() -> None:
    """Of 162 returns 156 arrived (seeds 0 to 161); where 96 % do, fewer than 34 of 40 come by chance once in a thousand."""
    assert sum(one_return(Case("", OURS, deployed=True), seed) for seed in range(40)) >= 34


@pytest.mark.long
def test_three_dead_beacons_in_a_row_are_a_gap_that_is_crossed() -> None:
    """20 m without a beacon leave 4 m out of reach; after each return the allowed time without a measurement doubles."""
    for seed in range(3):
        world = ground(replace(NOMINAL, sources=0), np.random.default_rng(seed))
        world.works[5:8] = False
        assert guided_return(world, OURS, seed).arrived


@pytest.mark.long
def test_equal_seeds_equal_returns() -> None:
    world = ground(NOMINAL, np.random.default_rng(4))
    one, two = (guided_return(world, OURS, 4) for _ in range(2))
    assert one.truth.tobytes() == two.truth.tobytes()
    assert one.believed.tobytes() == two.believed.tobytes()


def test_the_cases_have_names_of_their_own() -> None:
    names = [case.name for case in cases()]
    assert len(set(names)) == len(names)
    assert {"pdr", "fischer2008", "default"} <= set(names)


@pytest.mark.long
def test_command_writes_rows_and_a_picture(tmp_path: Path) -> None:
    words = ["evaluate", "fischer2008", "--runs", "2", "--json", "rows.json", "--out", "out"]
    echostep(*words, cwd=tmp_path, env=os.environ | {"COLUMNS": "200"}, ends=0)
    rows = json.loads((tmp_path / "rows.json").read_text())["rows"]
    assert [row["name"] for row in rows] == [case.name for case in cases()]
    assert all(set(row) == {"name", "success", "low95", "high95", "runs"} for row in rows)
    assert all(0.0 <= row["low95"] <= row["success"] <= row["high95"] <= 1.0 for row in rows)
    assert (tmp_path / "out" / "sweeps.png").stat().st_size > 10_000


@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_beliefs_are_those_of_the_chosen(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    chosen = np.sort(rng.integers(0, n, n))
    beliefs = new_cloud(n, 2, 0.0, 0.0, BeaconSettings(), rng).beacons.beliefs
    for part in beliefs:
        part[:] = rng.standard_normal(part.shape)
    before = copy.deepcopy(beliefs)
    resample_beliefs(beliefs, chosen)
    for part, old in zip(beliefs, before, strict=True):
        assert (part == old[chosen]).all()
