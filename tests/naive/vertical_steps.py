# SPDX-License-Identifier: MIT
"""Slow, obviously right twin of the vertical filter's steps: lists of successors, merged by their moments.

In: the same arrays as the kernels. Out: weights, Gaussians and joint weights after each sample. Owns `VerticalFilter`.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep_studies.barometer import vertical_model as model
from naive.vertical import (
    Gaussian,
    Successor,
    handed_over,
    mixed,
    motion,
    near,
    observed,
    propagated,
    set_to,
    wider,
    within,
)

STAIRS, LIFTS = (model.STAIRS_UP, model.STAIRS_DOWN), (model.LIFT_UP, model.LIFT_DOWN)


class VerticalFilter:
    """Hypotheses over these levels, or over level ground at any height (`free`)."""

    def __init__(self, heights_m: Floats, free: bool, weights: Floats, gaussians: list[Gaussian]) -> None:
        self.heights_m, self.free = heights_m, free
        self.weights, self.gaussians = weights.copy(), list(gaussians)

    def sample(self, seen: Floats) -> Floats:
        """One sample: after a gap in one step, otherwise in equal steps of LONGEST_STEP_S at most, pressure in the last; returns p(now, before)."""
        dt = float(seen[model.DT])
        if dt > model.GAP_S:
            return self._step(seen, dt, after_gap=True)
        parts = max(1, math.ceil(dt / model.LONGEST_STEP_S - 1e-9))
        joint = np.diag(self.weights)
        for part in range(parts):
            now = seen.copy()
            if part < parts - 1:
                now[model.CLAIMED] = math.nan
            later = self._step(now, dt / parts, after_gap=False)
            before = joint.sum(axis=1, keepdims=True)
            joint = later @ np.divide(joint, before, out=np.zeros_like(joint), where=before > 0.0)
        return joint

    def _step(self, seen: Floats, dt: float, *, after_gap: bool) -> Floats:
        """Every hypothesis with each of its successors: propagated, weighed, updated, and merged by target; returns the joint weights."""
        size = len(self.weights)
        arrived: list[list[tuple[float, Gaussian]]] = [[] for _ in range(size)]
        joint = np.zeros((size, size))
        for s in np.flatnonzero(self.weights >= model.TINY).tolist():
            for level, air, way, share, gaussian in self._gap(s, dt) if after_gap else self._successors(s, seen, dt):
                if self.weights[s] * share < model.TINIEST:
                    continue
                passed = 0.0 if after_gap else dt
                likelihood, then = observed(propagated(gaussian, air, way, passed), way, seen, passed)
                target = level * model.MODES + air * model.WAYS + way
                arrived[target].append((self.weights[s] * share * likelihood, then))
                joint[target, s] += self.weights[s] * share * likelihood
        total = joint.sum()
        if not total > 0.0:
            return np.diag(self.weights)
        self.weights = joint.sum(axis=1) / total
        for target in np.flatnonzero(self.weights > 0.0).tolist():
            weights = np.array([weight for weight, _ in arrived[target]])
            self.gaussians[target] = mixed((weights / weights.sum()).tolist(), [g for _, g in arrived[target]])
        return joint / total

    def _successors(self, s: int, seen: Floats, dt: float) -> list[Successor]:
        """All that may follow hypothesis s within dt; what does not leave stays as it is, though a stay between levels is short."""
        level, air, way = s // model.MODES, s % model.MODES // model.WAYS, s % model.WAYS
        here = Successor(level, air, way, 1.0, self.gaussians[s])
        leaving = self._calm(here, seen, dt) if air == model.CALM else self._gust(here, dt)
        leaving += self._departures(here, dt) if way == model.ON else self._arrivals(here, dt)
        stays = 1.0 - sum(successor.share for successor in leaving)
        if way != model.ON:
            stays *= math.exp(-dt / model.BETWEEN_S)
        return [*leaving, here._replace(share=stays)]

    def _calm(self, here: Successor, seen: Floats, dt: float) -> list[Successor]:
        """A gust begins; on level ground the weather term may jump, by far only where pressure is far off."""
        g = here.gaussian
        gust = set_to(g, model.GUST, 0.0, model.GUST_M)
        found = [
            here._replace(air=air, share=within(0.5 * model.GUST_BEGINS, dt), gaussian=gust)
            for air in (model.HELD, model.FADING)
        ]
        if here.way == model.ON:
            jump = wider(g, model.WEATHER, model.SHIFT_M**2)
            found.append(here._replace(share=within(model.SHIFTS, dt), gaussian=jump))
            if abs(seen[model.CLAIMED] - g.mean[model.HEIGHT] - g.mean[model.WEATHER]) > model.SEALED_OFF_M:
                lost = wider(g, model.WEATHER, model.SEALED_M**2)
                found.append(here._replace(share=within(model.SEALED, dt), gaussian=lost))
        return found

    def _gust(self, here: Successor, dt: float) -> list[Successor]:
        """A gust jumps, changes its kind, ends where it is about zero; on level ground a held one of a shift's size may become weather."""
        g = here.gaussian
        found = [here._replace(share=within(model.GUST_JUMPS, dt), gaussian=set_to(g, model.GUST, 0.0, model.GUST_M))]
        if here.air == model.HELD:
            found.append(here._replace(air=model.FADING, share=within(model.HELD_FADES, dt)))
        else:
            found.append(here._replace(air=model.HELD, share=within(model.FADING_HOLDS, dt)))
        over, ended = near(g, model.GUST, 0.0, model.GUST_OVER_M)
        found.append(
            here._replace(
                air=model.CALM, share=within(model.GUST_ENDS, dt) * over, gaussian=set_to(ended, model.GUST, 0.0, 0.0)
            )
        )
        if here.air == model.HELD and here.way == model.ON:
            alike, shift = near(g, model.GUST, 0.0, model.SHIFT_M)
            weather = handed_over(shift, model.WEATHER, model.GUST, 0.0)
            found.append(here._replace(air=model.CALM, share=within(model.GUST_SHIFTS, dt) * alike, gaussian=weather))
        return found

    def _departures(self, here: Successor, dt: float) -> list[Successor]:
        """From level ground to stairs and lifts, at the speed of a stop."""
        often = model.FREE_RATES if self.free else 1.0
        found = []
        for ways, rate, sd in (
            (STAIRS, model.CLIMB_BEGINS, model.CLIMB_STOPS_M_S),
            (LIFTS, model.RIDE_BEGINS, model.RIDE_STOPS_M_S),
        ):
            slow = set_to(here.gaussian, model.RATE, 0.0, sd)
            found += [here._replace(way=way, share=within(often * rate, dt), gaussian=slow) for way in ways]
        return found

    def _arrivals(self, here: Successor, dt: float) -> list[Successor]:
        """From stairs and lifts to a level that is near, at a speed near zero; on stairs the direction may turn."""
        g, stairs = here.gaussian, here.way in STAIRS
        ends = within(model.CLIMB_ENDS if stairs else model.RIDE_ENDS, dt)
        slow, stopped = near(g, model.RATE, 0.0, model.CLIMB_STOPS_M_S if stairs else model.RIDE_STOPS_M_S)
        found = []
        for level, height in enumerate(self.heights_m.tolist()):
            share, arrived = ends * slow, stopped
            if not self.free:
                width = math.hypot(model.LEVEL_SD_M, model.SCALE * (height - self.heights_m[here.level]))
                if abs(g.mean[model.HEIGHT] - height) > 5.0 * math.sqrt(g.cov[model.HEIGHT, model.HEIGHT] + width**2):
                    continue
                close, arrived = near(stopped, model.HEIGHT, height, width)
                share, arrived = share * close, handed_over(arrived, model.WEATHER, model.HEIGHT, height)
            found.append(Successor(level, here.air, model.ON, share, set_to(arrived, model.RATE, 0.0, 0.0)))
        if stairs:
            other = model.STAIRS_DOWN if here.way == model.STAIRS_UP else model.STAIRS_UP
            found.append(here._replace(way=other, share=within(model.CLIMB_TURNS, dt)))
        return found

    def _gap(self, s: int, dt: float) -> list[Successor]:
        """After a gap: the same level, any level, or stairs and lifts; the weather has gone on, the building's pressure shifted or not."""
        level, way, before = s // model.MODES, s % model.WAYS, self.gaussians[s]
        rests = math.exp(-2.0 * (model.CLIMB_BEGINS + model.RIDE_BEGINS) * dt)
        stays = max(model.RESTS, rests) if way == model.ON else 0.0
        trend = model.WEATHER_M**2 * dt + (model.TREND_M_S * dt) ** 2
        rested = set_to(set_to(wider(before, model.WEATHER, trend), model.RATE, 0.0, 0.0), model.GUST, 0.0, 0.0)
        shifts = within(model.SHIFTS + 0.5 * model.GUST_BEGINS, dt)
        found = []
        for probability, air in ((1.0 - shifts, rested), (shifts, wider(rested, model.WEATHER, model.SHIFT_M**2))):
            for target, share, ground in self._grounds(level, stays, air):
                found.append(Successor(target, model.CALM, model.ON, probability * share, ground))
        low, high = self.heights_m[0], self.heights_m[-1]
        middle, wide = 0.5 * (low + high), 0.5 * (high - low) + model.LEVEL_SD_M
        if self.free:
            middle, wide = before.mean[model.HEIGHT], model.WANDERED_M
        for target in (*STAIRS, *LIFTS):
            speed, sd, _ = motion(target)
            moving = set_to(set_to(rested, model.HEIGHT, middle, wide), model.RATE, speed, sd)
            found.append(Successor(level, model.CALM, target, (1.0 - stays) * model.UNDER_WAY / 4.0, moving))
        return found

    def _grounds(self, level: int, stays: float, g: Gaussian) -> list[tuple[int, float, Gaussian]]:
        """Level, share and Gaussian of each level ground after a gap; without levels: where it was, or metres away."""
        moved = (1.0 - stays) * (1.0 - model.UNDER_WAY)
        if self.free:
            return [(0, stays, g), (0, moved, wider(g, model.HEIGHT, model.WANDERED_M**2))]
        count = len(self.heights_m)
        return [
            (target, stays * (target == level) + moved / count, set_to(g, model.HEIGHT, height, 0.0))
            for target, height in enumerate(self.heights_m.tolist())
        ]
