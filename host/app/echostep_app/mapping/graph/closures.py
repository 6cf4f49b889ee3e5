# SPDX-License-Identifier: MIT
"""Loop closures: a stretch of the path is where an older one was.

In: a graph solved so far. Out: `Closure`s with their odds. Owns the limits. The posterior of a shift is the graph's own uncertainty times the match
of the stretch's fragments with all older ones, against the hypothesis of a new place; a closure carries the information of this posterior
beyond the graph's, along the axes that have any: in a corridor only across it. It ties the stretch to the passage that detected the matched
walls.

Fragments that continue each other are one piece of wall. A fragment ends after 2 m of path wherever it is: a later passage cannot find such a cut
again, but it finds a door.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep_app.mapping.graph.graph import Closure, Graph
from echostep_app.mapping.graph.matching import Pieces, match

GAP_M = 0.35  # greatest gap along one piece of wall: half of a door; cuts leave up to three pings, 0.25 m
STRETCH_M = 8.0  # of path that is matched as one
APART_M = 20.0  # of path between a stretch and older ones
SEARCHED_M = 7.0  # beyond the uncertainty, in which older fragments are looked for
NEW = 0.5  # probability before the match that the place is new
LEAST_LOG_ODDS = math.log(2e4)  # every place is tried twice
SHIFTS, TURNS = 31, 5  # of the grid to either side of three standard deviations
LEAST_SD_M, LEAST_SD_RAD = 0.04, math.radians(0.4)
MOST_SD_M = 4.0  # of the graph's uncertainty, beyond which no closure is tried: too many places look alike
KNOWN_SD_M = 0.15  # of a direction after the match that counts as known
NEW_SHARE = 0.5  # remaining share of the graph's variance on an axis, up to which the match counts
LEAST_OLD = 4
LEAST_COVARIANCE = np.diag([LEAST_SD_M**2, LEAST_SD_M**2, LEAST_SD_RAD**2])
PASSAGES = 4  # that are tried for one stretch: mostly two


def pieces(graph: Graph, which: Ints) -> Pieces:
    """Fragments `which` (k,) in the map, one by one."""
    f = graph.fragments
    centre, normal = graph.places()
    range_m = np.hypot(*(centre[which] - graph.pose[f.node[which], :2]).T)
    return Pieces(centre[which, 0], centre[which, 1], normal[which], f.half_m[which], f.sd_rad[which], range_m)


def stretches(graph: Graph, which: Ints) -> Pieces:
    """The same fragments; fragments of one wall with less than GAP_M between them are one piece."""
    single, of = pieces(graph, which), graph.walls.of[which]
    rows = [_row(single, np.array([k])) for k in np.flatnonzero(of < 0)]
    for wall in np.unique(of[of >= 0]).tolist():
        own = np.flatnonzero(of == wall)
        rows += [_row(single, part) for part in _parts(single, own, float(graph.walls.normal_rad[wall]))]
    return Pieces(*np.array(rows).reshape(-1, 6).T)


def _parts(single: Pieces, own: Ints, normal_rad: float) -> list[Ints]:
    """The pieces `own` (k,) of one wall in groups without a gap."""
    c, s = math.cos(normal_rad), math.sin(normal_rad)
    along = c * single.y_m[own] - s * single.x_m[own]
    order = np.argsort(along - single.half_m[own], kind="stable")
    low, high = (along - single.half_m[own])[order], (along + single.half_m[own])[order]
    begins = np.flatnonzero(low[1:] > np.maximum.accumulate(high)[:-1] + GAP_M) + 1
    return [own[part] for part in np.split(order, begins)]


def _row(single: Pieces, part: Ints) -> Floats:
    """One piece from all of `part` (k,): at their mean across the wall, from the first end to the last along it, free as far as from the nearest."""
    if len(part) == 1:
        return np.array([column[part[0]] for column in single])
    weight = single.half_m[part] / single.sd_rad[part] ** 2
    weight /= weight.sum()
    normal = single.normal_rad[part]
    mean = normal[0] + float(weight @ ((normal - normal[0] + math.pi) % (2.0 * math.pi) - math.pi))
    c, s = math.cos(mean), math.sin(mean)
    across, along = (c * single.x_m[part] + s * single.y_m[part], c * single.y_m[part] - s * single.x_m[part])
    low, high = float((along - single.half_m[part]).min()), float((along + single.half_m[part]).max())
    rho, middle = float(weight @ across), 0.5 * (low + high)
    sd_rad = 1.0 / math.sqrt(float((single.sd_rad[part] ** -2.0).sum()))
    x, y = c * rho - s * middle, s * rho + c * middle
    return np.array([x, y, mean, 0.5 * (high - low), sd_rad, float(single.range_m[part].min())])


class _Matched(NamedTuple):
    """The posterior of a shift (3,): `mean`, covariance `after` the match and `before` (3, 3), log-odds against a new place."""

    mean: Floats
    after: Floats
    before: Floats
    log_odds: float


def find_closure(graph: Graph, begin: int, end: int, until_m: float) -> Closure | None:
    """The closure of the stretch of nodes [begin, end) with the path before `until_m`, or None."""
    f, way_m = graph.fragments, graph.nodes.way_m
    node = (begin + end) // 2
    usable = (f.half_m > 0.25) & (graph.level_of(f.node) == graph.level_of(np.array([node])))
    new = np.flatnonzero((f.node >= begin) & (f.node < end) & usable)
    if len(new) < 2:
        return None
    centre, _ = graph.places()
    at = graph.pose[node, :2]
    older = np.flatnonzero((way_m[f.node] < until_m) & usable)
    if len(older) < LEAST_OLD:
        return None
    away = np.hypot(*(centre[older] - at).T)
    nearest = int(f.node[older[np.argmin(away)]])
    sd = _greatest_sd_m(graph.covariance(node, nearest))
    if sd > MOST_SD_M:
        return None
    older = older[away < SEARCHED_M + 3.0 * sd]
    if len(older) < LEAST_OLD:
        return None
    return _closure(graph, new, older, node)


def _closure(graph: Graph, new: Ints, older: Ints, node: int) -> Closure | None:
    """The closure with the passage that detected the matched walls; None if it is not sure, or known on no axis.

    Another passage of the same place may be elsewhere in the graph, until a return ties the two: echoes of its neighbour carry no information about
    it.
    """
    at = graph.pose[node, :2]
    single, ways = pieces(graph, new), stretches(graph, older)
    old_node = _nearest(graph, older, at)
    for _ in range(PASSAGES):
        covariance = graph.covariance(node, old_node)
        if _greatest_sd_m(covariance) > MOST_SD_M:
            return None
        matched = _matched(single, ways, at, covariance)
        if matched.log_odds < LEAST_LOG_ODDS:
            return None
        passage = _explaining(graph, single, older, at, matched.mean)
        if old_node in graph.fragments.node[passage]:
            if (news := gained(matched.mean, matched.after, matched.before)) is None:
                return None
            shift, information = news  # of the posterior, beyond the graph's
            between = graph.pose[node] - graph.pose[old_node] + shift
            return Closure(old_node, node, between, information, matched.log_odds)
        old_node = _nearest(graph, passage, at + matched.mean[:2])
    return None


def _greatest_sd_m(covariance: Floats) -> float:
    """Standard deviation of a place along the axis on which it is known worst."""
    return math.sqrt(float(np.linalg.eigvalsh(covariance[:2, :2])[-1]))


def _matched(single: Pieces, ways: Pieces, at: Floats, covariance: Floats) -> _Matched:
    """The posterior of the shift of a node at `at` (2,) with pieces `single` onto older ones `ways`, of this `covariance` (3, 3) before."""
    before = covariance + LEAST_COVARIANCE
    sd = _greatest_sd_m(before)
    shifts = np.linspace(-3.0 * sd, 3.0 * sd, SHIFTS if sd < 0.6 else 2 * SHIFTS + 1)
    turns = np.linspace(-2.0, 2.0, TURNS) * math.sqrt(before[2, 2])
    score = match(single, ways, at, shifts, turns)
    t, x, y = np.meshgrid(turns, shifts, shifts, indexing="ij")
    grid = np.stack([x.ravel(), y.ravel(), t.ravel()], axis=1)
    prior = np.exp(-0.5 * np.einsum("ni,ij,nj->n", grid, np.linalg.inv(before), grid))
    prior /= prior.sum()
    top = max(float(score.max()), 0.0)
    posterior = prior * np.exp(score.ravel() - top)
    log_odds = math.log(max(float(posterior.sum()), 1e-300)) + top + math.log((1.0 - NEW) / NEW)
    posterior /= max(float(posterior.sum()), 1e-300)
    mean = posterior @ grid
    spread = (grid - mean) * np.sqrt(posterior)[:, None]
    return _Matched(mean, spread.T @ spread + LEAST_COVARIANCE, before, log_odds)


def _explaining(graph: Graph, single: Pieces, older: Ints, at: Floats, shift: Floats) -> Ints:
    """Fragments among `older` of the one passage that explains pieces `single` best when their node at `at` (2,) is moved by `shift` (3,)."""
    way_m = graph.nodes.way_m[graph.fragments.node[older]]
    order = np.argsort(way_m, kind="stable")
    passages = np.split(older[order], np.flatnonzero(np.diff(way_m[order]) > STRETCH_M) + 1)
    moved = single._replace(x_m=single.x_m + shift[0], y_m=single.y_m + shift[1])
    here, turned = np.zeros(1), shift[2:]
    scores = [float(match(moved, stretches(graph, p), at + shift[:2], here, turned)[0, 0, 0]) for p in passages]
    return passages[int(np.argmax(scores))]


def _nearest(graph: Graph, which: Ints, at: Floats) -> int:
    """The node of fragments `which` (k,) that is nearest to a place (2,)."""
    node = graph.fragments.node[which]
    return int(node[np.argmin(np.hypot(*(graph.pose[node, :2] - at).T))])


def gained(mean: Floats, after: Floats, before: Floats) -> tuple[Floats, Floats] | None:
    """The information of a match alone, given the prior (zero, `before`) and the posterior (`mean`, `after`) of a shift.

    Shift (3,) and information (3, 3), of x, y (m) and heading; None where the posterior is known on no axis. Posterior and prior differ by
    the match's information, whose shift is farther from zero accordingly. Where they differ little the match adds nothing: it confirms the
    graph.
    """
    root = np.linalg.cholesky(before[:2, :2])
    white = np.linalg.inv(root)
    left, turn = np.linalg.eigh(white @ after[:2, :2] @ white.T)  # shares of the prior's variance that are left
    axes = white.T @ turn  # (2, 2): a column gives the place along one axis, in standard deviations of the prior
    known = np.sqrt(left) / np.hypot(*axes) < KNOWN_SD_M
    if not known.any():
        return None
    new = known & (left < NEW_SHARE)
    information, shift = np.zeros((3, 3)), mean.copy()
    information[:2, :2] = (axes * np.where(new, 1.0 / left - 1.0, 0.0)) @ axes.T
    shift[:2] = root @ turn @ (axes.T @ mean[:2] / np.where(new, 1.0 - left, 1.0))
    left_rad = after[2, 2] / before[2, 2]
    if left_rad < NEW_SHARE:
        information[2, 2] = (1.0 / left_rad - 1.0) / before[2, 2]
        shift[2] = mean[2] / (1.0 - left_rad)
    return shift, information
