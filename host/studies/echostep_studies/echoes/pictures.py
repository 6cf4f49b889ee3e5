# SPDX-License-Identifier: MIT
"""The picture of what rangers hear: a panel an effect [Girard 2011, Figures 1-5].

In: effects. Out: a PNG. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echostep.localization import EchoSettings, echo_model
from echostep.walls.echo_sources import Walls
from echostep_app.simulation.world.acoustics import SRF02, directivity_db
from echostep_studies.echoes.effects import Effect, pipe_range_m
from echostep_studies.echoes.likelihood import log_p
from echostep_studies.frame.pictures import BLUE, GREEN, ORANGE, RED, axes_of, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RANGES_M = np.arange(0.0, 6.02, 0.02)


def draw_effects(path: Path, effects: Sequence[Effect]) -> None:
    """Received ranges (dots), predicted density (grey), and share of the pings with an echo (line)."""
    figure, axes = axes_of(4, 2, (13.0, 15.0))
    panels = [ax for row in axes for ax in row]
    _cone(panels[0], panels[1])
    for ax, effect in zip(panels[2:], effects, strict=False):
        _effect(ax, effect)
    for ax in panels[2 + len(effects) :]:
        ax.set_axis_off()
    figure.suptitle("Simulated rangers: the effects of Girard et al. 2011, Figures 1-5")
    save(figure, path)


def _effect(ax: Axes, effect: Effect) -> None:
    plan, model = Walls(effect.plan), echo_model(EchoSettings())
    places = np.array([h.place for h in effect.heard])
    expected = np.array([np.exp(log_p(plan, h.pose, RANGES_M[1:], model)) for h in effect.heard])
    ax.pcolormesh(places, RANGES_M[1:], np.sqrt(expected.T), cmap="Greys", shading="nearest", rasterized=True)
    for h in effect.heard:
        ranges_m = h.range_m[~np.isnan(h.range_m)][:20]
        ax.plot(np.full(len(ranges_m), h.place), ranges_m, ".", color=BLUE, ms=2.5)
    ax.plot([], [], ".", color=BLUE, label="ranges heard")
    ax.plot([], [], "s", color="0.6", label="expected by the likelihood")
    top = 6.5 if max(np.nanmax(h.range_m, initial=0.0) for h in effect.heard) > 3.2 else 3.4
    ax.set(title=effect.name, xlabel=effect.axis, ylabel="range, m", ylim=(0.0, top), xlim=(places[0], places[-1]))
    share = ax.twinx()
    share.plot(places, [float(np.mean(~np.isnan(h.range_m))) for h in effect.heard], color=ORANGE, lw=1.5)
    silent = [1.0 - float(np.exp(log_p(plan, h.pose, np.array([np.nan]), model)[0])) for h in effect.heard]
    share.plot(places, silent, color=RED, lw=1.2, ls="--")
    ax.plot([], [], color=ORANGE, label="share heard")
    ax.plot([], [], color=RED, ls="--", label="share expected")
    share.set(ylim=(0.0, 1.08), ylabel="share of pings heard")
    ax.legend(fontsize=7, loc="upper left")


def _cone(levels: Axes, pipe: Axes) -> None:
    """[Girard 2011, Figure 2]: the angular response in dB, and how far a 55 mm pipe is heard."""
    degrees = np.arange(-45.0, 45.5, 0.5)
    levels.plot(degrees, [directivity_db(math.radians(abs(float(d))), SRF02.size) for d in degrees], color=BLUE)
    levels.axhline(-6.0, color="0.6", lw=0.8)
    for edge in (-27.5, 27.5):
        levels.axvline(edge, color="0.6", lw=0.8)
    levels.set(title="angular response, one way", xlabel="angle off the axis, degrees", ylabel="dB", ylim=(-30.0, 1.0))
    angles = np.arange(-45.0, 46.0, 1.0)
    reach = np.array([pipe_range_m(math.radians(abs(float(d)))) for d in angles])
    pipe.plot(reach * np.sin(np.radians(angles)), reach * np.cos(np.radians(angles)), color=GREEN, marker=".", ms=3)
    pipe.plot(0.0, 0.0, "s", color=RED)
    pipe.set(title="a 55 mm pipe is heard within", xlabel="across, m", ylabel="ahead, m", aspect="equal")
