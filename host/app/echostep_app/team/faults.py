# SPDX-License-Identifier: MIT
"""Faults of a connection in words, with remedies.

In: errors of sockets and of TLS. Out: one sentence. Owns nothing.
"""

from __future__ import annotations

import errno
import socket
import ssl

NO_WAY = "there is no way to that host: is this computer in its network?"
WORDS = {
    errno.ECONNREFUSED: "connection refused: nothing listens at that address: is it running there, and is the port right?",
    errno.EHOSTUNREACH: NO_WAY,
    errno.ENETUNREACH: NO_WAY,
    errno.ENETDOWN: NO_WAY,
    errno.ETIMEDOUT: "the host does not answer: is the address right, and does a firewall let it through?",
}
# Verify codes [OpenSSL, X509_V_ERR_HOSTNAME_MISMATCH, X509_V_ERR_IP_ADDRESS_MISMATCH]
HOST_MISMATCH, IP_MISMATCH = 62, 64
EXPIRED, NOT_YET = 10, 9
UNKNOWN_AUTHORITY = (2, 18, 19, 20, 21)
NO_TLS = ("WRONG_VERSION_NUMBER", "HTTP_REQUEST", "RECORD_LAYER_FAILURE")
CLIENT_REFUSED = (
    "CERTIFICATE_REQUIRED",
    "HANDSHAKE_FAILURE",
    "UNKNOWN_CA",
    "BAD_CERTIFICATE",
    "CERTIFICATE_UNKNOWN",
    "CERTIFICATE_EXPIRED",
)

ENDED = (ConnectionResetError, BrokenPipeError, ConnectionAbortedError, ssl.SSLEOFError, ssl.SSLZeroReturnError)
NO_ANSWER = "what listens there ends the connection instead of answering: "
PLAIN_ENDED = f"{NO_ANSWER}is it the right port, and one without TLS? One with TLS needs mqtts:// or cot+tls://"
TLS_ENDED = f"{NO_ANSWER}is it the port of its TLS (one without needs mqtt:// or cot+tcp://)?"
CLIENT_REFUSAL = (
    "the server refuses this computer's certificate, or wants one: "
    "give cert=FILE&key=FILE that its authority has signed, and that is valid today"
)


def opening_words(error: BaseException, *, secure: bool) -> str:
    """An error of a connection that is being opened, by TLS if `secure`, as a sentence."""
    if isinstance(error, ENDED):
        return TLS_ENDED if secure else PLAIN_ENDED
    return in_words(error)


def in_words(error: BaseException) -> str:
    """An error of a connection as a sentence; of an unknown one its own text."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return _verification(error)
    if isinstance(error, ssl.SSLError):
        return _tls(error)
    if isinstance(error, socket.gaierror):
        return "the host name is not known: check its spelling, and the network"
    if isinstance(error, TimeoutError) and not error.strerror and str(error) == "timed out":
        return WORDS[errno.ETIMEDOUT]
    if isinstance(error, OSError) and error.errno in WORDS:
        return WORDS[error.errno]
    return (isinstance(error, OSError) and error.strerror) or str(error) or type(error).__name__


def _verification(error: ssl.SSLCertVerificationError) -> str:
    if error.verify_code in (HOST_MISMATCH, IP_MISMATCH):
        return (
            "the server's certificate is for another name: use that name as the host (in /etc/hosts if need be), or add name=NAME to the URL; "
            "openssl s_client -connect HOST:PORT shows it"
        )
    if error.verify_code in (EXPIRED, NOT_YET):
        return "the server's certificate is not valid today: renew it, or set this computer's clock"
    if error.verify_code in UNKNOWN_AUTHORITY:
        return (
            "the server's certificate is of an authority that this computer does not know: "
            "give the file of the authority that has signed it with ca=FILE"
        )
    return f"the server's certificate is refused: {error.verify_message}"


def _tls(error: ssl.SSLError) -> str:
    reason = error.reason or ""
    if any(part in reason for part in NO_TLS):
        return "what listens there does not speak TLS: give mqtt:// or cot+tcp://, or the port of its TLS"
    if "ALERT" in reason and any(part in reason for part in CLIENT_REFUSED):
        return CLIENT_REFUSAL
    return f"TLS failed: {reason or error}"
