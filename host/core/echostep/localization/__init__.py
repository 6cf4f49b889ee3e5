# SPDX-License-Identifier: MIT
"""The particle filter on the plan: path and pings -> position.

In: `MeasuredSegment`s. Out: `Estimate`s: position, covariance, heading, status. Owns the particles.
The names below are its public interface; only its own tests look behind it.
"""

from typing import TYPE_CHECKING

from echostep.additions import face

if TYPE_CHECKING:
    from echostep.localization.building import Building
    from echostep.localization.estimate import Estimate, TrackStatus, digest
    from echostep.localization.map_filter import MapFilter
    from echostep.localization.particles.places import LikelyPlace
    from echostep.localization.particles.start import Start
    from echostep.localization.settings import CloudSettings, FilterSettings

__getattr__ = face(__name__)
