# SPDX-License-Identifier: MIT
"""p(echo | pose): density of the range that a ranger reports, given the echo sources within its cone.

In: a range and the plan's echo sources, nearest first. Out: a likelihood. Owns nothing.

An SRF02 reports the first echo that it detects. So a source answers if it is detected and no nearer one is, and a second reflection after them all.
Where the plan differs from the building (furniture, people, a door that is shut, a wall that is gone), the view of a ranger is hidden, and its echo
carries no information about the pose. A hidden view persists along the path, as furniture has a length. So each particle carries the probability that
its view is hidden, a Markov chain of two states over the path [Thrun et al. 2005, 6.3: the mixture of the beam model; here with a memory].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.jit import inline_kernel, inline_part, lean_kernel
from echostep.walls.tile_points import CORNER, EDGE

# Assumed, not measured.
ABSORPTION_DB_M = 2.6  # dB per metre of distance, there and back, 40 kHz in air [ISO 9613-1]
DB = 20.0 / math.log(10.0)  # decibels per unit of the natural logarithm of a distance
# Sources are omitted where a nearer one is detected but for this probability, assumed: a tenth changes a ping by 5e-4 nats, at most 0.5 (simulated)
NEGLIGIBLE_REST = 1e-4
SILENT_SHARE = 0.2  # share of outliers and of hidden views that are "no echo", assumed
# Of `stray`, when the ping before was silent too: among real clutter, of which `hidden` is a part, 0.70 to 0.86 are then silent where nothing is
# expected (search-silence of the studies' notebook); with this share 0.79
STRAY_ON = 0.25
LEAST_LOGIT = -8.0  # below it a source is not detected: probability 3e-4
SURE_RAD = math.radians(20.0)  # angle off the axis within which a near wall surely answers: half of the cone
SURE_COS = math.cos(SURE_RAD)
MINIMAL_M, FARTHEST_M = 1e-3, 100.0  # distances between which any ranger's limits lie
GATE_SD = 6.0  # a source further from the range than this many standard deviations adds nothing


@dataclass(frozen=True, slots=True)
class EchoSettings:
    """Model of an SRF02's reports; lengths in metres, probabilities of one ping.

    `sd_m`: range error of 3-4 cm [Girard 2011, 2.6] and the trunk's sway; it grows by `slant_m` per radian off the axis.
    A wall is detected with probability 1/2 when its level equals that of a wall straight ahead at `maximum_m`, given spreading and absorption there
    and back and a beam that is `rim_db` down at 27.5 degrees each way [Girard 2011, 2.6.2, 2.6.3]; `soft_db`: decibels per unit of logit.
    The inside of a corner answers `corner_db` more weakly, any other wall end `edge_db`, and more so with distance.
    `hidden`: share of views in which the plan differs from the building, `hidden_m`: length of the path over which a view stays hidden (a cupboard).
    `stray`: a second reflection when no source was detected, a quarter of it after a silent ping; `outlier`: anything else, from ping to ping.
    `correlation_m`: length of the path over which errors of successive echoes become independent: errors of the plan, of a ranger's bias, and of the
    trunk's sway, which lasts half a stride. `own`: share of an echo's information that is independent of all earlier
    echoes: errors of the plan are correlated over metres (by the filter's errors among real clutter: echo-own of the studies' notebook).
    """

    sd_m: float = 0.036
    slant_m: float = 0.05
    rim_db: float = 6.0
    maximum_m: float = 6.0
    minimum_m: float = 0.15
    soft_db: float = 2.0
    edge_db: float = 20.0
    corner_db: float = 3.0
    hidden: float = 0.15
    hidden_m: float = 0.6
    stray: float = 0.3
    outlier: float = 0.05
    correlation_m: float = 0.25
    own: float = 0.7

    def __post_init__(self) -> None:
        """Raise ValueError for lengths of zero and for numbers that are not probabilities."""
        for name in ("sd_m", "soft_db", "correlation_m", "outlier", "hidden", "hidden_m"):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"{name}: must be greater than 0")
        for name in ("hidden", "stray", "outlier"):
            if getattr(self, name) >= 1.0:
                raise ValueError(f"{name}: must be a probability below 1")
        if not 0.0 < self.own <= 1.0:
            raise ValueError("own: must be a share above 0, at most 1")
        if not 0.0 < self.minimum_m < 0.5 * self.maximum_m:
            raise ValueError("minimum_m: must be well below maximum_m")


class EchoModel(NamedTuple):
    """`EchoSettings` as the kernels take them: levels in logits, the beam in logits per square radian.

    `sure_m`: within it a wall up to SURE_RAD off the axis leaves less than NEGLIGIBLE_REST undetected. `edge_m`: beyond it no edge is detected.
    """

    sd_m: float
    slant_m: float
    reach: float
    per_db: float
    beam: float
    edge: float
    corner: float
    maximum_m: float
    minimum_m: float
    hidden: float
    hidden_m: float
    stray: float
    outlier: float
    sure_m: float
    edge_m: float


def echo_model(s: EchoSettings) -> EchoModel:
    """The settings in the kernels' units."""
    per_db = 1.0 / s.soft_db
    beam = 2.0 * s.rim_db / math.radians(27.5) ** 2
    reach = per_db * (20.0 * math.log10(s.maximum_m) + ABSORPTION_DB_M * s.maximum_m)
    beam, edge = per_db * beam, per_db * s.edge_db
    sure = math.log(1.0 / NEGLIGIBLE_REST - 1.0)
    return EchoModel(
        s.sd_m, s.slant_m, reach, per_db, beam, edge, per_db * s.corner_db,
        s.maximum_m, s.minimum_m, s.hidden, s.hidden_m, s.stray, s.outlier,
        _distance_m(reach - beam * SURE_RAD**2 - sure, per_db, 1.0), _distance_m(reach - edge - LEAST_LOGIT, per_db, 1.5),
    )  # fmt: skip


