# SPDX-License-Identifier: MIT
"""The derived messages of a run, live, to Foxglove and other viewers of its WebSocket protocol.

In: derived messages. Out: the same channels, schemas and bodies as in a recording [Foxglove, ws-protocol], to each viewer. Owns the server,
by Foxglove's SDK.
A viewer that comes late gets plan and track at the next message: the newest version of each drawn thing is kept. A viewer that is too slow loses its
oldest messages; nothing waits for the server.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from echostep.errors import EchostepError
from echostep_app.extras import require
from echostep_app.output.derived import TOPICS
from echostep_app.output.foxglove import FRAME, LOCATION, POSE, SCENE
from echostep_app.recording.recorder import DerivedMessage, Topic

if TYPE_CHECKING:
    from foxglove import Channel

LOCAL = "127.0.0.1"
ALL_TOPICS = (*TOPICS, POSE, FRAME, SCENE, LOCATION)
BACKLOG = 256  # messages that may wait for one viewer: some seconds
END_S = 1.0  # for the last bytes to viewers; assumed


@dataclass(frozen=True, slots=True)
class FoxgloveAddress:
    """Where the server listens; port 0: any free one."""

    host: str
    port: int


def parse_address(text: str) -> FoxgloveAddress:
    """`PORT`, `HOST:PORT` or `[V6]:PORT`; without a host, this computer alone. Raises EchostepError."""
    host, _, port = text.rpartition(":")
    if not (port.isascii() and port.isdigit() and int(port) <= 65535):
        raise EchostepError(f"--foxglove {text}: expected a port, as 8765, or HOST:PORT")
    return FoxgloveAddress(host.strip("[]") or LOCAL, int(port))


class FoxgloveServer:
    """Serves while it is entered; `write` never waits for a viewer."""

    def __init__(self, address: FoxgloveAddress, title: str) -> None:
        """Raises EchostepError when foxglove-sdk is not installed, or when the address cannot be used."""
        require("--foxglove", "foxglove")
        import foxglove

        self._context = context = foxglove.Context()  # the server alone does not keep it
        self._channels = {topic.name: _channel(topic, context) for topic in ALL_TOPICS}
        self._drawn: dict[str, Any] = {}  # newest entity of the scene by its id
        self._late = False  # a viewer has subscribed to the scene since the last message
        try:
            self._server = foxglove.start_server(
                name=title, host=address.host, port=address.port, context=context, server_listener=_listener(self),
                message_backlog_size=BACKLOG,
            )  # fmt: skip
        except RuntimeError as error:
            raise EchostepError(f"--foxglove {address.host}:{address.port}: cannot listen there: {error}") from error
        self.url = f"ws://{f'[{address.host}]' if ':' in address.host else address.host}:{self._server.port}"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        ending = threading.Thread(target=self._server.stop, daemon=True)
        ending.start()
        ending.join(END_S)  # a viewer that takes nothing would hold it up for ever
        for channel in self._channels.values():
            channel.close()

    def write(self, messages: Iterable[DerivedMessage]) -> None:
        """Send messages to the viewers that have subscribed to them."""
        for message in messages:
            if message.topic is SCENE:
                self._drawn |= {entity["id"]: entity for entity in message.body["entities"]}
                if self._late:
                    self._late = False
                    self._send(SCENE, message.t_ns, {"deletions": [], "entities": list(self._drawn.values())})
                    continue
            self._send(message.topic, message.t_ns, message.body)

    def subscribed(self, topic: str) -> None:
        """A viewer has subscribed to a topic; called by a thread of the server."""
        self._late = self._late or topic == SCENE.name

    def _send(self, topic: Topic, t_ns: int, body: Any) -> None:
        data = json.dumps(body, allow_nan=False, separators=(",", ":")).encode()
        self._channels[topic.name].log(data, log_time=t_ns)


def _channel(topic: Topic, context: Any) -> Channel:
    from foxglove import Channel, Schema

    schema = Schema(name=topic.schema_name, encoding="jsonschema", data=topic.schema.encode())
    return Channel(topic.name, schema=schema, message_encoding="json", context=context)


def _listener(server: FoxgloveServer) -> Any:
    from foxglove.websocket import ChannelView, Client, ServerListener

    class ViewerListener(ServerListener):
        """Reports new viewers to the server."""

        def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002
            server.subscribed(channel.topic)

    return ViewerListener()
