# SPDX-License-Identifier: MIT
"""TLS to brokers and TAK servers.

In: an endpoint with its files, PEM or PKCS #12. Out: a context that always verifies the server's certificate and name; EchostepError that names the
file and what to do. Owns nothing.
"""

from __future__ import annotations

import secrets
import ssl
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from echostep.errors import EchostepError
from echostep_app.team.endpoint import Endpoint
from echostep_app.team.pkcs12 import DER_SEQUENCE, authorities, identity

PEM = b"-----BEGIN"  # how a file of text begins somewhere
LARGEST_FILE = 1 << 20  # bytes, of certificates
WORDS = {
    "KEY_VALUES_MISMATCH": "the key is not that of the certificate: give the two that were made together",
    "NO_START_LINE": "a file lacks its certificate or its key: look for -----BEGIN CERTIFICATE and -----BEGIN PRIVATE KEY",
    "PEM_LIB": "a file lacks its certificate or its key (look for -----BEGIN CERTIFICATE and -----BEGIN PRIVATE KEY), is damaged, or has "
    "another password",
}


class _NamedContext(ssl.SSLContext):
    """A context that asks for the certificate of `name`, where one is given, instead of the host's."""

    name = ""

    def wrap_socket(self, *arguments: Any, **more: Any) -> ssl.SSLSocket:
        return super().wrap_socket(*arguments, **more | ({"server_hostname": self.name} if self.name else {}))


def tls_context(endpoint: Endpoint) -> ssl.SSLContext:
    """A context for an endpoint; raises EchostepError."""
    content = {name: _content(endpoint, name) for name in endpoint.files}
    password = content["password"].strip(b"\r\n") if "password" in content else None
    context = _NamedContext(ssl.PROTOCOL_TLS_CLIENT)
    context.name = endpoint.certificate_name
    try:
        if "ca" in content:
            _trust(context, endpoint, content["ca"], password)
        else:
            context.load_default_certs()
        if "cert" in content:
            _identify(context, endpoint, content["cert"], password)
    except (OSError, ValueError) as error:
        names = ", ".join(f"{k}={v}" for k, v in endpoint.files.items())
        raise EchostepError(f"{endpoint}: cannot use {names}: {_file_words(error)}") from error
    return context


def _trust(context: ssl.SSLContext, endpoint: Endpoint, content: bytes, password: bytes | None) -> None:
    """Load the authorities."""
    path = endpoint.files["ca"]
    if PEM in content:
        context.load_verify_locations(path)
        return
    try:
        context.load_verify_locations(cadata=authorities(content, password, Path(path).name))
    except EchostepError as error:
        raise EchostepError(f"{endpoint}: ca={path}: {error}") from error


def _identify(context: ssl.SSLContext, endpoint: Endpoint, content: bytes, password: bytes | None) -> None:
    """Load the client's certificate and key; those of PKCS #12 by a file, in which the key is encrypted, that exists for that moment only."""
    path = endpoint.files["cert"]
    if PEM in content:
        context.load_cert_chain(
            path, endpoint.files.get("key"), password=_no_password if password is None else password
        )
        return
    cover = secrets.token_bytes(16).hex().encode()
    try:
        pem = identity(content, password, Path(path).name, cover)
    except EchostepError as error:
        raise EchostepError(f"{endpoint}: cert={path}: {error}") from error
    with TemporaryDirectory() as folder:
        copy = Path(folder) / "client.pem"
        copy.write_bytes(pem)
        context.load_cert_chain(copy, password=cover)


def _content(endpoint: Endpoint, name: str) -> bytes:
    """A file's bytes; raises EchostepError where it cannot be what its name says."""
    path = Path(endpoint.files[name])
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE)
    except FileNotFoundError:
        raise EchostepError(f"{endpoint}: {name}={path}: there is no such file") from None
    except OSError as error:
        raise EchostepError(f"{endpoint}: {name}={path}: cannot be read: {error.strerror}") from error
    if name != "password" and PEM not in content and not content.startswith(DER_SEQUENCE):
        raise EchostepError(
            f"{endpoint}: {name}={path}: holds no certificate and no key: a PEM file has lines with -----BEGIN"
        )
    return content


def _file_words(error: Exception) -> str:
    """Why files do not make a context."""
    if isinstance(error, ssl.SSLError):
        reason = error.reason or str(error).partition(" (_ssl")[0].removeprefix("[SSL] ")
        return WORDS.get(reason.replace(" ", "_").upper(), reason)
    return str(error)


def _no_password() -> str:
    """Called by OpenSSL for an encrypted key: an error instead of a prompt on the terminal."""
    raise ValueError("the key is encrypted: write its password into a file, password=FILE")
