"""The tracker: bytes in, estimates out. The one place where the stages meet.

In: chunks in order of arrival. Out: estimates. Owns the random generator and one of each stage. Live, replay and simulation all come through
`Tracker.feed`; nothing in here looks at a wall clock, so equal chunks give equal estimates, bit for bit.
"""

from __future__ import annotations

import heapq
import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from echostep.alignment import Alignment
from echostep.calibration import Echo, echo
from echostep.errors import EchostepError
from echostep.estimate import Estimate, estimate, unwatched
from echostep.foot import Foot, Step
from echostep.frames import BoardReader
from echostep.gait import Leg, TrunkPath
from echostep.likelihoods import echo_model
from echostep.messages import Identity, Message, Ping, Status, Sync
from echostep.particles import Cloud, systematic
from echostep.plan import Plan, Pose
from echostep.settings import Settings
from echostep.sources import BOARD, MTX, Chunk
from echostep.timeline import Timeline
from echostep.walls import build_index
from echostep.xsens import MtSample, MtxReader

PING_AGE_S = 0.1  # a ping is reported this long after its trigger at most
BLIND_S = 1.0
EXPLAINED_SHARE = 0.1
UNEXPLAINED = -1.5  # a tracked walk has +1, an echo that fits nowhere -5: the plan does not explain what is heard
LOST_SD_M = 3.0
REGAIN_M = 10.0
SILENCE_S = 0.5  # a port that is this far behind the other one is not waited for
PORTION_S = 0.0095  # the foot is fed a hundred times a second
MAX_WAITING = 4096  # pings and legs; beyond it the oldest are given up and counted
RANGER_AXES_RAD = (0.5 * math.pi, -0.5 * math.pi)


@dataclass(slots=True)
class TrackerCounts:
    """What did not reach the cloud, and why."""

    unknown_ports: int = 0
    late_pings: int = 0
    dropped_pings: int = 0
    bad_times: int = 0


