"""One guided return: the event-based simulator of [Fischer 2008, 4.2] around the paper's fusion and ours.

In: a `BeaconGround`, a person, a system. Out: where the person was and where the system believed him to be, every two seconds, and whether he got
out. Owns nothing. Events: inertial every 10 ms, ultrasound every 200 ms, guidance every 2 s. Everything here is simulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.jit import kernel
from echostep.localization.beacon_beliefs import (
    BeaconBeliefs,
    BeaconMeasurement,
    empty_beliefs,
    resample_beliefs,
    set_beliefs,
)
from echostep.localization.beacon_model import BeaconModel, BeaconSettings, beacon_model
from echostep.localization.beacon_slam import (
    BeaconHealth,
    initial_health,
    propose_heading_jumps,
    update_by_measurement,
)
from echostep.localization.particle_kernels import Move, ParticleArrays, propagate_without_walls, systematic
from echostep.plan.polyline import along, nearest, way_m
from echostep.simulation.world.beacon_ground import BeaconGround, disturbance, is_in_reach, measure
from echostep.walls.echo_sources import Walls
from echostep.walls.index import WallIndex

PDR, PAPER, OURS = 0, 1, 2
TICK_S = 0.01
GUIDANCE_TICKS = 200
SPEED_M_S = 1.0
AHEAD_M = 3.0  # "a few metres ahead along the path"
NEAR_END_M = 3.0  # "within a short distance of the end"
ARRIVED_M = 1.0  # who believes to be so near the end stops
TIME_FACTOR = 2.5  # "under a certain delay": times the trail's length at walking speed
THRESHOLD_M = 1.0
DEAF_S = 3.0  # who has not been heard for so long goes back to where he was; twice as long when he is there again
SAFE_S = 15.0  # who has been heard for so long is sent back early again
PARTICLES = 100
MORE_PARTICLES = 300  # where the map is learnt or known badly, or somebody is seldom heard
SELDOM_S = 2.0
DROPPED_BEFORE_M = 0.3  # a beacon lies when he has come so near to its place


@dataclass(frozen=True, slots=True)
class ObedientPerson:
    """How well somebody obeys: seconds until he does, error of the direction he takes, share of cues after which he turns wrong."""

    delay_s: float = 0.0
    heading_sd_deg: float = 0.0
    wrong_turns: float = 0.0


OBEDIENT = ObedientPerson()
IRON = BeaconSettings(kick_per_m=0.3, tries_per_m=0.5)  # for a heading that a compass leads, as the paper's
MAPPING = replace(IRON, kick_per_m=0.1)  # a map that is learnt is bent by every jump that is believed


class Return(NamedTuple):
    """`truth`, `believed` (n, 2): every two seconds; `end_m`: from the exit at the end; `arrived`: he was near it in time."""

    truth: Floats
    believed: Floats
    end_m: float
    arrived: bool


class _Rules(NamedTuple):
    system: int
    ultrasound_ticks: int
    threshold_m: float
    delay_ticks: int
    heading_sd_rad: float
    wrong_turns: float
    deployed: bool
    step_sd: float
    deaf_s: float


class _Cloud(NamedTuple):
    x: Floats
    y: Floats
    turn: Floats
    scale: Floats
    log_weight: Floats
    beliefs: BeaconBeliefs
    health: BeaconHealth


class _Walker(Protocol):
    x: float  # where he is
    y: float
    heading: float
    error: float  # of the measured heading
    walk_x: float  # where dead reckoning has him, from the turn on
    walk_y: float
    piece_x: float  # of that way, since the last ultrasound
    piece_y: float
    heard_x: float  # on that way, where he was last heard
    heard_y: float
    heard_tick: float
    silent_tick: float  # when he was last out of range, or the walk began
    leash_s: float  # how long he may now be out of range before he is sent back
    back: float  # 1: he has been sent back since he was last heard
    believed_x: float
    believed_y: float
    offset: float  # that the paper's fusion adds to the measured heading
    reliable_x: float  # the last reliable place
    reliable_y: float
    confirmed: float  # 1: ultrasound has confirmed or corrected the place since the last guidance
    wanted: float  # turn that he was told to make
    wanted_tick: float  # when he will make it


_WALKER = np.dtype([(name, "f8") for name in _Walker.__annotations__])


def guided_return(
    world: BeaconGround, system: int, seed: int, period_s: float = 0.2, person: ObedientPerson = OBEDIENT, *, deployed: bool = False,
    place_sd_m: float = 0.0, axis_sd_rad: float = 0.0, particles: int | None = None, settings: BeaconSettings | None = None,
    threshold_m: float = THRESHOLD_M,
) -> Return:  # fmt: skip
    """Guide one person back along the trail; equal seeds, equal returns.

    `period_s`: between ultrasound measurements. `deployed`: nothing is known of the beacons but what was heard on the way in, which is simulated too;
    else `world.believed` is known within `place_sd_m` and `axis_sd_rad`.
    """
    settings = settings or (MAPPING if deployed else IRON)
    particles = particles or (MORE_PARTICLES if deployed or place_sd_m > 0.0 or period_s >= SELDOM_S else PARTICLES)
    rules = _Rules(
        system, max(round(period_s / TICK_S), 1), threshold_m, round(person.delay_s / TICK_S), math.radians(person.heading_sd_deg),
        person.wrong_turns, deployed, settings.step_sd, max(DEAF_S, 1.5 * period_s),
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    count = len(world.beacons)
    size = particles if system == OURS else 1
    cloud = _Cloud(
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
        np.ones(size),
        np.zeros(size),
        empty_beliefs(size, count),
        initial_health(count),
    )
    if not deployed:
        for k in range(count):
            x, y, axis = world.believed[k].tolist()
            set_beliefs(cloud.beliefs, k, x, y, axis, place_sd_m**2, axis_sd_rad**2)
        cloud.health.known[:] = True
    model = beacon_model(settings)
    walker = np.zeros(1, _WALKER)
    if deployed:
        going_in = world._replace(beacons=world.dropped, works=np.zeros(count, np.bool_))
        walker["error"] = _way_in(going_in, rules, cloud, model, _OPEN, rng)
    longest = int(TIME_FACTOR * way_m(world.trail) / SPEED_M_S / (GUIDANCE_TICKS * TICK_S)) + 2
    truth, believed = np.zeros((longest, 2)), np.zeros((longest, 2))
    n, end_m, arrived = _return(world, rules, cloud, model, _OPEN, rng, walker[0], truth, believed)
    return Return(truth[:n], believed[:n], end_m, arrived)


_OPEN = Walls(np.zeros((0, 4))).near(np.zeros(1), np.zeros(1), 0.0)


@kernel
def _return(
    world: BeaconGround, rules: _Rules, cloud: _Cloud, model: BeaconModel, walls: WallIndex, rng: np.random.Generator, w: _Walker,
    truth: Floats, believed: Floats,
) -> tuple[int, float, bool]:  # fmt: skip
    """The loop of events; fills truth and belief at each guidance, returns how many, distance from the exit, and success."""
    trail = world.trail
    w.x, w.y, w.heading = along(trail, 0.0)
    w.believed_x, w.believed_y, w.reliable_x, w.reliable_y = w.x, w.y, w.x, w.y
    w.leash_s = rules.deaf_s
    if not rules.deployed:
        _start(cloud, w.x, w.y, rng)
    inside = np.zeros(len(world.sources), np.bool_)
    heard_ticks = np.full(len(world.beacons), -np.inf)
    arrived, n, tick, end_m = False, 0, 0, np.inf
    while n < len(truth):
        if tick % rules.ultrasound_ticks == 0:
            if rules.system == OURS:
                _listen(world, rules, cloud, model, walls, rng, w, tick, heard_ticks)
            elif rules.system == PAPER:
                _correct(world, rules, rng, w)
        if tick % GUIDANCE_TICKS == 0:
            stop = _guide(world, rules, cloud, rng, w, tick, heard_ticks)
            truth[n], believed[n] = (w.x, w.y), (w.believed_x, w.believed_y)
            n += 1
            if stop:
                break
        if tick == w.wanted_tick:
            w.heading += w.wanted
        tick += 1
        _walk(world, w, inside)
        end_m = math.hypot(w.x - trail[-1, 0], w.y - trail[-1, 1])
        arrived = arrived or end_m < NEAR_END_M
    return n, end_m, arrived


@kernel
def _walk(world: BeaconGround, w: _Walker, inside: Bools) -> None:
    """One inertial event: he moves, and dead reckoning with him, as far as its heading is right."""
    step = SPEED_M_S * TICK_S
    w.x += step * math.cos(w.heading)
    w.y += step * math.sin(w.heading)
    w.error += disturbance(world.sources, inside, w.x, w.y, w.heading)
    x, y = step * math.cos(w.heading + w.error), step * math.sin(w.heading + w.error)
    w.walk_x, w.walk_y = w.walk_x + x, w.walk_y + y
    w.piece_x, w.piece_y = w.piece_x + x, w.piece_y + y
    c, s = math.cos(w.offset), math.sin(w.offset)
    w.believed_x, w.believed_y = w.believed_x + c * x - s * y, w.believed_y + s * x + c * y


@kernel
def _listen(
    world: BeaconGround, rules: _Rules, cloud: _Cloud, model: BeaconModel, walls: WallIndex, rng: np.random.Generator, w: _Walker, tick: int,
    heard_ticks: Floats,
) -> None:  # fmt: skip
    """One ultrasound event for our cloud."""
    _advance(cloud, rules, model, w.piece_x, w.piece_y, rng)
    w.piece_x, w.piece_y = 0.0, 0.0
    heard = False
    for k in range(len(world.beacons)):
        if is_in_reach(world, k, w.x, w.y):
            heard, heard_ticks[k] = True, tick
            range_m, bearing = measure(world, k, w.x, w.y, rng)
            _hear(cloud, k, range_m, bearing, model, walls, rng)
    if not heard:
        w.silent_tick = tick
        return
    w.heard_tick, w.heard_x, w.heard_y = tick, w.walk_x, w.walk_y
    if w.back:
        w.leash_s, w.back = 2.0 * w.leash_s, 0.0
    elif (tick - w.silent_tick) * TICK_S > SAFE_S:
        w.leash_s = rules.deaf_s


@kernel
def _correct(world: BeaconGround, rules: _Rules, rng: np.random.Generator, w: _Walker) -> None:
    """One ultrasound event for the paper's fusion, which takes the nearest beacon's word."""
    closest, closest_m, closest_bearing = -1, np.inf, 0.0
    for k in range(len(world.beacons)):
        if is_in_reach(world, k, w.x, w.y):
            range_m, bearing = measure(world, k, w.x, w.y, rng)
            if range_m < closest_m:
                closest, closest_m, closest_bearing = k, range_m, bearing
    if closest >= 0:
        fuse(w, world.believed[closest], closest_m, closest_bearing, rules.threshold_m)


@kernel
def _guide(
    world: BeaconGround, rules: _Rules, cloud: _Cloud, rng: np.random.Generator, w: _Walker, tick: int, heard_ticks: Floats
) -> bool:  # fmt: skip
    """One guidance event [Fischer 2008, Figure 8]; whether the system believes that he has arrived."""
    if rules.system == OURS:
        w.believed_x, w.believed_y, _ = _mean(cloud)
        w.wanted, rest_m = _homeward(
            cloud, world.trail, rules.deployed, w.heading + w.error, heard_ticks >= tick - rules.deaf_s / TICK_S
        )
        if (tick - w.heard_tick) * TICK_S > w.leash_s:
            w.wanted = math.atan2(w.heard_y - w.walk_y, w.heard_x - w.walk_x) - (w.heading + w.error)
            w.back = 1.0
    else:
        if w.confirmed:
            w.reliable_x, w.reliable_y, w.confirmed = w.believed_x, w.believed_y, 0.0
        way, rest_m = _ahead(world.trail, w.believed_x, w.believed_y, 0.0, np.inf)
        w.wanted = way - (w.heading + w.error + w.offset)
    w.wanted += rules.heading_sd_rad * rng.standard_normal()
    if rng.random() < rules.wrong_turns:
        w.wanted += 0.5 * math.pi if rng.random() < 0.5 else -0.5 * math.pi
    w.wanted_tick = tick + rules.delay_ticks
    return rest_m < ARRIVED_M and (rules.system != OURS or (tick - w.heard_tick) * TICK_S < rules.deaf_s)


@kernel
def _ahead(path: Floats, x: float, y: float, from_m: float, to_m: float) -> tuple[float, float]:
    """Direction of the target on a path, and the distance of its end, from (x, y), which is between `from_m`

    and `to_m` along it [Fischer 2008, Figure 8].
    """
    s, _ = nearest(path, x, y, from_m, to_m)
    to_x, to_y, _ = along(path, s + AHEAD_M)
    return math.atan2(to_y - y, to_x - x), math.hypot(x - path[-1, 0], y - path[-1, 1])


@kernel
def _homeward(cloud: _Cloud, trail: Floats, deployed: bool, heading: float, heard: Bools) -> tuple[float, float]:
    """The turn to be made, and the distance of the exit: the cloud's means of what each particle says, whose maps may differ by more than places."""
    total, east, north, rest = 0.0, 0.0, 0.0, 0.0
    path, from_m, to_m = trail, 0.0, np.inf
    for i in range(len(cloud.x)):
        w = math.exp(cloud.log_weight[i])
        if deployed:
            path, from_m, to_m = _crumbs(cloud, i, trail[-1, 0], trail[-1, 1], heard)
        way, rest_m = _ahead(path, cloud.x[i], cloud.y[i], from_m, to_m)
        way -= heading + cloud.turn[i]
        total += w
        east += w * math.cos(way)
        north += w * math.sin(way)
        rest += w * rest_m
    return math.atan2(north, east), rest / total


