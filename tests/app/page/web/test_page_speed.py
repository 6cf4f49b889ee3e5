# SPDX-License-Identifier: MIT
"""Measurements of the live page in Chromium (`make page-speed`): printed, not judged, since they depend on the machine's load."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from echostep_app.page.elements.scene import ParticleSample
from echostep_app.page.mailbox import Mailbox
from page.browser import Walk, looking
from page.frames import scene, served


@pytest.mark.speed
def test_latency_from_a_step_to_the_pixel(browser: Any) -> None:
    """Time from the landing of the foot to its bytes (data time), and from there to the drawn frame (wall clock)."""
    with Walk(20.0, 3.0) as walk, looking(browser, walk.page.url, "dark") as page:
        for _ in range(5):
            for session in walk.page.server.sessions:
                session.latency_s.clear()
            time.sleep(4.0)
            (drawn_s,) = [np.array(session.latency_s) for session in walk.page.server.sessions]
            arrived_s = np.array(walk.told_s)
            assert len(drawn_s) > 8
            assert len(arrived_s) > 15
            print(
                f"95 %: known {1e3 * np.percentile(arrived_s, 95):.0f} ms after landing, "
                f"drawn {1e3 * np.percentile(drawn_s, 95):.0f} ms later"
            )
        assert not page.wrong


@pytest.mark.speed
def test_frame_rate_with_ten_thousand_particles(browser: Any) -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        page = looking(browser, server.url, "dark")
        rates_hz = [frame_rate(page, mailbox) for _ in range(5)]
        assert page.evaluate("echostep.scene.cloud.count") == 10_000
        page.context.close()
    print("with 10,000 particles, frames/s:", ", ".join(f"{rate_hz:.1f}" for rate_hz in rates_hz))


def frame_rate(page: Any, mailbox: Mailbox, span_s: float = 2.0) -> float:
    """Frames that a page draws in a second while the mailbox has a new cloud sixty times a second."""
    rng = np.random.default_rng(0)
    began, frames, k = time.monotonic(), page.evaluate("echostep.frames"), 0
    while (now := time.monotonic()) - began < span_s:
        x, y = (rng.normal(v, 1.0, 10_000).astype(np.float32) for v in (12.0, 7.0))
        crowd = ParticleSample(x, y, rng.integers(0, 256, 10_000).astype(np.uint8), np.zeros(10_000, np.uint8))
        mailbox.publish(replace(scene(now), particles=crowd))
        k += 1
        time.sleep(max(began + k / 60.0 - time.monotonic(), 0.0))
    drawn = page.evaluate("echostep.frames") - frames
    return float(drawn / (time.monotonic() - began))
