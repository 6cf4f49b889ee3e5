# SPDX-License-Identifier: MIT
"""Attitudes as matrices and quaternions.

In: roll, pitch, yaw, or rotation matrices. Out: the other form. Owns nothing.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats


def rotations(rpy: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) body -> map of roll, pitch, yaw (n, 3): yaw about z, then pitch about y, then roll about x."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy).T, np.sin(rpy).T
    return np.stack(
        [
            np.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], -1),
            np.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], -1),
            np.stack([-sp, cp * sr, cp * cr], -1),
        ],
        axis=1,
    )


def turns(r: Floats) -> Floats:
    """Rotation vectors (n - 1, 3), in the body, from each of the attitudes (n, 3, 3) to the next; less than 90 degrees each."""
    step = np.einsum("nji,njk->nik", r[:-1], r[1:])
    sine = 0.5 * np.stack(
        [step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0], step[:, 1, 0] - step[:, 0, 1]], 1
    )
    size = np.linalg.norm(sine, axis=1)
    vectors: Floats = (
        sine * np.where(size < 1e-9, 1.0, np.arcsin(np.minimum(size, 1.0)) / np.maximum(size, 1e-9))[:, None]
    )
    return vectors


def quaternions(r: Floats) -> Floats:
    """Unit quaternions (n, 4), w x y z, of rotation matrices (n, 3, 3) [Shepperd 1978]."""
    trace = r[:, 0, 0] + r[:, 1, 1] + r[:, 2, 2]
    squares = np.stack([trace, *(2.0 * r[:, i, i] - trace for i in range(3))], axis=1)
    a, b, c = r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]
    d, e, f = r[:, 0, 1] + r[:, 1, 0], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 2] + r[:, 2, 1]
    columns = np.stack(
        [
            np.stack([1.0 + trace, a, b, c], -1),
            np.stack([a, 1.0 + squares[:, 1], d, e], -1),
            np.stack([b, d, 1.0 + squares[:, 2], f], -1),
            np.stack([c, e, f, 1.0 + squares[:, 3]], -1),
        ],
        axis=1,
    )
    wxyz = columns[np.arange(len(r)), squares.argmax(1)]
    return wxyz / np.linalg.norm(wxyz, axis=1, keepdims=True)
