# SPDX-License-Identifier: MIT
"""CARMEN logs of a made building: two rooms joined by a corridor, a cupboard, a lap through all of it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from echostep.arrays import Floats

WALLS = np.array(
    [
        (0.0, 0.0, 12.0, 0.0), (12.0, 0.0, 12.0, 8.0), (12.0, 8.0, 0.0, 8.0), (0.0, 8.0, 0.0, 0.0),
        (0.0, 3.0, 3.0, 3.0), (4.2, 3.0, 8.0, 3.0), (9.2, 3.0, 12.0, 3.0), (6.0, 3.0, 6.0, 8.0),
    ]
)  # fmt: skip
CUPBOARD = np.array([(1.0, 6.8, 1.8, 6.8), (1.8, 6.8, 1.8, 7.4), (1.8, 7.4, 1.0, 7.4), (1.0, 7.4, 1.0, 6.8)])
CORNERS = np.array([(1.5, 1.5), (3.6, 1.5), (3.6, 5.5), (3.6, 1.5), (8.6, 1.5), (8.6, 5.5), (8.6, 1.5), (1.5, 1.5)])
BEAMS = 181
FAR_M = 81.9


def poses(laps: int = 2, step_m: float = 0.25) -> Floats:
    """A pose (n, 3) each `step_m` along the lap, and turns on the spot."""
    found = []
    for a, b in [pair for _ in range(laps) for pair in zip(CORNERS, CORNERS[1:], strict=False)]:
        heading, length = math.atan2(b[1] - a[1], b[0] - a[0]), float(np.hypot(*(b - a)))
        for s in np.arange(0.0, length, step_m):
            at = a + (b - a) * s / length
            found.append((at[0], at[1], heading))
    return np.array(found)


def ranges(pose: Floats, walls: Floats) -> Floats:
    """Distances (BEAMS,) to the nearest wall, by each beam from right to left."""
    angle = pose[2] + np.radians(np.arange(BEAMS) - 90.0)
    d = np.column_stack([np.cos(angle), np.sin(angle)])
    p, along = walls[:, :2] - pose[:2], walls[:, 2:] - walls[:, :2]
    cross = d[:, :1] * along[:, 1] - d[:, 1:] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (p[:, 0] * along[:, 1] - p[:, 1] * along[:, 0]) / cross
        u = (p[:, 0] * d[:, 1:] - p[:, 1] * d[:, :1]) / cross
    t = np.where((t > 0.0) & (u >= 0.0) & (u <= 1.0), t, FAR_M)
    return t.min(1)


def write_log(path: Path, walls: Floats, *, drifting: bool = False, late: bool = False) -> None:
    """A log of the lap; `drifting`: the odometry turns 1 degree too far each scan; `late`: it belongs to the scan 3 before."""
    all_poses, lines = poses(), ["PARAM robot_frontlaser_offset 0.0 nohost 0"]
    for k, pose in enumerate(all_poses):
        scan = " ".join(f"{r:.3f}" for r in ranges(pose, walls))
        x, y, theta = pose.tolist()
        lines.append(f"FLASER {BEAMS} {scan} {x:.5f} {y:.5f} {theta:.5f} {x:.5f} {y:.5f} {theta:.5f} {k} pippo {k}")
        lines.append(f"ODOM {x:.5f} {y:.5f} {theta:.5f} 0 0 0 0 pippo 0")
        from_pose, to_pose = (
            all_poses[max(k - 3, 0) if late else k],
            all_poses[min(max(k - 2, 0) if late else k + 1, len(all_poses) - 1)],
        )
        turn = to_pose[2] - from_pose[2] + (math.radians(1.0) if drifting else 0.0)
        ahead = math.hypot(*(to_pose[:2] - from_pose[:2]))
        for share in (0.5, 1.0):
            at = (x + share * ahead * math.cos(theta), y + share * ahead * math.sin(theta), theta + share * turn)
            lines.append(f"ODOM {at[0]:.5f} {at[1]:.5f} {at[2]:.5f} 0 0 0 {k + share} pippo {k + share}")
    path.write_text("\n".join(lines) + "\n")
