# SPDX-License-Identifier: MIT
"""A connection to a broker, run by the thread that uses it.

In: an endpoint. Out: a connected paho client. Owns nothing. Every fault is raised as an OSError, malformed packets of the broker included.
The version of MQTT, 5 or 3.1.1, is negotiated at each connection: a broker that does not answer has refused none.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from echostep_app.team.endpoint import Endpoint
from echostep_app.team.faults import CLIENT_REFUSAL, ENDED, PLAIN_ENDED, opening_words

ANSWER_S = 5.0  # longest wait for an answer of the broker
KEEPALIVE_S = 6  # the broker sends the last will after 1.5 times as long [MQTT 3.1.1, 3.1.2.10]
QOS_NOT_SUPPORTED = 155  # reason code [MQTT 5, 2.4]
LOOP_S = 0.05  # longest wait for a packet in one call of `run_once`
MAX_PACKET = 65_536  # bytes; a broker of MQTT 5 sends no longer packet than this
CLIENT_ERRORS = (  # what paho raises on broken connections and malformed packets
    OSError,
    ValueError,
    RuntimeError,
    struct.error,
    IndexError,
    AttributeError,
    TypeError,
    KeyError,
)


class RefusedError(ConnectionError):
    """The host answers, but it is no broker of this MQTT version, or it refuses the connection."""


class QosError(RefusedError):
    """The broker takes no message of this QoS [MQTT 5, 3.2.2.3.4]."""


class UnwantedError(PermissionError):
    """The broker does not accept a message under this topic."""


Prepare = Callable[[paho.Client, int], None]  # sets up a client for this QoS


def connected(endpoint: Endpoint, tls: Any, identity: str, prepare: Prepare) -> tuple[paho.Client, int]:
    """A connected client by the newest version of MQTT that the broker speaks, and the greatest QoS that it takes; raises OSError."""
    protocol, qos = paho.MQTTv5, 1
    while True:
        client = _client(endpoint, tls, identity, protocol)
        prepare(client, qos)
        try:
            return client, min(qos, connect(client, endpoint))
        except RefusedError as error:
            close_socket(client)
            if qos and isinstance(error, QosError):
                qos = 0
            elif protocol == paho.MQTTv5:
                protocol = paho.MQTTv311
            else:
                raise
        except OSError:
            close_socket(client)
            raise


def _client(endpoint: Endpoint, tls: Any, identity: str, protocol: Any) -> paho.Client:
    client = paho.Client(CallbackAPIVersion.VERSION2, identity, protocol=protocol, reconnect_on_failure=False)
    client.connect_timeout = ANSWER_S
    if endpoint.user is not None:
        client.username_pw_set(endpoint.user, endpoint.password)
    if tls is not None:
        client.tls_set_context(tls)
    return client


def connect(client: paho.Client, endpoint: Endpoint) -> int:
    """Connect and wait for the broker's acceptance; returns the greatest QoS that it takes, 0 or 1.

    Raises OSError, which is a RefusedError when the host answers, and a TimeoutError when the broker does not.
    """
    refused: list[Any] = []
    greatest = [1]

    def answered(_client: paho.Client, _user: Any, _flags: Any, code: Any, announced: Any) -> None:
        greatest[0] = min(getattr(announced, "MaximumQoS", 1), 1)
        if code.is_failure:
            refused.append(code)

    client.on_connect = answered
    properties = None
    if client.protocol == paho.MQTTv5:
        properties = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
        properties.MaximumPacketSize = MAX_PACKET
    try:
        client.connect(endpoint.host, endpoint.port, keepalive=KEEPALIVE_S, properties=properties)
    except (OSError, ValueError) as error:
        raise ConnectionError(opening_words(error, secure=endpoint.secure)) from error
    try:
        run_until(client, lambda: client.is_connected() or bool(refused), "the broker does not answer")
    except TimeoutError:
        raise
    except OSError as error:
        if not refused:
            ended = CLIENT_REFUSAL if endpoint.secure else PLAIN_ENDED
            raise RefusedError(ended if isinstance(error, ENDED) else str(error)) from error
    if refused:
        kind = QosError if refused[0].value == QOS_NOT_SUPPORTED else RefusedError
        raise kind(_refusal(endpoint, str(refused[0])))
    return greatest[0]


def _refusal(endpoint: Endpoint, reason: str) -> str:
    """A refusal of the broker, in its words, and for the usual ones what to do."""
    words = f"the broker refuses {user_words(endpoint)} ({reason})"
    is_of_user = any(part in reason.lower() for part in ("authori", "user name"))
    return f"{words}: check user and password, {endpoint.scheme}://USER:PASSWORD@HOST" if is_of_user else words


def user_words(endpoint: Endpoint) -> str:
    """A client's user in words."""
    return f"user {endpoint.user}" if endpoint.user else "a client without a user name"


def run_until(client: paho.Client, done: Callable[[], bool], timeout_message: str) -> None:
    """Run the connection until `done`; raises OSError when it breaks or when that takes longer than ANSWER_S."""
    end_s = time.monotonic() + ANSWER_S
    while not done():
        run_once(client, LOOP_S)
        if time.monotonic() > end_s:
            raise TimeoutError(timeout_message)


def run_once(client: paho.Client, timeout_s: float) -> None:
    """Wait for one packet, for at most `timeout_s`, and process it; raises OSError when the connection is broken."""
    try:
        code = client.loop(timeout_s)
    except OSError:
        raise
    except CLIENT_ERRORS as error:
        raise ConnectionError(f"the broker sends a malformed packet: {error}") from error
    if code != paho.MQTT_ERR_SUCCESS:
        raise ConnectionResetError(f"the connection broke: {paho.error_string(code)}")


def publish(client: paho.Client, topic: str, payload: bytes, qos: int = 1) -> bool:
    """Publish a message that the broker keeps, and wait for its answer; returns whether the answer says that the message was accepted.

    By QoS 0 there is no answer, and a broker of MQTT 3.1.1 cannot say so [MQTT 3.1.1, 3.3.5]. Raises OSError, which is an UnwantedError when the
    broker refuses the message.
    """
    answers: dict[int, Any] = {}
    client.on_publish = lambda _client, _user, number, code, _properties: answers.update({number: code})
    try:
        info = client.publish(topic, payload, qos=qos, retain=True)
        run_until(client, info.is_published, "the broker does not acknowledge")
    except (ValueError, RuntimeError) as error:
        raise ConnectionError(f"cannot publish: {error}") from error
    answer = answers.get(info.mid)
    if answer is not None and answer.is_failure:
        raise UnwantedError(f"{answer}")
    return qos > 0 and client.protocol == paho.MQTTv5


def probe(client: paho.Client) -> None:
    """Wait for any answer of the broker: to the end of a subscription that there is not [MQTT 3.1.1, 3.10.4]; raises OSError."""
    answers: list[Any] = []
    client.on_unsubscribe = lambda *answer: answers.append(answer)
    client.unsubscribe("echostep-probe")
    run_until(client, lambda: bool(answers), "the broker does not answer")


def close_socket(client: paho.Client) -> None:
    """Close the socket without a disconnect packet, in any state."""
    with suppress(*CLIENT_ERRORS):
        sock = client.socket()
        if sock is not None:
            sock.close()
