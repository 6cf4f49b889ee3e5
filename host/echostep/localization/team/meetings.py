# SPDX-License-Identifier: MIT
"""The update of a filter's clouds by meetings with other wearers.

In: a cloud with its probability, a `Meeting`. Out: the same cloud, reweighted, and how well the meeting fits it; which meetings count. Owns the model
and its constants, when each teammate was met, and the meetings that wait.

The cloud is that at the begin of a segment, the meeting happened during it, up to a stride later: `on_the_way` gives it the displacement until
then, and each particle is reweighted at its place displaced by it.

If the meeting is right, the wearer stands beside the teammate: the offset is N(0, SIDE_SD_M^2) per axis after a tap, and a radio range is N(distance,
range_sd_m^2); the teammate's own covariance is added to both. With probability `wrong` (another name was tapped, the teammate is sure of a wrong
place, the range is a reflection) the meeting carries no information: the teammate is then uniformly distributed over the floor.

The teammate's errors may be this wearer's own: both use one plan, and positions may have gone round the team in earlier meetings. The correlation is
not known, so the two are fused by covariance intersection [Julier and Uhlmann 1997, A Non-divergent Estimation Algorithm in the Presence of Unknown
Correlations], which is consistent for any: the inverse covariance becomes omega A + (1 - omega) B, A of the cloud, B of the meeting. Particles carry
the prior already, so their weights are multiplied by (meeting / prior)^(1 - omega), the prior taken as a normal distribution. omega minimises the
determinant; a cloud with more information than the meeting in every direction has omega = 1 and stays bit-identical. A coarse cloud, which is spread
over the building, has no information that could be the teammate's: there the meeting is a likelihood, and the cloud is reweighted even if it fits
badly.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from msgspec import structs

from echostep.arrays import Bools, Floats
from echostep.localization.belief import CloudHypothesis
from echostep.localization.estimate import TAIL, ellipse95
from echostep.localization.limits import HALF_STOREY_M, LOST_M, PROBABLE
from echostep.localization.particles.cloud import Cloud
from echostep.path import Odometer, PathSegment
from echostep.ports.people.check_in import MOST_SD_M, CheckIn
from echostep.ports.people.meeting import parse_meeting

# Assumed, not measured.
SIDE_SD_M = 0.6  # per axis, of the offset between two people side by side: an arm's length
MOVED_M_S = 1.0  # speed at which a teammate may have gone on since the report: a walk
WIDEST_M = 10.0  # 95 % radius of the wearer's place by a meeting, above which the meeting adds nothing to the plan
RANGE_BODY_SD_M = 0.1  # of a radio range: what bodies and antennas add
WRONG = {"tracking": 0.02, "uncertain": 0.2}  # probability that a meeting is wrong, by the teammate's status
MOST_DOUBT = math.log(WRONG["tracking"])  # of all ranges of one teammate: then this teammate is wrong
LEAST_WRONG = 1e-6  # probability that a range is wrong, at least, in a ratio
LEAST_SD_OF_CLOUD_M = 0.02  # of a cloud without spread
FARTHEST = -4.6  # log of the prior, relative to its peak, at which 99 % of a normal distribution lie inside: a far mode is no tail of it
LEAST_FACTOR = -200.0  # log of the least weight that a meeting leaves
# Path on which a wearer's own echoes, or drift, renew the filter's information
RENEWED_M = 10.0
CONTRADICTIONS = 2  # teammates who have to contradict a believed cloud: one of a team is at a wrong start, as simulated
PLACE_M = 2.0  # radio range within which the teammate's place is the wearer's, as after a tap; reflections are longer, hardly ever shorter
MOST_NAMES = 4096  # teammates and beacons that are remembered: the most of a team's beacons that a tracker keeps
MOST_WAITING = 64  # meetings that wait for their segment


@dataclass(frozen=True, slots=True)
class Meeting:
    """A meeting as the filter uses it: the fields of a `MeetingMessage`, and the displacement (walk frame) since the moment of the cloud.

    `share`: the power of its likelihood, 1 / number of meetings that rest on one measurement.
    """

    name: str
    status: str
    x_m: float
    y_m: float
    level: int
    xx_m2: float
    xy_m2: float
    yy_m2: float
    age_s: float = 0.0
    level_probability: float = 1.0
    range_m: float | None = None
    range_sd_m: float = 0.0
    beacon: int | None = None
    way_x_m: float = 0.0
    way_y_m: float = 0.0
    share: float = 1.0


TimedMeeting = tuple[float, Meeting]  # time (s) of a meeting, -inf where it is not known


def on_the_way(meeting: Meeting, segment: PathSegment, t_s: float) -> Meeting:
    """The meeting at this time with the displacement since the begin of its segment; unchanged for an unobserved segment."""
    span_s = segment.t1_s - segment.t0_s
    if segment.unobserved or span_s <= 0.0:
        return meeting
    share = min(max((t_s - segment.t0_s) / span_s, 0.0), 1.0)
    return replace(meeting, way_x_m=share * segment.dx_m, way_y_m=share * segment.dy_m)


def carries_position(meeting: Meeting) -> bool:
    """Whether the teammate's place is known: its status is not lost, its 95 % radius is below LOST_M, and the report is not too old."""
    radius_m = ellipse95(meeting.xx_m2, meeting.xy_m2, meeting.yy_m2).major_m
    (xx, xy), (_, yy) = covariance(meeting).tolist()
    return meeting.status in WRONG and radius_m <= LOST_M and ellipse95(xx, xy, yy).major_m <= WIDEST_M


