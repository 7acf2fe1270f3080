"""A program that ends with whoever started it: `python -m app.tethered COMMAND [ARGUMENT...]`.

It leads a process group, and kills that when its stdin comes to its end. What stands between may be killed without being asked,
as Ray does with its actors: then what it had started is nobody's, and would go on.
"""

import os
import signal
import subprocess
import sys
import threading


def main(command: list[str]) -> int:
    """Run it; its exit status."""
    child = subprocess.Popen(command, stdin=subprocess.PIPE)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it is sent to the whole group: the program has it too
    threading.Thread(target=_hand_on, args=(child,), daemon=True).start()
    status = child.wait()
    if status < 0:  # by a signal, as others are to see
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.kill(os.getpid(), -status)
    return status


def _hand_on(child: "subprocess.Popen[bytes]") -> None:
    assert child.stdin is not None
    while said := os.read(0, 1 << 16):
        try:
            child.stdin.write(said)
            child.stdin.flush()
        except OSError:  # it has ended, or reads no more
            continue
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