@kernel
def fuse(w: _Walker, beacon: Floats, range_m: float, bearing: float, threshold_m: float) -> None:
    """The paper's fusion of one measurement by a beacon (x, y, axis) [Fischer 2008, 4.1.1].

    Beyond the threshold the place is taken from the ultrasound, and the heading is turned by the angle between the wrong place, the last reliable
    one and the new one. The paper does not say which place was reliable: here, the one that the last guidance rested on, if ultrasound had a
    say in it. With the place of 200 ms before, the angle would be noise, and nobody would come out.
    """
    x = beacon[0] + range_m * math.cos(beacon[2] + bearing)
    y = beacon[1] + range_m * math.sin(beacon[2] + bearing)
    w.confirmed = 1.0
    if math.hypot(x - w.believed_x, y - w.believed_y) <= threshold_m:
        return
    if w.believed_x != w.reliable_x or w.believed_y != w.reliable_y:
        was = math.atan2(w.believed_y - w.reliable_y, w.believed_x - w.reliable_x)
        w.offset += math.atan2(y - w.reliable_y, x - w.reliable_x) - was
    w.believed_x, w.believed_y = x, y


@kernel
def _start(cloud: _Cloud, x: float, y: float, rng: np.random.Generator) -> None:
    """He stands at a known place and looks in a known direction."""
    cloud.x[:], cloud.y[:] = x + 0.15 * _normals(rng, len(cloud.x)), y + 0.15 * _normals(rng, len(cloud.x))
    cloud.turn[:] = math.radians(5.0) * _normals(rng, len(cloud.x))