class Tracker:
    """Feed it every chunk; it returns the estimates that the chunk completes."""

    def __init__(self, plan: Plan, start: Pose | None = None, settings: Settings | None = None, seed: int = 0) -> None:
        """`start`: where the trunk stands and looks at the beginning; the plan's own start when None."""
        pose = start or plan.start
        if pose is None:
            raise EchostepError("the plan has no start: give one with --start X,Y,DEG")
        self.settings = settings or Settings()
        self.plan = plan
        self.start = pose
        self.board = BoardReader()
        self.mtx = MtxReader()
        self.timeline = Timeline(self.settings.mtx)
        self.foot = Foot(self.settings.foot)
        self.alignment = Alignment()
        self.path = TrunkPath(self.settings.gait)
        self.walls = build_index(plan.levels[0].walls)
        self.cloud: Cloud | None = None
        self.counts = TrackerCounts()
        self.status: Status | None = None
        self.identity: Identity | None = None
        self._rng = np.random.default_rng(seed)
        self._model = echo_model(self.settings.echo)
        self._samples: list[tuple[float, MtSample]] = []  # not yet fed to the foot
        self._walked_s = -math.inf
        self._pings: list[tuple[float, int, Echo]] = []  # heap, by time
        self._pushed = 0
        self._legs: deque[Leg] = deque()
        self._t_s = 0.0  # the cloud's time
        self.explained = 0.0  # mean log-probability of the last echoes under the cloud
        self._last: Estimate | None = None
        self._doubt_m = 0.0  # a cloud that was scattered may gather in the wrong place: trust returns as he walks
        self._told_s = -math.inf
        self._share = 0.0  # of the first leg that the cloud has gone
        self._echo_xy: list[tuple[float, float] | None] = [None, None]
        self._xy = (0.0, 0.0)  # walk frame, of the cloud's time

    def feed(self, chunk: Chunk) -> list[Estimate]:
        """Take one chunk; estimates come at the middle of each stance, and twice a second while standing."""
        if chunk.port == BOARD:
            for message in self.board.feed(chunk.data):
                self._on_board(message, chunk.t_arrival_ns)
        elif chunk.port == MTX:
            self._on_mtx(chunk)
        else:
            self.counts.unknown_ports += 1
        return self._advance()

    def warm_up(self) -> None:
        """Compile the kernels (seconds, the first time on a machine), so that nothing waits for it later; leaves the tracker as it was."""
        still = np.tile([0.0, 0.0, 9.81], (3, 1))
        Foot(self.settings.foot).feed(np.array([0.0, 0.01, 0.02]), still, np.zeros((3, 3)))
        cloud = Cloud(self.settings.cloud, self.start, 0.0, np.random.default_rng(0))
        cloud.move(0.01, 0.0, 0.01, 0.0, self.walls)
        cloud.weigh(0.0, 1.0, 0.1, self._model, self.walls)
        systematic(np.ones(2), 0.5, 2)

    # bytes -> samples

    def _on_board(self, message: Message, t_arrival_ns: int) -> None:
        ticks: int | None = getattr(message, "ticks", None)
        if ticks is None:
            return
        t_s = self.timeline.board_time(ticks, t_arrival_ns, restarted=isinstance(message, Identity))
        if t_s is None:
            self.counts.bad_times += 1
        elif isinstance(message, Ping):
            self._on_ping(message, t_s)
        elif isinstance(message, Sync):
            self.timeline.sync_edge(message.edge, t_s)
        elif isinstance(message, Status):
            self.status = message
        elif isinstance(message, Identity):
            self.identity = message

    def _on_ping(self, message: Ping, t_s: float) -> None:
        heard = echo(message, t_s, self.settings.ranger)
        if heard is None:
            return
        if t_s < self._t_s:
            self.counts.late_pings += 1
            return
        heapq.heappush(self._pings, (t_s, self._pushed, heard))
        self._pushed += 1
        if len(self._pings) > MAX_WAITING:
            heapq.heappop(self._pings)
            self.counts.dropped_pings += 1

    def _on_mtx(self, chunk: Chunk) -> None:
        for sample in self.mtx.feed(chunk.data):
            t_s = self.timeline.mtx_time(sample.counter, chunk.t_arrival_ns)
            if t_s is None:
                self.counts.bad_times += 1
            else:
                self._samples.append((t_s, sample))
        if self._samples and self._samples[-1][0] - self._walked_s >= PORTION_S:
            self._walked_s = self._samples[-1][0]
            self._walk(self._samples)
            self._samples = []

    # samples -> legs

    def _walk(self, samples: list[tuple[float, MtSample]]) -> None:
        t_s = np.array([t for t, _ in samples])
        accel = np.array([s.accel for _, s in samples])
        gyro = np.array([s.gyro for _, s in samples])
        for event in self.alignment.feed(self.foot.feed(t_s, accel, gyro), samples[-1][0]):
            self._legs += self.path.step(event) if isinstance(event, Step) else self.path.stance(event)
        if self.foot.in_stance and not self.alignment.waiting:
            self._legs += self.path.stand(samples[-1][0], self.foot.heading_rad)
        if self.cloud is None and self.path.heading_rad is not None:
            self.cloud = Cloud(self.settings.cloud, self.start, self.path.heading_rad, self._rng)

    # legs and echoes -> cloud

    def _advance(self) -> list[Estimate]:
        """Move the cloud as far as both the path and the pings are complete."""
        estimates: list[Estimate] = []
        complete_s = self._watermark_s()
        while self._legs and self.cloud is not None:
            leg = self._legs[0]
            until_s = min(leg.t1_s, complete_s)
            while self._pings and self._pings[0][0] <= until_s:
                heard = heapq.heappop(self._pings)[2]
                if not leg.unwatched:
                    self._hear(self.cloud, leg, heard)
            if leg.t1_s > complete_s:
                break
            self._go(self.cloud, leg, leg.t1_s)
            self._legs.popleft()
            self._share = 0.0
            self._last = estimate(self.cloud, leg.t1_s, leg.heading1_rad, leg.step, self._doubt_m)
            estimates.append(self._last)
        return estimates + self._unwatched()

    def _watermark_s(self) -> float:
        """Up to this time every ping has come, by the time of the samples themselves."""
        board = self.timeline.board_newest_s
        mtx = self.timeline.mtx_newest_s
        by_board = -math.inf if board is None else board - PING_AGE_S
        by_mtx = -math.inf if mtx is None else mtx - SILENCE_S
        return max(by_board, by_mtx)

    def _unwatched(self) -> list[Estimate]:
        """Once a second while the foot is silent and the board speaks: nobody knows where he goes."""
        board, mtx = self.timeline.board_newest_s, self.timeline.mtx_newest_s
        if self._last is None or board is None or mtx is None or board - max(mtx, self._told_s) < BLIND_S:
            return []
        self._told_s = board
        return [unwatched(self._last, board)]

    def _go(self, cloud: Cloud, leg: Leg, t_s: float) -> None:
        """Propagate along a leg up to a time; the leg's variance is spent evenly over it."""
        share = (t_s - leg.t0_s) / (leg.t1_s - leg.t0_s) if leg.t1_s > leg.t0_s else 1.0
        part = min(max(share, self._share), 1.0) - self._share
        self._share += part
        self._t_s = max(self._t_s, t_s)
        dx, dy = part * leg.dx_m, part * leg.dy_m
        if leg.unwatched:
            self._t_s = leg.t1_s
            cloud.scatter(leg.dx_m, leg.dy_m, leg.sd_m, leg.turn_sd_rad)
            self._doubt_m = math.hypot(self._doubt_m, leg.sd_m)
        elif dx or dy:
            self._xy = (self._xy[0] + dx, self._xy[1] + dy)
            self._doubt_m *= math.exp(-math.hypot(dx, dy) / REGAIN_M)
            root = math.sqrt(part)
            cloud.move(dx, dy, leg.sd_m * root, leg.turn_sd_rad * root, self.walls)

    def _hear(self, cloud: Cloud, leg: Leg, heard: Echo) -> None:
        """Move up to the ping and weigh by it, as far as it says anything new."""
        self._go(cloud, leg, heard.t_s)
        axis = leg.heading_rad(heard.t_s) + RANGER_AXES_RAD[heard.ranger]
        power = self._news(heard.ranger)
        if power > 0.0:
            explained = cloud.weigh(axis, heard.range_m, power, self._model, self.walls)
            self.explained += power * EXPLAINED_SHARE * (explained - self.explained)
            if self.explained < UNEXPLAINED:
                self._doubt_m = max(self._doubt_m, LOST_SD_M)

    def _news(self, ranger: int) -> float:
        """Share of independent information in this ranger's next echo: errors are correlated over some travel."""
        last, self._echo_xy[ranger] = self._echo_xy[ranger], self._xy
        if last is None:
            return 1.0
        travel = math.hypot(self._xy[0] - last[0], self._xy[1] - last[1])
        return min(travel / self.settings.echo.correlation_m, 1.0)
