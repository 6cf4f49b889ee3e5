# SPDX-License-Identifier: MIT
"""Evaluation of the wearer's alarm: delay for an incapacitated wearer, and rate of false alarms.

In: seeds; public recordings of feet and legs where they are at hand. Out: rows. The samples of foot and leg sensors are simulated; windows and alarm
are the tracker's own; the network is not part of it. How often people who wait or crouch move a foot is assumed (`PAUSES_S`), not measured: the
rate of maydays in a working day is one of that assumption, and of how often the question is answered.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.legs.trunk_path import GyroBlock
from echostep.odometry import AlarmKind
from echostep_app.wearer.alarm import WearerAlarm
from echostep_app.wearer.stillness import WINDOW_S, Stillness, Window
from echostep_app.wearer.wearer_signs import StepTaken
from echostep_studies.bench.recordings.feet import SETS as FEET
from echostep_studies.bench.recordings.legs import SETS as LEGS
from echostep_studies.frame.recordings import DATA, read_sets
from echostep_studies.frame.report import Row
from echostep_studies.frame.study import Study
from echostep_studies.incapacity import fall_recordings, falls
from echostep_studies.incapacity.columns import TOLD_S, DayRun, LyingRun, RunRow, summarize, tables

RATE_HZ = 100.0
GYRO_NOISE, ACCEL_NOISE = math.radians(0.1) * 10.0, 0.04  # rad/s, m/s2: an MTx at 100 Hz, by its manual
LEG_NOISE = math.radians(0.5)  # rad/s, an ADIS16100
BREATH_HZ, BREATH_RAD_S = 0.3, math.radians(1.5)  # of a belt on a wearer who lies
# Sway of a wearer who stands or crouches, rad/s: standard deviation within half a second, each axis of the foot, thigh, shank. Medians of quiet
# standing in public recordings (Voisard's MTw on feet, legs of qmt: 15 to 25 s each), less the sensors' noise.
SWAY_RAD_S = (0.0015, 0.0015, 0.0015, 0.004, 0.006)
# Range; of the logarithm of its size, from one movement to the next; assumed; sinusoids
SWAY_HZ, SWAY_SPREAD, SWAY_TONES = ((0.3, 2.5), 0.5, 6)
# Of every second wearer who cannot move; assumed
TWITCH_PAUSE_S, TWITCH_S, TWITCH_RAD_S = (5.0, (0.1, 0.4), (0.02, 0.08))
PORTION_S = 0.25  # that comes at once
DAY_S = 8.0 * 3600.0
# Mean time between two movements of a foot; assumed
PAUSES_S = {"walk": 0.55, "crawl": 0.8, "crouch": 10.0, "wait": 15.0}
SPANS_S = {"walk": (20.0, 300.0), "crawl": (20.0, 120.0), "crouch": (30.0, 600.0), "wait": (20.0, 300.0)}
ANSWER_S, ANSWERED = (1.0, 6.0), 0.98  # how soon, and how often, the question is answered by a movement; assumed


class SimulatedWearer:
    """Samples of foot and, if `legs`, of leg gyros, through the tracker's own windows into its own alarm."""

    def __init__(self, rng: np.random.Generator, *, legs: bool) -> None:
        self.rng, self.legs, self.t_s = rng, legs, 0.0
        self.stillness, self.alarm = Stillness(), WearerAlarm()
        self._axis = self._up = np.array([0.0, 0.0, 1.0])
        self._draw_sway()

    def _draw_sway(self) -> None:
        """Amplitudes (5, k), frequencies (k,) and phases (5, k) of the sway up to the next movement."""
        self._sway_hz = self.rng.uniform(*SWAY_HZ, SWAY_TONES)
        self._phase = self.rng.uniform(0.0, math.tau, (len(SWAY_RAD_S), SWAY_TONES))
        within = 0.5 * (1.0 - np.sinc(self._sway_hz * WINDOW_S) ** 2)  # variance of a unit sinusoid in a window
        size = math.exp(SWAY_SPREAD * self.rng.standard_normal())
        self._sway_rad_s = size * np.array(SWAY_RAD_S)[:, None] / math.sqrt(within.sum())

    def live(self, seconds: float, moves_s: Sequence[float], *, lies: bool = False, twitches: bool = False) -> None:
        """Add this many seconds with movements at these times; a wearer that `lies` breathes and does not sway."""
        t_s = self.t_s + np.arange(1, round(seconds * RATE_HZ) + 1) / RATE_HZ
        moved = np.zeros(len(t_s))
        sway = np.zeros((len(SWAY_RAD_S), len(t_s)))
        if not lies:
            tones = np.sin(math.tau * self._sway_hz[:, None] * t_s + self._phase[:, :, None])
            sway = (self._sway_rad_s[:, :, None] * tones).sum(axis=1)
        elif twitches and self.rng.random() < seconds / TWITCH_PAUSE_S:
            width_s, begin_s = self.rng.uniform(*TWITCH_S), self.t_s + self.rng.uniform(0.0, seconds)
            near = (t_s > begin_s) & (t_s < begin_s + width_s)
            moved[near] += self.rng.uniform(*TWITCH_RAD_S) * np.sin(np.pi * (t_s[near] - begin_s) / width_s)
        for move_s in moves_s:
            width_s, size = self.rng.uniform(0.15, 0.5), 0.6 * math.exp(0.6 * self.rng.standard_normal())
            near = np.abs(t_s - self.t_s - move_s) < width_s
            moved[near] += size * np.sin(np.pi * (t_s[near] - self.t_s - move_s) / width_s)
        if len(moves_s):  # between movements a foot keeps its orientation
            self._axis, self._up = (v / np.linalg.norm(v) for v in self.rng.standard_normal((2, 3)))
            self._draw_sway()
        gyro = moved[:, None] * self._axis + sway[:3].T + GYRO_NOISE * self.rng.standard_normal((len(t_s), 3))
        accel = 3.0 * moved[:, None] * self._up + ACCEL_NOISE * self.rng.standard_normal((len(t_s), 3))
        windows = [window for _, window in self.stillness.add_foot(t_s, gyro, accel + 9.81 * self._up)]
        if self.legs:
            thigh, shank, belt = 0.6 * moved + LEG_NOISE * self.rng.standard_normal((3, len(t_s)))
            thigh, shank = thigh + sway[3], shank + sway[4]
            belt += BREATH_RAD_S * np.sin(2.0 * np.pi * BREATH_HZ * t_s) if lies else 0.0
            windows += self.stillness.add_legs(GyroBlock(t_s, thigh, shank, belt, np.full(len(t_s), np.nan)))
        self.t_s = float(t_s[-1])
        self.alarm.add(sorted(windows))

    def walk(self, seconds: float) -> None:
        """Walk: a step of this foot each 1.1 s."""
        self.live(seconds, np.arange(0.0, seconds, PAUSES_S["walk"]).tolist())
        for t_s in np.arange(self.t_s - seconds, self.t_s, 2.0 * PAUSES_S["walk"]).tolist():
            self.alarm.add([StepTaken(t_s)])

    @property
    def kind(self) -> AlarmKind | None:
        return self.alarm.alarm.kind if self.alarm.alarm else None


