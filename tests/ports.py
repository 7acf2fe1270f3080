"""Free ports of this machine."""

import random
import socket
from contextlib import ExitStack, suppress
from pathlib import Path

LENT = Path("/proc/sys/net/ipv4/ip_local_port_range")  # the range of ephemeral ports
LOWEST_PORT = 20_000  # Chromium refuses some below
TRIES = 100


def free_ports(count: int) -> list[int]:
    """Different ports outside the ephemeral range, which no client is given meanwhile; any free ones if that is unknown."""
    kept = range(LOWEST_PORT, int(LENT.read_text().split()[0]) if LENT.is_file() else 0)
    tried = random.SystemRandom().sample(kept, min(len(kept), TRIES * count))  # random, so that two test workers differ
    found: list[int] = []
    with ExitStack() as opened:
        for port in (*tried, *[0] * count):
            if len(found) == count:
                return found
            probe = opened.enter_context(socket.socket())
            with suppress(OSError):
                probe.bind(("127.0.0.1", port))
                found.append(int(probe.getsockname()[1]))
    assert len(found) == count, "no port is free"
    return found


def free_port() -> int:
    return free_ports(1)[0]