def _distance_m(level: float, per_db: float, spreading: float) -> float:
    """Distance at which spreading and absorption take this level, in logits; `spreading`: in units of a wall's spreading. By bisection."""
    low, high = MINIMAL_M, FARTHEST_M
    for _ in range(40):
        middle = 0.5 * (low + high)
        taken = per_db * (spreading * DB * math.log(middle) + ABSORPTION_DB_M * middle)
        low, high = (middle, high) if taken < level else (low, middle)
    return low


@inline_part
def after_source(
    range_m: float, unheard: float, hit: float, distance_m: float, off_axis_rad: float, kind: float, m: EchoModel
) -> tuple[float, float]:
    """Probability that no source so far was detected, and density of the range by these sources, after one more; all before was nearer."""
    answers = unheard * detection(distance_m, off_axis_rad, kind, m) if unheard >= NEGLIGIBLE_REST else 0.0
    error, sd = range_m - distance_m, m.sd_m + m.slant_m * off_axis_rad
    return unheard - answers, hit + (answers * normal(error, sd) if abs(error) < GATE_SD * sd else 0.0)


@inline_part
def planned_density(range_m: float, unheard: float, hit: float, stray: float, strays: float) -> float:
    """Density per metre of a range after all sources [`after_source`], if the view is as planned; range 0: the probability of no echo.

    `stray`: probability of a second reflection where no source is detected; `strays`: its density at this range.
    """
    return hit + unheard * stray * strays if range_m > 0.0 else (1.0 - stray) * unheard


@inline_part
def outlier_density(range_m: float, m: EchoModel) -> float:
    """Density per metre of an outlier; range 0: the probability of no echo."""
    return SILENT_SHARE if range_m <= 0.0 else (1.0 - SILENT_SHARE) / (m.maximum_m - m.minimum_m)