def incapacitated(seed: int) -> LyingRun:
    """Walking, crouching or standing, a fall within 2 s, then no motion but breathing; in half of the seeds twitches."""
    rng = np.random.default_rng([seed, 1])
    wearer = SimulatedWearer(rng, legs=bool(seed % 2))
    wearer.walk(rng.uniform(5.0, 40.0))
    wearer.live(rng.uniform(0.1, 15.0), [])  # stands or crouches before
    began_s, fall_s = wearer.t_s, rng.uniform(0.2, 2.0)
    wearer.live(fall_s, np.arange(0.0, fall_s, 0.1).tolist())
    while wearer.kind is not AlarmKind.MAYDAY and wearer.t_s - began_s < 60.0:
        wearer.live(PORTION_S, [], lies=True, twitches=bool(seed // 2 % 2))
    told_s = wearer.t_s - began_s if wearer.kind is AlarmKind.MAYDAY else math.inf
    return LyingRun(name="cannot move", seed=seed, told_s=told_s, told=float(told_s <= TOLD_S))


def work_day(pauses: float, answered: float, legs: bool, name: str, seed: int) -> DayRun:
    """Eight hours of walking, crawling, crouching and waiting; movements `pauses` times as seldom as assumed. `legs`: with leg gyros."""
    rng = np.random.default_rng([seed, 2])
    wearer = SimulatedWearer(rng, legs=legs)
    asked = maydays = 0
    while wearer.t_s < DAY_S:
        activity = str(rng.choice(list(SPANS_S)))
        end_s = wearer.t_s + rng.uniform(*SPANS_S[activity])
        if activity == "walk":
            wearer.walk(end_s - wearer.t_s)
        next_s = wearer.t_s
        while wearer.t_s < end_s:
            next_s += rng.exponential(PAUSES_S[activity] * (pauses if activity in ("crouch", "wait") else 1.0))
            answers = False
            while wearer.t_s < min(next_s, end_s):
                before = wearer.kind
                wearer.live(min(1.0, max(min(next_s, end_s) - wearer.t_s, 0.05)), [])
                if wearer.kind is AlarmKind.ASKING and before is None:
                    asked += 1
                    answers = rng.random() < answered
                    next_s = min(next_s, wearer.t_s + rng.uniform(*ANSWER_S)) if answers else next_s
                if wearer.kind is AlarmKind.MAYDAY and before is not AlarmKind.MAYDAY:
                    maydays += 1
                    wearer.alarm.answer(wearer.t_s, ends_help=True)
            wearer.live(0.6, [0.3])
    hours = wearer.t_s / 3600.0
    return DayRun(name=name, seed=seed, hours=hours, asked=asked, maydays=maydays)


def recorded(folder: Path) -> list[DayRun]:
    """Every recording of feet and legs: how often the alarm asked and called. They are walks, not work: half an hour in all."""
    rows: list[DayRun] = []
    for foot in read_sets(folder, FEET)[0]:
        windows = Stillness().add_foot(np.asarray(foot.t_s, np.float64), foot.gyro, foot.accel)
        rows.append(_of_recording("recorded feet", [window for _, window in windows], foot.t_s))
    for leg in read_sets(folder, LEGS)[0]:
        thigh, shank = (np.linalg.norm(rate, axis=1) for rate in (leg.thigh, leg.shank))
        block = GyroBlock(leg.t_s, thigh, shank, leg.belt, np.full(len(leg.t_s), np.nan))
        rows.append(_of_recording("recorded legs", Stillness().add_legs(block), leg.t_s))
    return rows


def _of_recording(name: str, windows: Sequence[Window], t_s: Floats) -> DayRun:
    alarm = WearerAlarm()
    alarm.add([StepTaken(float(k)) for k in range(3)])  # on from the first sample, also before the walk
    alarm.add(windows)
    kinds = [change.kind for _, change in alarm.changes if change]
    asked, maydays = kinds.count(AlarmKind.ASKING), kinds.count(AlarmKind.MAYDAY)
    return DayRun(name=name, seed=0, hours=float(t_s[-1] - t_s[0]) / 3600.0, asked=asked, maydays=maydays)


DAYS: dict[str, Callable[[int], DayRun]] = {
    name: partial(work_day, pauses, answered, legs, name)
    for name, pauses, answered, legs in (
        ("day, each question answered", 1.0, 1.0, True),
        (f"day, {100.0 * ANSWERED:.0f} % answered", 1.0, ANSWERED, True),
        ("the same, movements half as often", 2.0, ANSWERED, True),
        ("day, no question heard", 1.0, 0.0, True),
        (f"foot alone, {100.0 * ANSWERED:.0f} % answered", 1.0, ANSWERED, False),
    )
}


def one_run(days: int, data: Path, first: int, seed: int) -> list[RunRow]:
    """One incapacitated wearer, one fall and one other sudden movement; the first `days` seeds add a working day, the first one the recordings."""
    rows: list[RunRow] = [incapacitated(seed), falls.fallen(seed), falls.not_fallen(seed)]
    if seed - first < days:
        rows += [day(seed) for day in DAYS.values()]
    if seed == first and data.is_dir():
        rows += [*recorded(data), *fall_recordings.recorded(data)]
    return rows


def incapacity_study(days: int, data: Path | None, first: int) -> Study[RunRow, Row]:
    """`runs` of a request: wearers who cannot move; `first`: its seed; `data`: folder of the public recordings; None: DATA."""
    kinds = (LyingRun, DayRun, falls.FallRun, falls.NoFallRun)
    return Study(
        "incapacity",
        kinds,
        partial(one_run, days, data or DATA, first),
        summarize,
        tables,
        parquet=None,
    )
