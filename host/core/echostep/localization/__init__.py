# SPDX-License-Identifier: MIT
"""The particle filter on the plan: path and pings -> position.

In: `MeasuredSegment`s. Out: `Estimate`s: position, covariance, heading, status. Owns the particles.
The names below are its public interface; only studies and tests look behind it.
"""

from typing import TYPE_CHECKING

from echostep.additions import face

if TYPE_CHECKING:
    from echostep.localization.building import Building
    from echostep.localization.cloud_estimate import Right, estimate_of
    from echostep.localization.drawn_places import DrawnPlaces
    from echostep.localization.echoes.likelihood import (
        EchoModel,
        EchoSettings,
        echo_density,
        echo_model,
        likeliest_source,
        outlier_density,
        planned_density,
    )
    from echostep.localization.echoes.rangers import echo_of
    from echostep.localization.estimate import (
        CHI2_95,
        RISK,
        WALKER_M_S,
        Estimate,
        TrackStatus,
        claims_place,
        digest,
        ellipse95,
        in_ellipse95,
        trust,
        unobserved,
    )
    from echostep.localization.height.height_filter import RelativeHeight
    from echostep.localization.height.levels import (
        ClimbSettings,
        HeightChange,
        drift_m,
        level_change_model,
        pressure_cost,
    )
    from echostep.localization.limits import BELIEVED, PROBABLE, TRACKING_M
    from echostep.localization.map_filter import MapFilter, call_kernels
    from echostep.localization.particles.particles import Particles
    from echostep.localization.particles.places import LikelyPlace
    from echostep.localization.particles.start import ANY_LEVEL, STATED, Air, Start
    from echostep.localization.settings import CloudSettings, FilterSettings

__getattr__ = face(
    __name__,
    {
        "building": "Building",
        "cloud_estimate": "Right estimate_of",
        "drawn_places": "DrawnPlaces",
        "echoes.likelihood": "EchoModel EchoSettings echo_density echo_model likeliest_source outlier_density planned_density",
        "echoes.rangers": "echo_of",
        "estimate": "CHI2_95 RISK WALKER_M_S Estimate TrackStatus claims_place digest ellipse95 in_ellipse95 trust unobserved",
        "height.height_filter": "RelativeHeight",
        "height.levels": "ClimbSettings HeightChange drift_m level_change_model pressure_cost",
        "limits": "BELIEVED PROBABLE TRACKING_M",
        "map_filter": "MapFilter call_kernels",
        "particles.particles": "Particles",
        "particles.places": "LikelyPlace",
        "particles.start": "ANY_LEVEL STATED Air Start",
        "settings": "CloudSettings FilterSettings",
    },
)
