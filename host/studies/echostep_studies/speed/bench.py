# SPDX-License-Identifier: MIT
"""Speed, as ratios against a peer that does the same work in the same run on the same poses and walls.

In: nothing. Out: a table, and in the folder given by --out bench.json (`{name, ratio, median_s, peer_s}` a row) and bench.png. Rounds of ours and the
peer's are interleaved and timed by the CPU time of the thread, so that a busy machine slows both alike and a switch to another program counts for
neither (threads that a peer starts are not charged to it); medians are reported.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from importlib.resources import files
from pathlib import Path
from statistics import median
from unittest import mock

import numpy as np
import shapely
from rich.console import Console
from rich.table import Table

from echostep.arrays import Floats
from echostep.jit import kernel
from echostep.plan.model import load_plan
from echostep.walls.echo_sources import Walls
from echostep.walls.index import WallIndex, build_index, crosses_wall
from echostep_studies.papers.girard2011_rays import lambda_ray_ranges
from echostep_studies.speed.peers import (
    APERTURE_RAD,
    MAPLESS,
    MAXIMUM_M,
    MISSING,
    RAYS,
    Reader,
    embreex_reader,
    plain_rays,
    shapely_reader,
)

Work = Callable[[], object]
MEASURED_M = np.array([1.2, 1.4])
SLANT_RAD = 0.5 * APERTURE_RAD / RAYS


@dataclass(frozen=True, slots=True)
class Row:
    """`ratio` is how many times longer the peer takes; `wanted` of it is what we promise."""

    name: str
    ratio: float
    median_s: float
    peer_s: float
    wanted: float | None = None


@dataclass(frozen=True, slots=True)
class Scale:
    """How much is measured: rounds, poses of the cloud, walls of the office, of the city, candidates of a step."""

    rounds: int = 9
    poses: int = 10_000
    office: int = 1_000
    city: int = 1_000_000
    candidates: int = 10_000


def offices(count: int) -> Floats:
    """About `count` walls (n, 4): corridors 2.5 m wide, rooms of 4 m x 5 m and doors of 0.9 m on both sides, stacked to a block about square."""
    pairs = max(count // 8, 1)
    floors = max(round(math.sqrt(pairs * 4.0 / 12.5)), 1)
    x, y = np.meshgrid(4.0 * np.arange(math.ceil(pairs / floors)), 12.5 * np.arange(floors))
    origin = np.stack([x.ravel(), y.ravel(), x.ravel(), y.ravel()], -1)
    room = []
    for back, front in ((0.0, 5.0), (12.5, 7.5)):
        room += [[0, back, 4, back], [0, back, 0, front], [0, front, 1.5, front], [2.4, front, 4, front]]
    return (origin[:, None] + np.array(room, dtype=np.float64)).reshape(-1, 4)


def cloud(walls: Floats, count: int, seed: int = 1) -> tuple[Floats, Floats, Floats]:
    """A cloud of x, y, heading in the corridor in the middle of the walls: 2 m along, 1 m across, 8 degrees."""
    rng = np.random.default_rng(seed)
    x = 4.0 * round(walls[:, ::2].mean() / 4.0) + 2.0 * rng.standard_normal(count)
    y = 12.5 * math.floor(walls[:, 1::2].mean() / 12.5 - 0.25) + 6.25 + 1.0 * rng.standard_normal(count)
    return x, y, math.radians(8.0) * rng.standard_normal(count)


def weights(readings: Floats) -> Floats:
    """Weights of poses from what their rangers should read [Girard 2011, eq. 1]."""
    least = np.minimum(np.minimum(readings, MEASURED_M), MAXIMUM_M)
    return (least / np.minimum(np.maximum(readings, MEASURED_M), MAXIMUM_M)).mean(1)


def _read_weights(read: Reader, x: Floats, y: Floats, heading: Floats) -> Floats:
    return weights(read(x, y, heading))


def our_reading(owner: Walls, x: Floats, y: Floats, heading: Floats) -> Floats:
    """Weights of poses by the visible walls."""
    return our_weights(lambda_ray_ranges(x, y, heading, owner.near(x, y), RAYS, APERTURE_RAD, MAXIMUM_M))


@kernel
def our_weights(readings: Floats) -> Floats:
    """The same in one sweep."""
    out = np.empty(len(readings))
    for i in range(len(readings)):
        total = 0.0
        for k in range(2):
            least, most = min(readings[i, k], MEASURED_M[k]), max(readings[i, k], MEASURED_M[k])
            total += min(least, MAXIMUM_M) / min(most, MAXIMUM_M)
        out[i] = 0.5 * total
    return out


def interleaved(ours: Work, peer: Work, rounds: int) -> tuple[float, float]:
    """Median CPU seconds of ours and of the peer's, taken in turn, after one round that is not counted."""
    times: tuple[list[float], list[float]] = ([], [])
    for k in range(rounds + 1):
        for side, work in enumerate((ours, peer)):
            began = time.thread_time()
            work()
            if k:
                times[side].append(time.thread_time() - began)
    return median(times[0]), median(times[1])