@kernel
def _normals(rng: np.random.Generator, n: int) -> Floats:
    out = np.empty(n)
    for i in range(n):
        out[i] = rng.standard_normal()
    return out


@kernel
def _particles(cloud: _Cloud) -> ParticleArrays:
    """The cloud's arrays in the form that the filter's kernels take."""
    return ParticleArrays(cloud.x, cloud.y, cloud.turn, cloud.scale, cloud.log_weight)


@kernel
def _hear(
    cloud: _Cloud, k: int, range_m: float, bearing: float, model: BeaconModel, walls: WallIndex, rng: np.random.Generator
) -> None:  # fmt: skip
    """One measurement into the cloud, which is resampled when too few particles carry the weight."""
    measurement = BeaconMeasurement(k, range_m, bearing)
    size = update_by_measurement(_particles(cloud), cloud.beliefs, cloud.health, measurement, model, walls, rng)
    if size >= 0.5 * len(cloud.x):
        return
    chosen = systematic(np.exp(cloud.log_weight), rng.random(), len(cloud.x))
    cloud.x[:], cloud.y[:] = cloud.x[chosen], cloud.y[chosen]
    cloud.turn[:], cloud.scale[:] = cloud.turn[chosen], cloud.scale[chosen]
    cloud.log_weight[:] = 0.0
    resample_beliefs(cloud.beliefs, chosen)