def covariance(meeting: Meeting) -> Floats:
    """Covariance (2, 2) of the wearer's place given the meeting (m2): the teammate's with heavier tails, its way since the report, the offset."""
    own = np.array([[meeting.xx_m2, meeting.xy_m2], [meeting.xy_m2, meeting.yy_m2]])
    offset_m2 = (MOVED_M_S * meeting.age_s) ** 2 + (SIDE_SD_M**2 if meeting.range_m is None else 0.0)
    total: Floats = TAIL**2 * own + offset_m2 * np.eye(2)
    return total


def start_at(meeting: Meeting) -> CheckIn:
    """A start by a meeting alone: about the teammate, within the radio's range and the way until then, with any heading."""
    range_m = 0.0 if meeting.range_m is None else meeting.range_m
    way_m2 = meeting.way_x_m**2 + meeting.way_y_m**2
    sd_m = math.sqrt(0.5 * (float(np.trace(covariance(meeting))) + range_m**2 + way_m2))
    return CheckIn(meeting.x_m, meeting.y_m, None, min(max(sd_m, RANGE_BODY_SD_M), MOST_SD_M), meeting.level)


def log_density(meeting: Meeting, place: Floats, on_level: Bools, levels: int) -> Floats:
    """Log of the density (n,) of a right meeting for a wearer at `place` (n, 2): per m2 after a tap, per metre by radio."""
    away, spread = place - [meeting.x_m, meeting.y_m], covariance(meeting)
    other = (1.0 - meeting.level_probability) / max(levels - 1, 1)
    log_level = np.log(np.maximum(np.where(on_level, meeting.level_probability, other), 1e-12))
    if meeting.range_m is None:
        square = np.einsum("ni,ij,nj->n", away, np.linalg.inv(spread), away)
        log_normal = -0.5 * square - math.log(2.0 * math.pi) - 0.5 * math.log(np.linalg.det(spread))
    else:
        distance = np.hypot(away[:, 0], away[:, 1])
        variance = _range_variance(meeting, away, spread)
        log_normal = -0.5 * (meeting.range_m - distance) ** 2 / variance - 0.5 * np.log(2.0 * math.pi * variance)
    log_total: Floats = log_normal + log_level
    return log_total


def information(meeting: Meeting, mean: Floats) -> Floats:
    """Inverse covariance (2, 2) of the wearer's place by the meeting; of a radio range only along the line from the teammate to `mean` (2,)."""
    spread = covariance(meeting)
    if meeting.range_m is None:
        inverse: Floats = np.asarray(np.linalg.inv(spread), np.float64)
        return inverse
    away = (mean - [meeting.x_m, meeting.y_m])[None]
    along = _along(away)[0]
    along_only: Floats = np.outer(along, along) / _range_variance(meeting, away, spread)[0]
    return along_only


def best_omega(own: Floats, other: Floats) -> float:
    """The weight omega of the cloud's information (2, 2) that minimises the fused determinant: det(omega A + (1 - omega) B) is a parabola."""
    a, b = float(np.linalg.det(own)), float(np.linalg.det(other))
    c = float(own[0, 0] * other[1, 1] + own[1, 1] * other[0, 0] - own[0, 1] * other[1, 0] - own[1, 0] * other[0, 1])
    curvature = a - c + b
    if curvature >= 0.0:
        return 1.0 if a >= b else 0.0
    return min(max((2.0 * b - c) / (2.0 * curvature), 0.0), 1.0)


def places_at(cloud: Cloud, meeting: Meeting) -> Floats:
    """Places (n, 2) of the particles at the meeting, map frame."""
    place: Floats = np.column_stack([cloud.map_x_m, cloud.y_m])
    c, s = np.cos(cloud.turn_rad), np.sin(cloud.turn_rad)
    x, y = meeting.way_x_m, meeting.way_y_m
    place += cloud.scale[:, None] * np.column_stack([c * x - s * y, s * x + c * y])
    return place