@lean_kernel
def echo_density(
    range_m: float, count: int, distance_m: Floats, off_axis_rad: Floats, kind: Floats, m: EchoModel
) -> float:
    """Density per metre of a range whose view has no history, as of a hidden view or an outlier where it is not as planned; range 0: of no echo."""
    outlier, strays = outlier_density(range_m, m), 1.0 / (m.maximum_m - m.minimum_m)
    as_planned = (1.0 - m.outlier) * (1.0 - m.hidden)
    unheard, hit = 1.0, 0.0
    for k in range(count):
        unheard, hit = after_source(range_m, unheard, hit, distance_m[k], off_axis_rad[k], kind[k], m)
    planned = planned_density(range_m, unheard, hit, m.stray, strays)
    return as_planned * planned + (1.0 - as_planned) * outlier


@inline_kernel
def detection(distance_m: float, off_axis_rad: float, kind: float, m: EchoModel) -> float:
    """Probability that a source is detected: from spreading, absorption, beam, and the weaker echo of a corner or an edge."""
    log_d = logarithm(distance_m) * DB
    margin = m.reach - m.per_db * (log_d + ABSORPTION_DB_M * distance_m) - m.beam * off_axis_rad * off_axis_rad
    if kind == EDGE:
        margin -= m.edge + 0.5 * m.per_db * log_d
    elif kind == CORNER:
        margin -= m.corner
    is_detected = margin > LEAST_LOGIT and distance_m >= 0.5 * m.minimum_m
    return 1.0 / (1.0 + exponential(-margin)) if is_detected else 0.0


@inline_part
def likeliest_source(
    count: int, distance_m: Floats, off_axis_rad: Floats, kind: Floats, m: EchoModel
) -> tuple[int, float, float]:
    """Which of `count` sources, nearest first, is likeliest to be detected first; the probabilities of this, and that none is detected."""
    unheard, answers, first = 1.0, 0.0, 0
    for k in range(count):
        heard = unheard * detection(distance_m[k], off_axis_rad[k], kind[k], m)
        unheard -= heard
        if heard > answers:
            answers, first = heard, k
    return first, answers, unheard


@inline_kernel
def normal(x: float, sd: float) -> float:
    """Normal density about zero."""
    z = x / sd
    return exponential(-0.5 * z * z) / (sd * 2.5066282746310002)


# Bits of numbers: 1.5 * 2^52, to which a number can be added to round it; sqrt(1/2); 2^52, to which those of an integer can be added
ROUNDING, HALF_ROOT, WHOLE, BIAS = 1.5 * 2.0**52, 0x3FE6A09E667F3BCD, 0x4330000000000000, 1023
LN2 = 0.6931471805599453


@inline_kernel
def exponential(x: float) -> float:
    """e^x up to x = 700, relative error below 1e-8, for x < -700 as there: a Taylor series within half a power of two.

    A call of libm would keep the compiler from computing several particles at once. No step depends on how many those are.
    """
    x = max(x, -700.0)
    t = x / LN2 + ROUNDING
    r = x - (t - ROUNDING) * LN2
    series = 1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0)))
    series = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * series)))
    return series * np.int64((np.float64(t).view(np.int64) + BIAS) << 52).view(np.float64)


@inline_kernel
def logarithm(x: float) -> float:
    """Natural logarithm of a normal number above 0, error below 1e-9: the series of 2 artanh((m - 1) / (m + 1)) with 1/2 <= m^2 < 2."""
    bits = np.float64(x).view(np.int64) - HALF_ROOT
    exponent = np.int64((((bits >> 52) + BIAS) & 0x7FF) | WHOLE).view(np.float64) - (2.0**52 + BIAS)
    m = np.int64((bits & (2**52 - 1)) + HALF_ROOT).view(np.float64)
    s = (m - 1.0) / (m + 1.0)
    s2 = s * s
    return exponent * LN2 + 2.0 * s * (1.0 + s2 * (1.0 / 3.0 + s2 * (0.2 + s2 * (1.0 / 7.0 + s2 * (1.0 / 9.0)))))
