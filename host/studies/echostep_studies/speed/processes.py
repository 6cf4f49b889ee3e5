# SPDX-License-Identifier: MIT
"""Speed of whole programs, in processes of their own: start-up, first weighing, a replay.

In: a `Scale`. Out: `Row`s against what is allowed. Owns nothing.
"""

from __future__ import annotations

import csv
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from statistics import median

from echostep_studies.speed.against import cost
from echostep_studies.speed.comparison import Row, Scale

FIRST_FIX = """
import time
import numpy as np
from echostep.echoes.likelihood import EchoSettings, echo_model
from echostep.particles.arrays import ParticleArrays, PingBatch
from echostep.particles.kernels import begin_segment
from echostep.echoes.reweighting import no_crowds, reweight_by_ping
from echostep.walls.echo_sources import Walls
from echostep.walls.source_blocks import new_block
x = np.linspace(0.5, 3.5, 300)
index = Walls(np.array([[0.0, 0.0, 4.0, 0.0], [4.0, 0.0, 4.0, 3.0], [4.0, 3.0, 0.0, 3.0]])).near(x, x * 0.5)
cloud = ParticleArrays(x, x * 0.5, x * 0.1, np.ones(300), np.zeros(300))
values = (np.array([v]) for v in (1.0, 1.57, 1.2, 1.0, 0, 0.1, 0.3, 0.0, 0.5, 0.5))
pings, model = PingBatch(*values), echo_model(EchoSettings())
reweight_by_ping(cloud, begin_segment(cloud), np.zeros(300), pings, 0, model, 1.0, index, no_crowds(), new_block())
print(time.process_time())
"""


def starting(scale: Scale) -> Iterator[Row]:
    """Start-up, in processes of their own."""
    python = sys.executable
    helped, bare, fixed = [], [], []
    subprocess.run([python, "-c", FIRST_FIX], check=True, capture_output=True, timeout=300)  # fills numba's cache
    for _ in range(scale.rounds):
        helped.append(cost([python, "-m", "echostep", "--help"], {"COLUMNS": "80"})[0])
        bare.append(cost([python, "-c", "pass"], {})[0])
        done = subprocess.run([python, "-c", FIRST_FIX], check=True, capture_output=True, text=True, timeout=300)
        fixed.append(float(done.stdout))
    more_s = median(helped) - median(bare)
    yield Row("echostep --help, CPU beyond bare python; 0.15 s allowed", 0.15 / more_s, more_s, 0.15, 1.0)
    yield Row("import, index and first weighing, CPU; 0.5 s allowed", 0.5 / median(fixed), median(fixed), 0.5, 1.0)


REPLAY = """
import sys
import time
from unittest import mock
from echostep_app.cli import app
from echostep_app.session import results
from echostep_app.session.runs import replay
from echostep_app.session.session import Session
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