@kernel
def _way_in(
    world: BeaconGround, rules: _Rules, cloud: _Cloud, model: BeaconModel, walls: WallIndex, rng: np.random.Generator
) -> float:
    """Walk in from the exit, dropping beacons, which are learnt on the way; `world.works` says which lie already.

    Returns the error of the measured heading at the deepest point.
    """
    way = world.trail[::-1].copy()
    total = 0.0
    for k in range(len(way) - 1):
        total += math.hypot(way[k + 1, 0] - way[k, 0], way[k + 1, 1] - way[k, 1])
    inside = np.zeros(len(world.sources), np.bool_)
    count, step = len(world.beacons), SPEED_M_S * TICK_S
    _start(cloud, way[0, 0], way[0, 1], rng)
    error, dx, dy = 0.0, 0.0, 0.0
    for tick in range(int(total / step)):
        x, y, heading = along(way, tick * step)
        if tick % rules.ultrasound_ticks == 0:
            _advance(cloud, rules, model, dx, dy, rng)
            dx, dy = 0.0, 0.0
            for k in range(count - 1, -1, -1):
                world.works[k] = (count - 1 - k) * total <= (tick * step + DROPPED_BEFORE_M) * (count - 1)
                if is_in_reach(world, k, x, y):
                    range_m, bearing = measure(world, k, x, y, rng)
                    _hear(cloud, k, range_m, bearing, model, walls, rng)
        error += disturbance(world.sources, inside, x, y, heading)
        dx, dy = dx + step * math.cos(heading + error), dy + step * math.sin(heading + error)
    return error


