# SPDX-License-Identifier: MIT
"""One sentence about each simulated effect, for the table.

In: `Effect`s. Out: text. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from echostep_studies.echoes.effects import Effect


def _half_heard(effect: Effect) -> str:
    share = np.array([np.mean(~np.isnan(h.range_m)) for h in effect.heard])
    lost = effect.heard[int(np.argmax(share < 0.5))].place
    return f"half of the echoes are lost at {lost:.0f} degrees"


def _post_heard(effect: Effect) -> str:
    near = [h.place for h in effect.heard if np.nanmedian(h.range_m) < h.place + 0.3]
    return f"a thin post is heard up to {max(near, default=0.0):.1f} m, the wall behind it at 3 m"


def _detour(effect: Effect) -> str:
    medians = [(h.place, float(np.nanmedian(h.range_m))) for h in effect.heard if np.mean(~np.isnan(h.range_m)) > 0.5]
    far = [(angle, z) for angle, z in medians if z > 1.2]
    if not far:
        return "no echo by two walls"
    return f"beyond {far[0][0]:.0f} degrees {far[0][1]:.1f} m are reported, the wall is at 1.0 m"


def _limits(effect: Effect) -> str:
    received = [h for h in effect.heard if np.mean(~np.isnan(h.range_m)) > 0.5]
    return f"between {np.nanmin(received[0].range_m):.2f} m and {received[-1].place:.2f} m"


def _signature(effect: Effect) -> str:
    medians = np.array([np.nanmedian(h.range_m) for h in effect.heard])
    return f"an open door lengthens the range by {np.max(medians[medians < 2.5]) - np.min(medians):.2f} m before its frame is passed"


FINDINGS: dict[str, Callable[[Effect], str]] = {
    "incidence": _half_heard, "near and far": _post_heard, "oblique": _detour, "limits": _limits, "door frames": _signature,
}  # fmt: skip