def weigh(cloud: Cloud, meeting: Meeting, area_m2: float) -> float:
    """Reweight a cloud by a meeting on a floor of this area; returns the probability that the meeting is right, given the cloud."""
    cloud.show_every_state()
    place = places_at(cloud, meeting)
    if cloud.sheet is None:
        on_level, levels = np.full(len(place), meeting.level == 0), 1
    else:
        heights = cloud.sheet.height_m
        on_level, levels = np.abs(cloud.z_m - heights[meeting.level]) < HALF_STOREY_M, len(heights)
    log_met, weight = log_density(meeting, place, on_level, levels), cloud.weight
    wrong = WRONG[meeting.status]
    anywhere = 1.0 / (area_m2 if meeting.range_m is None else math.sqrt(area_m2))
    density = (1.0 - wrong) * float(weight @ np.exp(log_met))
    right = density / (density + wrong * anywhere)
    factor = log_met if cloud.is_searching else None
    if right >= PROBABLE and not cloud.is_searching:
        factor = _intersection(meeting, place, weight, log_met)
    if factor is not None:  # a cloud that is concentrated elsewhere is not changed
        factor = meeting.share * factor
        factor -= factor.max()
        factor -= math.log(float(weight @ np.exp(factor)))
        # Right or wrong, in these shares: a mixture of the reweighted cloud and the old one.
        cloud.reweight(np.log(np.maximum(right * np.exp(factor) + 1.0 - right, math.exp(LEAST_FACTOR))))
    return right


def _intersection(meeting: Meeting, place: Floats, weight: Floats, log_met: Floats) -> Floats | None:
    """Log-factors (n,) of covariance intersection for particles at `place` (n, 2); None where the cloud has more information in every direction."""
    mean = weight @ place
    spread = np.cov(place, rowvar=False, aweights=weight, bias=True) + LEAST_SD_OF_CLOUD_M**2 * np.eye(2)
    own: Floats = np.asarray(np.linalg.inv(spread), np.float64)
    omega = best_omega(own, information(meeting, mean))
    if omega >= 1.0:
        return None
    away = place - mean
    log_prior = np.maximum(-0.5 * np.einsum("ni,ij,nj->n", away, own, away), FARTHEST)
    log_factor: Floats = (1.0 - omega) * (log_met - log_prior)
    return log_factor


def _along(away: Floats) -> Floats:
    """Unit vectors (n, 2); east where there is no direction."""
    distance = np.hypot(away[:, 0], away[:, 1])[:, None]
    unit: Floats = np.where(distance > 0.0, away / np.maximum(distance, 1e-9), [1.0, 0.0])
    return unit


def _range_variance(meeting: Meeting, away: Floats, spread: Floats) -> Floats:
    """Variance (n,) of a radio range, with the teammate's own along the line to each place."""
    along = _along(away)
    variance: Floats = np.einsum("ni,ij,nj->n", along, spread, along) + meeting.range_sd_m**2 + RANGE_BODY_SD_M**2
    return variance


class MeetingEffect(StrEnum):
    """The effect of a meeting on the tracked cloud.

    `used`: the cloud agrees, and was reweighted; `moved`: the cloud was doubted, or others contradicted it too, and the one that is tracked now lies
    about the teammate; `contradicts`: the teammate is elsewhere, and nothing was changed; `empty`: the teammate does not know its own place;
    `repeated`: nothing is new since the last meeting with this teammate.
    """

    USED = "used"
    MOVED = "moved"
    CONTRADICTS = "contradicts"
    EMPTY = "empty"
    REPEATED = "repeated"


@dataclass(frozen=True, slots=True)
class MeetingNews:
    """The newest meeting: its number, counted from 1, with whom, and what it did."""

    number: int
    name: str
    effect: MeetingEffect