@kernel
def _crumbs(cloud: _Cloud, i: int, exit_x: float, exit_y: float, heard: Bools) -> tuple[Floats, float, float]:
    """The way back as a particle believes it, from beacon to beacon to the exit, and between which lengths along it (m) he must be.

    He is within one beacon of those that he is_in_reach (b,): a bent map may come by again, but there other beacons are heard.
    """
    count = len(heard)
    path = np.empty((count + 1, 2))
    path[:count] = cloud.beliefs.mean[i, :, :2]
    path[count] = exit_x, exit_y
    for k in range(count - 1, -1, -1):
        if not cloud.health.known[k]:
            path[k] = path[k + 1]
    from_m, to_m, length_m = 0.0, np.inf, 0.0
    before, found = 0.0, False
    for k in range(count):
        if heard[k] and not found:
            from_m, found = before, True
        before = length_m
        length_m += math.hypot(path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1])
        if heard[k]:
            to_m = length_m
    return path, from_m, to_m


@kernel
def _advance(cloud: _Cloud, rules: _Rules, model: BeaconModel, dx: float, dy: float, rng: np.random.Generator) -> None:
    """Propagate the cloud by the way since the last measurement."""
    length = math.hypot(dx, dy)
    if length > 0.0:
        root = math.sqrt(length)
        sd_m, turn_sd, scale_sd = rules.step_sd * root, math.radians(1.0) * root, 0.002 * root
        propagate_without_walls(_particles(cloud), Move(dx, dy, sd_m, turn_sd, scale_sd), rng)
        propose_heading_jumps(cloud.turn, cloud.log_weight, length, model, rng)


@kernel
def _mean(cloud: _Cloud) -> tuple[float, float, float]:
    """Weighted means of place and rotation."""
    total, x, y, east, north = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(cloud.x)):
        w = math.exp(cloud.log_weight[i])
        total += w
        x += w * cloud.x[i]
        y += w * cloud.y[i]
        east += w * math.cos(cloud.turn[i])
        north += w * math.sin(cloud.turn[i])
    return x / total, y / total, math.atan2(north, east)
