"""A connection to a broker, run by the thread that uses it.

In: an endpoint. Out: a connected client of paho, and its turns. Owns nothing. Every fault, also nonsense from the other side, is an OSError.
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

from echostep.team.endpoint import Endpoint

ANSWER_S = 5.0  # the broker's answers are waited for so long
KEEPALIVE_S = 6
LOOP_S = 0.05
MAX_PACKET = 65_536  # bytes; a broker of MQTT 5 sends us nothing longer
FAULTS = (OSError, ValueError, RuntimeError, struct.error, IndexError, AttributeError, TypeError, KeyError)


class RefusedError(ConnectionError):
    """Somebody is there, but no broker that speaks as we do or lets us in."""


def make_client(endpoint: Endpoint, tls: Any, identity: str, *, newest: bool = False) -> paho.Client:
    """A client that is not connected yet, of MQTT 3.1.1, or of the `newest`, MQTT 5."""
    protocol = paho.MQTTv5 if newest else paho.MQTTv311
    client = paho.Client(CallbackAPIVersion.VERSION2, identity, protocol=protocol, reconnect_on_failure=False)
    client.connect_timeout = ANSWER_S
    if endpoint.user is not None:
        client.username_pw_set(endpoint.user, endpoint.password)
    if tls is not None:
        client.tls_set_context(tls)
    return client


def connect(client: paho.Client, endpoint: Endpoint) -> None:
    """Connect and wait until the broker agrees; raises OSError, RefusedError when somebody is there."""
    refused: list[str] = []

    def answered(_client: paho.Client, _user: Any, _flags: Any, code: Any, _properties: Any) -> None:
        if code.is_failure:
            refused.append(str(code))

    client.on_connect = answered
    properties = None
    if client.protocol == paho.MQTTv5:
        properties = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
        properties.MaximumPacketSize = MAX_PACKET
    try:
        client.connect(endpoint.host, endpoint.port, keepalive=KEEPALIVE_S, properties=properties)
    except (OSError, ValueError) as error:
        raise ConnectionError((isinstance(error, OSError) and error.strerror) or str(error)) from error
    try:
        pump(client, lambda: client.is_connected() or bool(refused), "the broker does not answer")
    except OSError as error:
        raise RefusedError(refused[0] if refused else str(error)) from error
    if refused:
        raise RefusedError(f"the broker refuses: {refused[0]}")


def pump(client: paho.Client, done: Callable[[], bool], otherwise: str) -> None:
    """Run the connection until something is done; raises OSError when it breaks or takes too long."""
    end_s = time.monotonic() + ANSWER_S
    while not done():
        turn(client, LOOP_S)
        if time.monotonic() > end_s:
            raise TimeoutError(otherwise)


def turn(client: paho.Client, timeout_s: float) -> None:
    """Wait for the connection and run it once, which takes in one packet; raises OSError when it is broken."""
    try:
        code = client.loop(timeout_s)
    except OSError:
        raise
    except FAULTS as error:
        raise ConnectionError(f"the broker sends nonsense: {error}") from error
    if code != paho.MQTT_ERR_SUCCESS:
        raise ConnectionError(f"the connection broke: {paho.error_string(code)}")


def drop(client: paho.Client) -> None:
    """Close the socket without a word, whatever state it is in."""
    with suppress(*FAULTS):
        sock = client.socket()
        if sock is not None:
            sock.close()