class MeetingMemory:
    """Decides which meetings may count: a teammate's position counts again after RENEWED_M of the wearer's own path."""

    def __init__(self, odometer: Odometer) -> None:
        """`odometer`: of the wearer's path."""
        self._odometer = odometer
        # Mark on the path at the last meeting with each teammate, or range to a beacon of theirs
        self._met_m: dict[tuple[str, int | None], float] = {}
        self._contradicted_m: list[float] = []  # marks at the contradictions since the last agreement

    def refusal(self, meeting: Meeting) -> MeetingEffect | None:
        """Why a meeting does not count; None where it does, which is remembered."""
        if not carries_position(meeting):
            return MeetingEffect.EMPTY
        key = meeting.name, meeting.beacon
        last_m = self._met_m.pop(key, -math.inf)
        repeated = self._odometer.since_m(last_m) < RENEWED_M
        self._met_m[key] = last_m if repeated else self._odometer.path_m
        if len(self._met_m) > MOST_NAMES:
            self._met_m.pop(next(iter(self._met_m)))
        return MeetingEffect.REPEATED if repeated else None

    def forget_beacons(self) -> None:
        """Reset the ranges to beacons: a search has begun, whose cloud they have not reweighted yet."""
        self._met_m = {key: m for key, m in self._met_m.items() if key[1] is None}

    def agree(self) -> None:
        """A teammate agrees with the cloud: earlier contradictions are cancelled."""
        self._contradicted_m.clear()

    def contradict(self) -> int:
        """A teammate contradicts the cloud; returns how many have done so in the last RENEWED_M without an agreement since."""
        recent_m = [m for m in self._contradicted_m if self._odometer.since_m(m) < RENEWED_M]
        self._contradicted_m = [*recent_m, self._odometer.path_m][-MOST_NAMES:]
        return len(self._contradicted_m)


def moved_probability(here: float, meeting: Meeting, count: int) -> float:
    """Probability that the meeting is right where `count` meetings contradict a cloud that is right with probability `here`.

    If the cloud is right, all of them are wrong: odds of here wrong^count; otherwise this one is right with 1 - wrong.
    """
    wrong = WRONG[meeting.status]
    return (1.0 - here) * (1.0 - wrong) / (here * wrong**count + 1.0 - here)


def moved_by(meeting: Meeting, here: float, count: int) -> float | None:
    """Probability of the teammate's place where `count` contradictions move the cloud there; None where they do not. `here`: that it is right."""
    moved = moved_probability(here, meeting, count)
    is_alone = count < CONTRADICTIONS and here >= PROBABLE
    return None if (meeting.range_m or 0.0) > PLACE_M or is_alone or moved < PROBABLE else moved


class MeetingQueue:
    """Meetings that wait for their segment. `counts`: of all meetings by what they did; `bad` ones are no meetings."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.news: MeetingNews | None = None
        self._waiting: list[TimedMeeting] = []

    def receive(self, payload: bytes, levels: int) -> Meeting | None:
        """The meeting in the bytes of a chunk, on a plan of so many levels; bytes that are none are counted."""
        message = parse_meeting(payload)
        if message is None or message.level >= levels:
            self.counts["bad"] += 1
            return None
        return Meeting(**structs.asdict(message))

    def add(self, meeting: Meeting, t_s: float) -> None:
        """Keep a meeting of this time; of too many the oldest are dropped."""
        self._waiting = [*self._waiting, (-math.inf if math.isnan(t_s) else t_s, meeting)][-MOST_WAITING:]

    def pop(self, t_s: float) -> list[TimedMeeting]:
        """The waiting meetings up to a time."""
        ready = [(met_s, meeting) for met_s, meeting in self._waiting if met_s <= t_s]
        self._waiting = [(met_s, meeting) for met_s, meeting in self._waiting if met_s > t_s]
        return ready

    def note(self, meeting: Meeting, effect: MeetingEffect) -> None:
        """Count the effect of a meeting; a range to a teammate's beacon is not reported as news."""
        if meeting.beacon is not None:
            self.counts[f"beacon {effect.value}"] += 1
            return
        self.counts[effect.value] += 1
        self.news = MeetingNews(1 if self.news is None else self.news.number + 1, meeting.name, effect)


def weigh_range(each: CloudHypothesis, meeting: Meeting, area_m2: float) -> float:
    """Weigh the cloud by a range to a teammate's beacon; returns the probability that the range is right, given the cloud.

    A range that the cloud explains worse than chance casts doubt on it; one that it explains takes such doubt back, and gives nothing else.
    """
    right = weigh(each.cloud, meeting, area_m2)
    if not each.cloud.is_searching:
        before = each.doubts.get(meeting.name, 0.0)
        after = before + meeting.share * math.log(WRONG[meeting.status] / max(1.0 - right, LEAST_WRONG))
        each.doubts[meeting.name] = min(max(after, MOST_DOUBT), 0.0)
        each.log_weight += each.doubts[meeting.name] - before
    return right


def weigh_by(each: CloudHypothesis, meeting: Meeting, area_m2: float) -> float:
    """Weigh a cloud by a meeting, or by a range to a teammate's beacon; returns the probability that it is right, given the cloud."""
    return weigh(each.cloud, meeting, area_m2) if meeting.beacon is None else weigh_range(each, meeting, area_m2)