def compared(name: str, ours: Work, peer: Work, rounds: int, wanted: float | None = None) -> Row:
    own_s, peer_s = interleaved(ours, peer, rounds)
    return Row(name, peer_s / own_s, own_s, peer_s, wanted)


def weighing(scale: Scale) -> Iterator[Row]:
    """A cloud to weights, against rays; the readings must agree."""
    walls = offices(scale.office)
    x, y, heading = cloud(walls, scale.poses)
    owner = Walls(walls, SLANT_RAD)

    ours = partial(our_reading, owner, x, y, heading)
    expected = ours()
    readers: dict[str, tuple[Reader, float | None]] = {"shapely STRtree": (shapely_reader(walls), 1000.0)}
    if "embreex" not in MISSING:
        readers["embreex"] = (embreex_reader(walls), 35.0)
    index = build_index(walls)
    readers["our own plain rays"] = (lambda a, b, c: plain_rays(a, b, c, index), None)
    for peer, (read, wanted) in readers.items():
        agree = np.isclose(weights(read(x, y, heading)), expected, atol=1e-5).mean()
        if agree < 0.999:
            raise SystemExit(f"{peer}: only {agree:.2%} of the weights agree with ours")
        yield compared(
            f"weigh {len(x):,} poses; {peer}, {2 * RAYS} rays a pose",
            ours,
            partial(_read_weights, read, x, y, heading),
            scale.rounds,
            wanted,
        )


def crossing(scale: Scale) -> Iterator[Row]:
    """Which of many short moves cross a wall, against shapely's bulk query."""
    walls = offices(scale.office)
    x, y, heading = cloud(walls, scale.poses)
    index = build_index(walls)
    to_x, to_y = x + 0.07 * np.cos(heading), y + 0.07 * np.sin(heading)
    tree = shapely.STRtree(shapely.linestrings(walls.reshape(-1, 2, 2)))

    def peer() -> object:
        lines = shapely.linestrings(np.stack([np.stack([x, y], -1), np.stack([to_x, to_y], -1)], 1))
        return tree.query(lines, predicate="intersects")

    yield compared(
        f"{len(x):,} moves of 7 cm through walls?; shapely STRtree",
        lambda: crossings(x, y, to_x, to_y, index),
        peer,
        scale.rounds,
    )


@kernel
def crossings(x: Floats, y: Floats, to_x: Floats, to_y: Floats, index: WallIndex) -> int:
    """How many moves cross a wall."""
    found = 0
    for i in range(len(x)):
        found += crosses_wall(x[i], y[i], to_x[i], to_y[i], index)
    return found


