# SPDX-License-Identifier: MIT
"""How many particles a cloud keeps, and which.

In: arrays of n particles. Out: a number, indices, log-weights. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.localization.settings import CloudSettings

# Until a cloud is gathered, particles in one cell of these sizes are one mode: a doorway, a turn into a room
MODE_M, MODE_RAD = 2.0, math.radians(45.0)
LEAST_MODE = 1e-3  # weight below which a mode's particles become fewer in proportion, assumed
MOST_MODES = 1_000_000  # cells beyond which modes are not distinguished: memory
KLD_QUANTILE = 2.33  # z of 99 % [Fox 2003, eq. 7]


def log_mode_weight(x_m: Floats, y_m: Floats, turn_rad: Floats, weight: Floats) -> Floats:
    """Log of the weight (n,) of all particles in the same cell of MODE_M, MODE_M and MODE_RAD; at least LEAST_MODE."""
    east, north = np.floor((x_m - x_m.min()) / MODE_M), np.floor((y_m - y_m.min()) / MODE_M)
    sectors = round(2.0 * math.pi / MODE_RAD)
    sector = np.floor(turn_rad / MODE_RAD).astype(np.int64) % sectors
    columns, rows = int(east.max()) + 1, int(north.max()) + 1
    if columns * rows > MOST_MODES:
        return np.zeros(len(x_m))
    cell = (east.astype(np.int64) * rows + north.astype(np.int64)) * sectors + sector
    mass = np.bincount(cell, weight)
    return np.log(np.maximum(mass, LEAST_MODE))[cell]


def kld_size(x_m: Floats, y_m: Floats, turn_rad: Floats, settings: CloudSettings) -> int:
    """Size for the spread of particles (n,), from the number of cells that hold some [Fox 2003, eq. 7]; 0 where all are in one."""
    cells = np.floor(x_m / settings.cell_m)
    cells += 1e6 * np.floor(y_m / settings.cell_m)
    cells += 1e12 * np.floor(turn_rad / math.radians(settings.cell_deg))
    cells.sort()
    k = np.count_nonzero(cells[1:] != cells[:-1])
    if k < 1:
        return 0
    part = 2.0 / (9.0 * k)
    return int(k / (2.0 * settings.kld) * (1.0 - part + math.sqrt(part) * KLD_QUANTILE) ** 3)
