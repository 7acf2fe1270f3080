"""POST to a user-supplied address: bounded in time and size, without redirects, to public addresses only.

The host is resolved once, each address is checked, and one of them is connected to, which prevents DNS rebinding between
check and connection.
"""

import hashlib
import hmac
import http.client
import ipaddress
import socket
import ssl
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from urllib.parse import urlsplit

from app.errors import Forbidden
from r2c2r_core.errors import InputError

Network = ipaddress.IPv4Network | ipaddress.IPv6Network
TOTAL_S = 10.0  # from connecting to the answer's last header
PORTS = {"http": 80, "https": 443}
ALLOW = "the server's operator can allow a network: R2C2R_WEBHOOKS_TO=10.1.0.0/16"
_TRANSLATED = tuple(  # IPv6 addresses that may reach private IPv4 or site-local hosts, which `is_global` does not tell
    ipaddress.ip_network(prefix) for prefix in ("::/96", "64:ff9b::/96", "64:ff9b:1::/48", "2002::/16", "fec0::/10")
)


def networks(text: str) -> tuple[Network, ...]:
    """Networks, separated by commas; raises InputError."""
    try:
        return tuple(ipaddress.ip_network(part.strip()) for part in text.split(",") if part.strip())
    except ValueError as error:
        raise InputError(f"R2C2R_WEBHOOKS_TO: {error}", hint="networks such as 10.1.0.0/16, separated by commas") from error


def signature(secret: str, timestamp: str, content: bytes) -> str:
    """HMAC-SHA256 of `timestamp.content`, in hexadecimal, so that an old message cannot be replayed with a new time."""
    return hmac.new(secret.encode(), timestamp.encode() + b"." + content, hashlib.sha256).hexdigest()


def post(url: str, content: bytes, headers: Mapping[str, str], allowed: Sequence[Network] = ()) -> int:
    """Status of the answer, whose body is not read. Raises OSError or HTTPException, Forbidden for a private address."""
    parts = urlsplit(url)
    host, port = parts.hostname or "", parts.port or PORTS[parts.scheme]
    with (
        socket.create_connection((_address_of(host, port, allowed), port), timeout=TOTAL_S) as plain,
        _encrypted(plain, host) if parts.scheme == "https" else plain as made,
        _time_limit(made),
    ):
        if isinstance(made, ssl.SSLSocket):
            made.do_handshake()
        connection = http.client.HTTPConnection(host, port)
        connection.sock = made
        at = f"{parts.path or '/'}{'?' + parts.query if parts.query else ''}"
        named = parts.netloc if port != PORTS[parts.scheme] else parts.netloc.removesuffix(f":{port}")
        connection.request("POST", at, content, {"Host": named, "Content-Type": "application/json", **headers})
        return connection.getresponse().status


def _address_of(host: str, port: int, allowed: Sequence[Network]) -> str:
    found = [entry[4][0] for entry in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)]
    for text in found:
        address = ipaddress.ip_address(str(text).partition("%")[0])
        address = getattr(address, "ipv4_mapped", None) or address
        public = address.is_global and not address.is_multicast and not any(address in prefix for prefix in _TRANSLATED)
        if not public and not any(address in network for network in allowed):
            raise Forbidden(f"{host} is {address}, which is not a public address", hint=ALLOW)
    return str(found[0])


def _encrypted(plain: socket.socket, host: str) -> ssl.SSLSocket:
    """The socket with TLS, before its handshake. It takes over the file descriptor: `plain` no longer has one."""
    return ssl.create_default_context().wrap_socket(plain, server_hostname=host, do_handshake_on_connect=False)


@contextmanager
def _time_limit(connection: socket.socket) -> Iterator[None]:
    """Shut the connection down after TOTAL_S, as a slow trickle of bytes never exceeds the socket's own timeout."""
    ending = threading.Timer(TOTAL_S, _shut_down, (connection,))
    ending.start()
    try:
        yield
    finally:
        ending.cancel()


def _shut_down(connection: socket.socket) -> None:
    with suppress(OSError):
        socket.socket.shutdown(connection, socket.SHUT_RDWR)  # an SSLSocket's own would go on without encryption
