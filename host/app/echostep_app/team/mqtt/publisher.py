# SPDX-License-Identifier: MIT
"""MQTT: sends reports to a broker, and receives a team's reports.

In: reports; or an endpoint to subscribe at. Out: messages on `echostep/<team>/<wearer>/estimate` (retained, QoS 1: a commander that
connects late gets the last report) and `.../presence` (retained, with a last will); or the messages of the broker. Owns one connection,
used by one thread. The thread and the queue of paho are not used, because that queue would keep outdated reports.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import paho.mqtt.client as paho

from echostep_app.team.endpoint import Endpoint
from echostep_app.team.messages.report import Presence, Report, encode
from echostep_app.team.mqtt.broker import (
    CLIENT_ERRORS,
    LOOP_S,
    UnwantedError,
    close_socket,
    connected,
    probe,
    publish,
    run_once,
    run_until,
    user_words,
)
from echostep_app.team.outbox import Delivery
from echostep_app.team.tls import tls_context


class MqttTransport:
    """A `Transport` to a broker; when the connection breaks, the broker publishes the presence `broken`."""

    def __init__(self, endpoint: Endpoint, team: str, name: str, run: str) -> None:
        self._endpoint, self._run, self._team, self._name = endpoint, run, team, name
        self._topic = f"echostep/{team}/{name}"
        self._qos = 1
        self._tls = tls_context(endpoint) if endpoint.secure else None
        self._client: paho.Client | None = None

    def open(self) -> None:
        """Connect; raises OSError with the broker's reason."""
        identity = f"echostep-{self._run}-{time.monotonic_ns() & 0xFFFFFF:06x}"

        def leave_will(client: paho.Client, qos: int) -> None:
            client.will_set(f"{self._topic}/presence", self._presence("broken"), qos=qos, retain=True)

        self._client, self._qos = connected(self._endpoint, self._tls, identity, leave_will)
        self._publish("presence", self._presence("online"))

    def send(self, report: Report) -> Delivery:
        """Publish and wait for the broker's answer."""
        return Delivery.ACKNOWLEDGED if self._publish("estimate", encode(report)) else Delivery.SENT

    def close(self, *, ended: bool) -> None:
        """Disconnect; unless the run has `ended`, the broker publishes the last will."""
        client, self._client = self._client, None
        if client is None:
            return
        try:
            if ended and client.is_connected():
                self._client = client
                self._publish("presence", self._presence("ended"))
                client.disconnect()
                client.loop(LOOP_S)
        except CLIENT_ERRORS:
            pass
        finally:
            self._client = None
            close_socket(client)

    def _presence(self, presence: Any) -> bytes:
        return encode(Presence(1, self._run, presence))

    def _publish(self, leaf: str, payload: bytes) -> bool:
        """Publish below this wearer's topic; returns whether the broker says that it accepted the message."""
        if self._client is None:
            raise ConnectionError("not connected")
        try:
            return publish(self._client, f"{self._topic}/{leaf}", payload, self._qos)
        except UnwantedError as error:
            raise UnwantedError(
                f"the broker does not let {user_words(self._endpoint)} publish as {self._team}/{self._name} ({error}): "
                "check --team, --name and the broker's access rules"
            ) from error


class Listener:
    """A subscription: `run_once` runs the connection and passes each message to `put(topic, payload, retained)`."""

    def __init__(
        self, endpoint: Endpoint, topics: Sequence[str], put: Callable[[str | None, bytes, bool], None]
    ) -> None:
        self._endpoint, self._topics, self._put = endpoint, topics, put
        self._tls = tls_context(endpoint) if endpoint.secure else None
        self._client: paho.Client | None = None
        self._qos = 1

    def open(self) -> str:
        """Connect and subscribe; returns which topics the broker refuses, in words; raises OSError, also when it refuses all."""

        def listen(client: paho.Client, _qos: int) -> None:
            client.on_message = self._message

        self._client, self._qos = connected(self._endpoint, self._tls, "", listen)
        client = self._client
        answers: list[list[bool]] = []  # whether each topic is refused
        client.on_subscribe = lambda _c, _u, _m, codes, _p: answers.append([code.is_failure for code in codes])
        client.subscribe([(topic, 0) for topic in self._topics])
        run_until(client, lambda: bool(answers), "the broker does not answer")
        refused = [topic for topic, is_refused in zip(self._topics, answers[0], strict=False) if is_refused]
        if not refused:
            return ""
        words = f"the broker refuses {user_words(self._endpoint)} the subscription to {', '.join(refused)}: check its access rules, and the user"
        if len(refused) == len(self._topics):
            raise ConnectionError(words)
        return words

    def run_once(self, timeout_s: float) -> None:
        """Wait for one packet and process it; raises OSError when the connection is broken."""
        if self._client is None:
            raise ConnectionError("not connected")
        run_once(self._client, timeout_s)

    def probe(self) -> None:
        """Wait for an answer of the broker; raises OSError."""
        if self._client is None:
            raise ConnectionError("not connected")
        probe(self._client)

    def publish(self, topic: str, payload: bytes) -> None:
        """Publish a message that the broker keeps, and wait for its answer; raises OSError."""
        if self._client is None:
            raise ConnectionError("not connected")
        publish(self._client, topic, payload, self._qos)

    def close(self) -> None:
        """Disconnect; raises nothing."""
        client, self._client = self._client, None
        if client is not None:
            with suppress(*CLIENT_ERRORS):
                client.disconnect()
            close_socket(client)

    def _message(self, _client: paho.Client, _user: Any, message: paho.MQTTMessage) -> None:
        try:
            topic: str | None = message.topic
        except UnicodeDecodeError:
            topic = None
        self._put(topic, bytes(message.payload), bool(message.retain))
