# SPDX-License-Identifier: MIT
"""Meshtastic nodes on pseudo terminals, and the air between them.

In: bytes of the serial API [Meshtastic, client API: 0x94 0xC3, length, ToRadio]. Out: FromRadio to every other node. Owns the terminals and a thread
for each. Messages are made and read by the protocol's own definitions, which the package `meshtastic` brings.
"""

from __future__ import annotations

import os
import select
import threading
import tty
from types import TracebackType
from typing import Any, Self

from meshtastic.protobuf.mesh_pb2 import FromRadio, MeshPacket, ToRadio

from waiting import PATIENCE_S

START = b"\x94\xc3"


class Air:
    """Delivers what one node sends to all others, and keeps it."""

    def __init__(self, preset: str | int = "SHORT_FAST") -> None:
        self.preset = preset
        self.nodes: list[MeshNodePlayer] = []
        self.sent: list[MeshPacket] = []
        self._lock = threading.Lock()

    def node(self) -> MeshNodePlayer:
        """A further node."""
        player = MeshNodePlayer(self, 0x1000 + len(self.nodes))
        self.nodes.append(player)
        return player

    def deliver(self, packet: MeshPacket, origin: MeshNodePlayer) -> None:
        with self._lock:
            self.sent.append(packet)
            for node in self.nodes:
                if node is not origin:
                    node.tell(FromRadio(packet=packet))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for node in self.nodes:
            node.unplug()
            os.close(node.slave)


class MeshNodePlayer:
    """One node; `port` is the name of its terminal."""

    def __init__(self, air: Air, number: int) -> None:
        self._air, self._number = air, number
        # The slave stays open: so the terminal lives between two programs, and no other test gets its number once it is unplugged
        self._master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.port = os.ttyname(self.slave)
        self._over, self._writing = threading.Event(), threading.Lock()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """End the terminal."""
        self._over.set()
        self._thread.join(PATIENCE_S)

    def tell(self, message: Any) -> None:
        data = message.SerializeToString()
        with self._writing:
            if not self._over.is_set():
                os.write(self._master, START + len(data).to_bytes(2, "big") + data)

    def _read(self) -> None:
        """Closes the terminal at its end: a number that is closed under a read may be another file's when it is read next."""
        buffer = b""
        while not self._over.is_set():
            if select.select([self._master], [], [], 0.05)[0]:
                buffer += os.read(self._master, 4096)
            while (at := buffer.find(START)) >= 0 and len(buffer) >= at + 4:
                end = at + 4 + int.from_bytes(buffer[at + 2 : at + 4], "big")
                if len(buffer) < end:
                    break
                self._heed(ToRadio.FromString(buffer[at + 4 : end]))
                buffer = buffer[end:]
        with self._writing:
            os.close(self._master)

    def _heed(self, message: Any) -> None:
        if message.want_config_id:
            self._tell_settings(message.want_config_id)
        elif message.HasField("packet"):
            packet = MeshPacket()
            packet.CopyFrom(message.packet)
            setattr(packet, "from", self._number)
            self._air.deliver(packet, self)

    def _tell_settings(self, identifier: int) -> None:
        told = FromRadio()
        told.my_info.my_node_num = self._number
        self.tell(told)
        told = FromRadio()
        told.node_info.num = self._number
        told.node_info.user.id = f"!{self._number:08x}"
        self.tell(told)
        told = FromRadio()
        told.config.lora.use_preset = True
        preset = self._air.preset
        told.config.lora.modem_preset = (
            preset if isinstance(preset, int) else told.config.lora.ModemPreset.Value(preset)
        )
        self.tell(told)
        told = FromRadio()
        told.channel.role = 1  # the primary one
        self.tell(told)
        self.tell(FromRadio(config_complete_id=identifier))
