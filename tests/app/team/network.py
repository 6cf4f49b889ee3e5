# SPDX-License-Identifier: MIT
"""Outboxes on a real network."""

from __future__ import annotations

from dataclasses import replace

from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.messages.report import Report
from echostep_app.team.mqtt.publisher import MqttTransport
from echostep_app.team.outbox import Outbox
from team.team_reports import POSITION, report


def at(t_s: float, name: str = "anna") -> Report:
    return report(name, position=replace(POSITION, t_s=t_s))


def box_to(url: str, words: list[str] | None = None, name: str = "anna", run: str = "0123abcd") -> Outbox:
    said: list[str] = [] if words is None else words
    endpoint = parse_endpoint(url)
    return Outbox(MqttTransport(endpoint, "red", name, run), str(endpoint), said.append)
