# SPDX-License-Identifier: MIT
"""The URL of a broker or of a TAK receiver, parsed into an `Endpoint`.

In: a URL. Out: an `Endpoint`. Owns nothing. Errors name the URL without its password, and the remedy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import parse_qs, unquote, urlsplit

from echostep.errors import EchostepError
from echostep_app.extras import require
from echostep_app.printing.lines import faults_of
from echostep_app.team.messages.report import checked_name

PORTS = {"mqtt": 1883, "mqtts": 8883, "cot+udp": 6969, "cot+tcp": 8087, "cot+tls": 8089}
FILES = ("ca", "cert", "key", "password")
NAME = "name"  # that the server's certificate has, where it is not the host's
BROKERS = ("mqtt", "mqtts")  # schemes of brokers, which keep messages
PACKAGES = dict.fromkeys(PORTS, "pyproj") | dict.fromkeys(BROKERS, "paho")  # that a scheme needs


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A parsed URL; `files` for TLS by name: `ca` (default: the system's), `cert` and `key` of the client, `password` of the key."""

    scheme: str
    host: str
    port: int
    user: str | None
    password: str | None
    files: dict[str, str]
    certificate_name: str = ""

    @property
    def secure(self) -> bool:
        return self.scheme in ("mqtts", "cot+tls")

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"


def parse_endpoint(url: str, schemes: tuple[str, ...] = tuple(PORTS)) -> Endpoint:
    """A URL such as mqtts://user:password@host:8883?ca=ca.pem&cert=me.pem&key=me.key; raises EchostepError."""
    shown = url.rpartition("@")[2]
    with faults_of(f"{shown}: not an address"):
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port
        asked = parse_qs(parts.query, strict_parsing=True) if parts.query else {}
    if parts.scheme in schemes:
        require(shown, PACKAGES[parts.scheme])
    if parts.scheme not in schemes:
        raise EchostepError(f"{shown}: expected one of {', '.join(f'{s}://' for s in schemes)}")
    if not host or port == 0 or parts.path not in ("", "/") or parts.fragment:
        raise EchostepError(f"{shown}: expected {parts.scheme}://HOST[:PORT]")
    if not _is_resolvable(host):
        raise EchostepError(f"{shown}: the host name is not valid: check its spelling")
    if unknown := set(asked) - {*FILES, NAME}:
        raise EchostepError(f"{shown}: {', '.join(sorted(unknown))}: unknown; there are {', '.join((*FILES, NAME))}")
    certificate_name = asked.pop(NAME, [""])[-1]
    endpoint = Endpoint(
        parts.scheme, host, port or PORTS[parts.scheme],
        unquote(parts.username) if parts.username else None,
        unquote(parts.password) if parts.password else None,
        {name: values[-1] for name, values in asked.items()}, certificate_name,
    )  # fmt: skip
    if (endpoint.files or certificate_name) and not endpoint.secure:
        raise EchostepError(
            f"{shown}: ca, cert, key, password and name are for {'mqtts' if 'mqtt' in parts.scheme else 'cot+tls'}://"
        )
    if "key" in endpoint.files and "cert" not in endpoint.files:
        raise EchostepError(f"{shown}: key belongs to a certificate: give cert=FILE too")
    if endpoint.user is not None and "mqtt" not in parts.scheme:
        raise EchostepError(f"{shown}: user and password are for mqtt:// and mqtts://")
    return endpoint


def _is_resolvable(host: str) -> bool:
    """Whether the name is well-formed enough to be passed to the resolver."""
    try:
        host.encode("idna")
    except UnicodeError:
        return False
    return host.isprintable() and " " not in host


@dataclass(frozen=True, slots=True)
class Outlet:
    """Where a tracker publishes its estimates, and under which names."""

    endpoints: tuple[Endpoint, ...]
    name: str
    team: str

    @property
    def broker(self) -> Endpoint | None:
        """The first broker."""
        return next((e for e in self.endpoints if e.scheme in BROKERS), None)


def parse_outlet(urls: Sequence[str], name: str, team: str) -> Outlet:
    """The outlet of `--publish`, `--name` and `--team`; raises EchostepError."""
    if not name:
        raise EchostepError("--publish needs the wearer's name: --name NAME")
    return Outlet(
        tuple(parse_endpoint(url) for url in urls), checked_name("--name", name), checked_name("--team", team)
    )
