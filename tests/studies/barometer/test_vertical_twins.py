# SPDX-License-Identifier: MIT
"""The vertical kernels against their slow twins: single steps from any state, whole records, smoothing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep_studies.barometer import vertical_kernels
from echostep_studies.barometer import vertical_model as model
from echostep_studies.barometer.vertical_kernels import filter_samples, smooth, smooth_backward, start
from echostep_studies.barometer.vertical_model import State
from naive.vertical import Gaussian, propagated, smoothed, started
from naive.vertical_steps import VerticalFilter

STEPS_S = (0.02, 0.11, 0.5, 0.7, 1.9, 5.0, 5.1, 60.0, 4000.0)  # up to three steps, the longest without a gap, gaps


def levels(rng: np.random.Generator, count: int) -> Floats:
    return np.cumsum(rng.uniform(1.5, 5.0, count))


def any_state(rng: np.random.Generator, heights_m: Floats) -> State:
    """All hypotheses near their levels, some without weight, correlated."""
    size = model.MODES * len(heights_m)
    weights = rng.exponential(1.0, size) * (rng.random(size) < 0.7)
    weights[rng.integers(size)] = 1.0
    means = rng.normal(0.0, [1.5, 0.4, 0.5, 0.7], (size, model.SIZE))
    means[:, model.HEIGHT] += np.repeat(heights_m, model.MODES)
    root = rng.normal(0.0, 0.3, (size, model.SIZE, model.SIZE))
    return weights / weights.sum(), means, root @ root.transpose(0, 2, 1)


def any_rows(rng: np.random.Generator, heights_m: Floats, n: int) -> Floats:
    """Samples of a wearer who moves among the levels; pressure is missing now and then, and at times far off."""
    seen = np.zeros((n, 5))
    seen[:, model.DT] = rng.choice(STEPS_S, n)
    way = rng.choice(heights_m) + np.cumsum(rng.normal(0.0, 0.3, n))
    seen[:, model.CLAIMED] = way + rng.choice([0.0, 4.0, -15.5, 15.5], n, p=[0.6, 0.2, 0.1, 0.1])
    seen[rng.random(n) < 0.15, model.CLAIMED] = math.nan
    seen[:, model.NOISE] = rng.uniform(0.1, 0.5, n)
    seen[:, model.LOWEST], seen[:, model.HIGHEST] = heights_m[0], heights_m[-1]
    if rng.random() < 0.5:
        seen[:, model.LOWEST], seen[:, model.HIGHEST] = -math.inf, math.inf
    return seen


def twin_of(state: State, heights_m: Floats, free: bool) -> VerticalFilter:
    weights, means, covariances = state
    gaussians = [Gaussian(mean.copy(), cov.copy()) for mean, cov in zip(means, covariances, strict=True)]
    return VerticalFilter(heights_m, free, weights, gaussians)


def assert_is_that_of_its_twin(state: State, heights_m: Floats, free: bool, seen: Floats) -> None:
    """Every weight, mean, covariance and joint weight after these samples."""
    twin = twin_of(state, heights_m, free)
    expected = np.array([twin.sample(row) for row in seen])
    size = len(twin.weights)
    found, joint = np.zeros((len(seen), size, model.RESULTS)), np.zeros((len(seen), size, size))
    filter_samples(state, heights_m, free, seen, found, joint)
    np.testing.assert_allclose(joint, expected, rtol=1e-7, atol=1e-13)
    np.testing.assert_allclose(state[0], twin.weights, rtol=1e-7, atol=1e-13)
    for s in np.flatnonzero(twin.weights > model.TINY).tolist():
        mean, cov = twin.gaussians[s]
        np.testing.assert_allclose(state[1][s], mean, rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(state[2][s], cov, rtol=1e-7, atol=1e-7)
        assert found[-1, s] == pytest.approx([twin.weights[s], mean[model.HEIGHT], cov[0, 0]], rel=1e-7, abs=1e-7)


@pytest.mark.slow
@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.booleans())
def test_one_sample_from_any_state_is_that_of_the_twin(seed: int, count: int, free: bool) -> None:
    rng = np.random.default_rng(seed)
    heights = np.zeros(1) if free else levels(rng, count)
    assert_is_that_of_its_twin(any_state(rng, heights), heights, free, any_rows(rng, heights, 1))


@pytest.mark.slow
@settings(max_examples=6)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_a_record_from_its_start_is_that_of_the_twin(seed: int, free: bool) -> None:
    rng = np.random.default_rng(seed)
    heights = np.zeros(1) if free else levels(rng, 2)
    seen, prior = any_rows(rng, heights, 12), rng.uniform(0.0, 3.0, len(heights))
    state = start(heights, prior, 4.0, 0.3)
    weights, gaussians = started(heights, prior, 4.0, 0.3)
    assert state[0] == pytest.approx(weights)
    for s in np.flatnonzero(weights).tolist():
        assert state[1][s] == pytest.approx(gaussians[s].mean)
        assert state[2][s] == pytest.approx(gaussians[s].cov)
    assert_is_that_of_its_twin(state, heights, free, seen)


def test_a_sample_that_nothing_explains_is_skipped() -> None:
    """All are on stairs a million metres above the levels: no hypothesis keeps any weight."""
    rng = np.random.default_rng(1)
    heights = levels(rng, 2)
    seen = any_rows(rng, heights, 1)
    seen[0, model.DT], seen[0, model.LOWEST : model.HIGHEST + 1] = 0.5, heights[[0, -1]]
    state = any_state(rng, heights)
    state[0][np.arange(len(state[0])) % model.WAYS == model.ON] = 0.0
    state[1][:, model.HEIGHT] = 1e6
    before = state[0].copy()
    assert_is_that_of_its_twin(state, heights, False, seen)
    assert (state[0] == before).all()


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_smoothing_is_the_sum_over_all_paths(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    joint, last = rng.exponential(1.0, (n, 3, 3)), rng.exponential(1.0, 3)
    joint[rng.random(joint.shape) < 0.3] = 0.0
    joint[rng.random((n, 3)) < 0.2] = 0.0
    joint[:, 0, 0] += 1e-3
    joint, last = joint / joint.sum(axis=(1, 2), keepdims=True), last / last.sum()
    assert smooth_backward(joint, last) == pytest.approx(smoothed(joint, last))


@pytest.mark.slow
def test_blocks_of_a_record_are_smoothed_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Joint weights of five samples at once, against those of the whole record."""
    monkeypatch.setattr(vertical_kernels, "BLOCK", 5)
    rng = np.random.default_rng(2)
    heights, prior = levels(rng, 2), np.ones(2)
    seen = any_rows(rng, heights, 17)
    seen[0, model.CLAIMED] = heights[0]
    _, found = smooth(seen, heights, prior, free=False)
    twin = VerticalFilter(heights, False, *started(heights, prior, seen[0, model.CLAIMED], seen[0, model.NOISE]))
    joints = [twin.sample(row) for row in seen]
    expected = [twin.weights]
    for joint in reversed(joints[1:]):
        total = joint.sum(axis=1, keepdims=True)
        before = expected[0] @ np.divide(joint, total, out=np.zeros_like(joint), where=total > 0.0)
        expected.insert(0, before / before.sum())
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-10)


def test_a_second_is_a_second_however_it_is_cut() -> None:
    """A gust that fades wanders as far in ten steps as in one."""
    one = Gaussian(np.zeros(model.SIZE), np.eye(model.SIZE))
    cut = one
    for _ in range(10):
        cut = propagated(cut, model.FADING, model.ON, 0.1)
    whole = propagated(one, model.FADING, model.ON, 1.0)
    assert cut.cov[model.GUST, model.GUST] == pytest.approx(whole.cov[model.GUST, model.GUST])
