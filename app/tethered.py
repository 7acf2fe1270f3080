"""Runs a program that ends with its parent process: `python -m app.tethered COMMAND [ARGUMENT...]`.

It leads a process group, and kills it when its stdin is closed. The parent may be killed without warning, as Ray does with
its actors; its children would then be orphaned and continue.
"""

import os
import signal
import subprocess
import sys
import threading


def main(command: list[str]) -> int:
    """Run the program and return its exit status."""
    child = subprocess.Popen(command, stdin=subprocess.PIPE)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # sent to the whole group, so the program gets it too
    threading.Thread(target=_hand_on, args=(child,), daemon=True).start()
    status = child.wait()
    if status < 0:  # killed by a signal, which is passed on
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.kill(os.getpid(), -status)
    return status


def _hand_on(child: "subprocess.Popen[bytes]") -> None:
    assert child.stdin is not None
    while said := os.read(0, 1 << 16):
        try:
            child.stdin.write(said)
            child.stdin.flush()
        except OSError:  # the program has ended, or closed its stdin
            continue
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
