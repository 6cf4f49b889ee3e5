# SPDX-License-Identifier: MIT
"""Ranger models: the echo settings by the part that the board names.

In: the part in the rangers' places, the settings of the run. Out: `EchoSettings`. Owns the parts' figures.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import replace

from echostep.board.messages import Part
from echostep.echoes.likelihood import EchoSettings

# By part; an SRF02, and a part that no board has named, has the defaults. Not built yet: from data sheets.
ECHO_OF: Mapping[int, EchoSettings] = {
    # RCWL-1601, HC-SR04P [HC-SR04 user guide]: 2 to 450 cm; 6 dB down at 15 degrees each way, so 20 dB at the 27.5 degrees where an SRF02 has 6;
    # 3 mm of resolution: the trunk's sway, not the ranger, makes the error.
    Part.PULSE: EchoSettings(maximum_m=4.5, minimum_m=0.02, rim_db=20.0, sd_m=0.03),
    # I2CXL-MaxSonar-EZ0 [MaxBotix PD11848]: 25 to 765 cm in steps of 1 cm. Its beam is given in drawings; this is its transducer's, a piston of
    # 7.5 mm at 42 kHz (from memory): 9.5 dB down at 27.5 degrees each way.
    Part.MAXSONAR: EchoSettings(maximum_m=7.65, minimum_m=0.25, rim_db=9.5, sd_m=0.03),
}


def echo_of(part: int, wanted: EchoSettings) -> EchoSettings:
    """The settings of a part; a field of `wanted` that is not the default was set for this run and overrides the part's."""
    default = EchoSettings()
    names = [f.name for f in dataclasses.fields(EchoSettings)]
    chosen = {name: getattr(wanted, name) for name in names if getattr(wanted, name) != getattr(default, name)}
    return replace(ECHO_OF.get(part, default), **chosen)
