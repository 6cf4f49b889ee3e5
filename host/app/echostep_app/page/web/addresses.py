# SPDX-License-Identifier: MIT
"""The addresses of a page as other machines reach it, and as text for a terminal with a QR code that a phone reads.

In: the address of a socket, a token. Out: URLs, text. Owns nothing.
"""

from __future__ import annotations

import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from urllib.parse import urlsplit

from rich.console import Console

from echostep_app.extras import lacks
from echostep_app.page.web.access import LOOPBACK

EVERY = ("0.0.0.0", "::")
SOMEWHERE = ("192.0.2.1", 9)  # for documentation [RFC 5737]: no packet is sent there
UNREACHED = ("127.", "169.254.")  # this machine itself [RFC 1122]; an interface that got no address [RFC 3927]
SIOCGIFADDR, IFREQ_BYTES = 0x8915, 40  # the first IPv4 address of an interface, 20 bytes into the answer [netdevice(7)]
BORDER = 2  # light modules around a QR code: 4 in the standard, but phones read 2 (assumed)
HALVES = {(False, False): " ", (True, False): "▀", (False, True): "▄", (True, True): "█"}


def page_urls(host: str, port: int, token: str | None) -> tuple[str, ...]:
    """URLs of a page that listens at a host, the likeliest first; for a socket on all interfaces the URLs of every interface."""
    names = tuple(own_addresses()) or (socket.gethostname(),) if host in EVERY else (host,)
    path = f"{token}/" if token else ""
    return tuple(f"http://{f'[{name}]' if ':' in name else name}:{port}/{path}" for name in names)


def own_addresses() -> list[str]:
    """IPv4 addresses at which others reach this machine: first the default route's, then the other interfaces'."""
    found = dict.fromkeys((*_routed(), *_of_interfaces()))
    return [address for address in found if not address.startswith(UNREACHED)]


def _routed() -> Iterator[str]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
        probe.connect(SOMEWHERE)
        yield probe.getsockname()[0]


def _of_interfaces() -> Iterator[str]:
    if sys.platform != "linux":
        return
    from fcntl import ioctl

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            with suppress(OSError):  # an interface without an address
                yield socket.inet_ntoa(ioctl(probe, SIOCGIFADDR, name.encode().ljust(IFREQ_BYTES, b"\0"))[20:24])


def qr_code(url: str) -> str:
    """A QR code, two rows of modules in a line of text: to be printed dark on light."""
    import segno

    rows = [list(map(bool, row)) for row in segno.make_qr(url).matrix_iter(border=BORDER)]
    rows += [[False] * len(rows[0])] * (len(rows) % 2)
    return "\n".join(
        "".join(HALVES[pair] for pair in zip(*rows[k : k + 2], strict=True)) for k in range(0, len(rows), 2)
    )


def print_page(console: Console, urls: Sequence[str]) -> None:
    """Print where a page is; for other machines also the QR code of the first URL, on a terminal that can show it."""
    console.print(
        "\n".join((f"The page: {urls[0]}", *(f"or: {url}" for url in urls[1:]))), highlight=False, markup=False
    )
    if urlsplit(urls[0]).hostname in LOOPBACK or not console.is_terminal or not console.encoding.startswith("utf"):
        return
    if words := lacks("its QR code", "segno"):
        console.print(words, highlight=False, markup=False)
    else:
        console.print(qr_code(urls[0]), style="#000000 on #ffffff", highlight=False, markup=False)
