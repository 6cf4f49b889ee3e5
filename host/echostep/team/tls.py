# SPDX-License-Identifier: MIT
"""TLS to brokers and TAK servers.

In: an endpoint with its files. Out: a context that always verifies the server's certificate and name; EchostepError that names the file and what to
do. Owns nothing.
"""

from __future__ import annotations

import ssl
from pathlib import Path
from typing import Any

from echostep.errors import EchostepError
from echostep.team.endpoint import Endpoint

PEM, DER_SEQUENCE = b"-----BEGIN", b"\x30"  # how a file of text begins somewhere, and how PKCS #12 and DER begin
LARGEST_FILE = 1 << 20  # bytes, of certificates


class _NamedContext(ssl.SSLContext):
    """A context that asks for the certificate of `name`, where one is given, instead of the host's."""

    name = ""

    def wrap_socket(self, *arguments: Any, **more: Any) -> ssl.SSLSocket:
        return super().wrap_socket(*arguments, **more | ({"server_hostname": self.name} if self.name else {}))


def tls_context(endpoint: Endpoint) -> ssl.SSLContext:
    """A context for an endpoint; raises EchostepError."""
    for name, path in endpoint.files.items():
        if problem := _problem_of(Path(path)):
            raise EchostepError(f"{endpoint}: {name}={path}: {problem}")
    try:
        context = _NamedContext(ssl.PROTOCOL_TLS_CLIENT)
        context.name = endpoint.certificate_name
        if "ca" in endpoint.files:
            context.load_verify_locations(endpoint.files["ca"])
        else:
            context.load_default_certs()
        if "cert" in endpoint.files:
            context.load_cert_chain(endpoint.files["cert"], endpoint.files["key"], password=_no_password)
    except (OSError, ValueError) as error:
        names = ", ".join(f"{k}={v}" for k, v in endpoint.files.items())
        raise EchostepError(f"{endpoint}: cannot use {names}: {_file_words(error)}") from error
    return context


def _problem_of(path: Path) -> str:
    """What is wrong with a file of certificates, and what to do; empty where it may be one."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE)
    except FileNotFoundError:
        return "there is no such file"
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    if PEM in content:
        return ""
    if content.startswith(DER_SEQUENCE):
        pem = path.with_suffix(".pem").name
        return (
            f"is PKCS #12 or DER, PEM is needed: openssl pkcs12 -legacy -nodes -in {path.name} -out {pem}, "
            f"then cert={pem}&key={pem} (its password is asked there)"
        )
    return "holds no certificate and no key: a PEM file has lines with -----BEGIN"


def _file_words(error: Exception) -> str:
    """Why files do not make a context."""
    if isinstance(error, ssl.SSLError):
        reason = error.reason or str(error).partition(" (_ssl")[0]
        return {
            "KEY_VALUES_MISMATCH": "the key is not that of the certificate: give the two that were made together",
            "NO_START_LINE": "a file lacks its certificate or its key: look for -----BEGIN CERTIFICATE and -----BEGIN PRIVATE KEY",
            "PEM_LIB": "a file lacks its certificate or its key, or is damaged: look for -----BEGIN CERTIFICATE and -----BEGIN PRIVATE KEY",
        }.get(reason.replace(" ", "_").upper(), reason)
    return str(error)


def _no_password() -> str:
    """Called by OpenSSL for an encrypted key: an error instead of a prompt on the terminal."""
    raise ValueError("the key is encrypted; give it without a passphrase: openssl pkey -in KEY -out KEY.pem")
