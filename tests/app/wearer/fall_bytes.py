# SPDX-License-Identifier: MIT
"""A simulated fall as the bytes of an MTx and of a board with six axes, which the tracker takes."""

from __future__ import annotations

import numpy as np

from echostep.board.calibration import LSM6DSO_M_S2, LSM6DSO_RAD_S
from echostep.board.frames import encode
from echostep.board.messages import Motion
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep.timing.timeline import TICKS_PER_S
from echostep.xsens import MTDATA, MtSample, encode_frame, pack_mtdata
from echostep_studies.simulation.falling import BodySamples

BEGIN_NS = 1_000_000_000


def fall_chunks(samples: BodySamples, *, belt: bool) -> list[Chunk]:
    """Both ports in order of arrival; without `belt` the board sends its belt's axes as not measured."""
    found: list[tuple[float, Chunk]] = []
    foot = samples.foot
    for k, (t_s, force, rate) in enumerate(zip(foot.t_s, foot.force, foot.rate, strict=True)):
        sample = MtSample(k & 0xFFFF, tuple(force), tuple(rate), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        found.append((t_s + 0.009, Chunk(MTX, _ns(t_s + 0.009), encode_frame(MTDATA, pack_mtdata(sample)))))
    rates, forces = ([getattr(s, of) for s in (samples.thigh, samples.belt)] for of in ("rate", "force"))
    invalid = np.full(3, -32768)
    for k, t_s in enumerate(samples.belt.t_s.tolist()):
        thigh, trunk = (
            np.r_[np.rint(rate[k] / LSM6DSO_RAD_S), np.rint(force[k] / LSM6DSO_M_S2)].clip(-32767, 32767)
            for rate, force in zip(rates, forces, strict=True)
        )
        counts = np.r_[thigh, invalid, invalid, trunk] if belt else np.full(18, -32768)
        message = Motion(round(t_s * TICKS_PER_S) & 0xFFFFFFFF, *counts.astype(int).tolist())
        found.append((t_s + 0.002, Chunk(BOARD, _ns(t_s + 0.002), encode(message, k & 0xFF))))
    return [chunk for _, chunk in sorted(found, key=lambda pair: pair[0])]


def _ns(t_s: float) -> int:
    return BEGIN_NS + round(t_s * 1e9)