def growing(scale: Scale) -> Iterator[Row]:
    """The same cloud in a plan of 100 walls and in one of a city's size; and opening that one."""
    work: list[Work] = []
    for walls in (offices(scale.city), offices(100)):
        work.append(partial(our_reading, Walls(walls, SLANT_RAD), *cloud(walls, scale.poses)))
    city = offices(scale.city)
    yield compared(
        f"weigh {scale.poses:,} poses among {len(city):,} walls; among 100", work[0], work[1], scale.rounds, 0.8
    )
    times = []
    for _ in range(min(scale.rounds, 5)):
        began = time.perf_counter()
        build_index(city)
        times.append(time.perf_counter() - began)
    yield Row(f"index of {len(city):,} walls; 2 s allowed", 2.0 / median(times), median(times), 2.0, 1.0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plan.json"
        level = {"name": "0", "height_m": 0, "walls": city.tolist(), "rooms": []}
        path.write_text(json.dumps({"echostep_plan": 1, "name": "city", "levels": [level]}))
        began = time.perf_counter()
        load_plan(path)
        took, bare = time.perf_counter() - began, _json_s(path)
        yield Row(f"plan.json of {len(city):,} walls; json.loads alone", bare / took, took, bare)


def _json_s(path: Path) -> float:
    began = time.perf_counter()
    json.loads(path.read_bytes())
    return time.perf_counter() - began


FIRST_FIX = """
import time
import numpy as np
from echostep.localization.echoes.likelihood import EchoSettings, echo_model
from echostep.localization.particles.kernels import ParticleArrays, Ping, reweight_by_ping
from echostep.walls.echo_sources import Walls
x = np.linspace(0.5, 3.5, 300)
index = Walls(np.array([[0.0, 0.0, 4.0, 0.0], [4.0, 0.0, 4.0, 3.0], [4.0, 3.0, 0.0, 3.0]])).near(x, x * 0.5)
cloud = ParticleArrays(x, x * 0.5, x * 0.1, np.ones(300), np.zeros(300))
reweight_by_ping(cloud, np.zeros(300), Ping(1.57, 1.2, 1.0, 0.1, 0.0, 0.5, 0.5), echo_model(EchoSettings()), index)
print(time.process_time())
"""


def starting(scale: Scale) -> Iterator[Row]:
    """Start-up, in processes of their own."""
    python = sys.executable
    helped, bare, fixed = [], [], []
    subprocess.run([python, "-c", FIRST_FIX], check=True, capture_output=True, timeout=300)  # fills numba's cache
    for _ in range(scale.rounds):
        helped.append(_cpu_s([python, "-m", "echostep", "--help"]))
        bare.append(_cpu_s([python, "-c", "pass"]))
        done = subprocess.run([python, "-c", FIRST_FIX], check=True, capture_output=True, text=True, timeout=300)
        fixed.append(float(done.stdout))
    more_s = median(helped) - median(bare)
    yield Row("echostep --help, CPU beyond bare python; 0.15 s allowed", 0.15 / more_s, more_s, 0.15, 1.0)
    yield Row("import, index and first weighing, CPU; 0.5 s allowed", 0.5 / median(fixed), median(fixed), 0.5, 1.0)


REPLAY = """
import sys
import time
from unittest import mock
from echostep.cli import app
from echostep.session import replay, results
from echostep.session.session import Session
def timed(owner, name):
    work = getattr(owner, name)
    def run(*given):
        began = time.process_time()
        done = work(*given)
        print(name, time.process_time() - began, time.process_time(), file=sys.stderr)
        return done
    return mock.patch.object(owner, name, run)
with timed(Session, "track"), timed(results, "_write_tables"):
    app(["replay", sys.argv[1], "--plan", sys.argv[2], "--headless", "--out", sys.argv[3]], standalone_mode=False)
"""


def replaying(scale: Scale) -> Iterator[Row]:
    """A replay of the demo's walk, in processes of their own: the tracking alone, and all until track.csv is there."""
    plan, python = str(files("echostep") / "plans" / "demo.json"), sys.executable
    with tempfile.TemporaryDirectory() as out:
        demo = [python, "-m", "echostep", "demo", "--headless", "--out", out]
        subprocess.run(demo, check=True, capture_output=True, timeout=3600)
        command = [python, "-c", REPLAY, f"{out}/walk.mcap", plan, f"{out}/replay"]
        runs = [
            subprocess.run(command, check=True, capture_output=True, text=True, timeout=900)
            for _ in range(scale.rounds + 1)
        ]
        with Path(out, "replay", "track.csv").open() as file:
            t_s = [float(row["t_s"]) for row in csv.DictReader(file)]
    took = [
        {name: (float(own), float(all_)) for name, own, all_ in map(str.split, run.stderr.splitlines())}
        for run in runs[1:]
    ]
    walk_s = t_s[-1] - t_s[0]
    tracked_s = median(one["track"][0] for one in took)
    yield Row(
        f"tracking of {walk_s:.0f} s, replayed; 600 times real time",
        walk_s / 600.0 / tracked_s,
        tracked_s,
        walk_s / 600.0,
        1.0,
    )
    whole_s = median(one["_write_tables"][1] for one in took)
    yield Row("replay of the demo to track.csv, CPU; 1.2 s allowed", 1.2 / whole_s, whole_s, 1.2, 1.0)


def _cpu_s(command: list[str]) -> float:
    """User and system time of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, timeout=60, env={**os.environ, "COLUMNS": "80"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def stepping(scale: Scale) -> Iterator[Row]:
    """The whole step of [Girard 2011] with its map, against other filters' updates without one, and against itself with rays."""
    try:
        from echostep_studies.papers import girard2011
    except ImportError:
        return
    walls = offices(scale.office)
    x, y, _ = cloud(walls, 1)

    def stepper(candidates: int) -> Work:
        settings = girard2011.GirardSettings(nu=max(candidates // 20, 1))
        filter_ = girard2011.Girard(
            settings, (float(x[0]), 12.5 * (y[0] // 12.5) + 6.25), walls, np.random.default_rng(1)
        )
        ahead = [1.0]

        def step() -> object:
            ahead[0] = -ahead[0]
            return filter_.step(1.25 * ahead[0], 0.0, 0.0, (1.2, 1.3))

        for _ in range(6):
            step()
        return step

    for name, update in MAPLESS.items():
        if name not in MISSING:
            yield compared(
                f"step of {scale.candidates:,} candidates; update of {name}, no map",
                stepper(scale.candidates),
                update(scale.candidates),
                scale.rounds,
                2.0,
            )
    step = stepper(3000)

    def with_rays() -> object:
        with mock.patch("echostep_studies.papers.girard2011.lambda_ray_ranges", plain_rays):
            return step()

    yield compared("step at nu = 150; the same by our own plain rays", step, with_rays, scale.rounds, 10.0)


def rows(scale: Scale) -> Iterator[Row]:
    """One row a comparison."""
    for part in (weighing, crossing, growing, starting, replaying, stepping):
        yield from part(scale)


def picture(found: list[Row], path: Path) -> None:
    """The ratios as bars, with what is promised."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(9, 0.45 * len(found) + 1.2), layout="constrained")
    axes.barh([r.name for r in found], [r.ratio for r in found], color="#4477aa")
    for k, row in enumerate(found):
        if row.wanted is not None:
            axes.plot([row.wanted, row.wanted], [k - 0.4, k + 0.4], color="#cc3311")
    axes.set(xscale="log", xlabel="times longer; red: promised")
    axes.invert_yaxis()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/bench"), metavar="DIR")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--tiny", action="store_true", help="a look at whether everything runs, in a small setting")
    options = parser.parse_args()
    scale = Scale(2, 200, 64, 2_000, 400) if options.tiny else Scale(options.rounds)
    table = Table("what; against what", "ours", "peer", "ratio", "promised", title="medians, rounds interleaved")
    found = []
    for row in rows(scale):
        found.append(row)
        wanted = "" if row.wanted is None else f">= {row.wanted:g}"
        table.add_row(
            row.name, f"{1e3 * row.median_s:.3g} ms", f"{1e3 * row.peer_s:.3g} ms", f"{row.ratio:.3g}", wanted
        )
    options.out.mkdir(parents=True, exist_ok=True)
    kept = [{k: v for k, v in asdict(row).items() if k != "wanted"} for row in found]
    (options.out / "bench.json").write_text(json.dumps(kept, indent=1) + "\n")
    picture(found, options.out / "bench.png")
    table.caption = "\n".join(["not compared:", *MISSING.values()]) if MISSING else None
    Console(width=None if sys.stdout.isatty() else 150).print(table)


if __name__ == "__main__":
    main()
