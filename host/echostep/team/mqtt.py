"""MQTT: reports to a broker, and reports of others from it.

In: reports, or an endpoint to listen to. Out: messages on `echostep/<team>/<wearer>/estimate` (retained, QoS 1: a late commander sees the last known
place) and `.../presence` (retained, with a last will); or what the broker brings. Owns one connection, used by one thread: paho's own thread and its
queue are not used, for they would keep old estimates.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import paho.mqtt.client as paho

from echostep.team.broker import FAULTS, LOOP_S, RefusedError, connect, drop, make_client, pump, turn
from echostep.team.endpoint import Endpoint, tls_context
from echostep.team.report import Presence, Report, encode


class MqttLine:
    """A `Line` to a broker; a presence is left behind when it breaks."""

    def __init__(self, endpoint: Endpoint, team: str, name: str, run: str) -> None:
        self._endpoint, self._run = endpoint, run
        self._topic = f"echostep/{team}/{name}"
        self._tls = tls_context(endpoint) if endpoint.secure else None
        self._client: paho.Client | None = None

    def open(self) -> None:
        """Connect; raises OSError with the broker's reason."""
        client = make_client(self._endpoint, self._tls, f"echostep-{self._run}-{time.monotonic_ns() & 0xFFFFFF:06x}")
        client.will_set(f"{self._topic}/presence", self._presence("broken"), qos=1, retain=True)
        self._client = client
        connect(client, self._endpoint)
        self._publish("presence", self._presence("online"))

    def send(self, report: Report) -> None:
        """Publish and wait for the broker's acknowledgement."""
        self._publish("estimate", encode(report))

    def close(self, *, ended: bool) -> None:
        """Disconnect; without an end the broker tells the last will."""
        client, self._client = self._client, None
        if client is None:
            return
        try:
            if ended and client.is_connected():
                self._client = client
                self._publish("presence", self._presence("ended"))
                client.disconnect()
                client.loop(LOOP_S)
        except FAULTS:
            pass
        finally:
            self._client = None
            drop(client)

    def _presence(self, presence: Any) -> bytes:
        return encode(Presence(1, self._run, presence))

    def _publish(self, leaf: str, payload: bytes) -> None:
        client = self._client
        if client is None:
            raise ConnectionError("not connected")
        try:
            info = client.publish(f"{self._topic}/{leaf}", payload, qos=1, retain=True)
            pump(client, info.is_published, "the broker does not acknowledge")
        except (ValueError, RuntimeError) as error:
            raise ConnectionError(f"cannot publish: {error}") from error


class Listener:
    """What a broker brings: `turn` runs the connection and hands every message to `hear(topic, payload, retained)`."""

    def __init__(self, endpoint: Endpoint, topic: str, hear: Callable[[str | None, bytes, bool], None]) -> None:
        self._endpoint, self._topic, self._hear = endpoint, topic, hear
        self._tls = tls_context(endpoint) if endpoint.secure else None
        self._client: paho.Client | None = None
        self._newest = True

    def open(self) -> None:
        """Connect and subscribe; raises OSError. A broker that knows no MQTT 5 is asked in MQTT 3.1.1 the next time."""
        client = make_client(self._endpoint, self._tls, "", newest=self._newest)
        client.on_message = self._message
        self._client = client
        try:
            connect(client, self._endpoint)
        except RefusedError:
            self._newest = not self._newest
            raise
        subscribed: list[bool] = []
        client.on_subscribe = lambda _c, _u, _m, codes, _p: subscribed.append(not codes[0].is_failure)
        client.subscribe(self._topic, qos=0)
        pump(client, lambda: bool(subscribed), "the broker does not answer")
        if not subscribed[0]:
            raise ConnectionError(f"the broker does not let us read {self._topic}")

    def turn(self, timeout_s: float) -> None:
        """Bring what has come; raises OSError when the connection is broken."""
        if self._client is None:
            raise ConnectionError("not connected")
        turn(self._client, timeout_s)

    def close(self) -> None:
        """End the connection; raises nothing."""
        client, self._client = self._client, None
        if client is not None:
            with suppress(*FAULTS):
                client.disconnect()
            drop(client)

    def _message(self, _client: paho.Client, _user: Any, message: paho.MQTTMessage) -> None:
        try:
            topic: str | None = message.topic
        except UnicodeDecodeError:
            topic = None
        self._hear(topic, bytes(message.payload), bool(message.retain))
