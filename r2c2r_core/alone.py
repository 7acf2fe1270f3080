"""Runs a program in an empty folder without network: `python -m r2c2r_core.alone MODULE [ARGUMENT...]`.

Used for decoders of untrusted files, which then cannot open relative paths or network addresses. The program is started
from here because Linux lets only a single-threaded process leave its namespaces (unshare(2)), and importing numpy starts
threads. Paths among the arguments are absolute; open pipes are inherited.
"""

import ctypes
import os
import runpy
import subprocess
import sys
import tempfile

# linux/sched.h
_CLONE_NEWUSER = 0x10000000
_CLONE_NEWNET = 0x40000000


def main(arguments: list[str]) -> None:
    """Run the module as a program; it keeps the network where the system does not allow leaving it."""
    leave_network()
    with tempfile.TemporaryDirectory(prefix="r2c2r-alone-") as folder:
        os.chdir(folder)
        sys.argv = arguments
        runpy.run_module(arguments[0], run_name="__main__", alter_sys=True)


def leave_network() -> bool:
    """Move this single-threaded process to an empty network namespace; False where the system does not allow it.

    Root needs only the network namespace and keeps its file permissions. Other users also need a user namespace, in which
    they keep the ownership of their files.
    """
    if not sys.platform.startswith("linux"):
        return False
    libc = ctypes.CDLL(None)
    return any(libc.unshare(flags) == 0 for flags in (_CLONE_NEWNET, _CLONE_NEWUSER | _CLONE_NEWNET))


def network_can_be_left() -> bool:
    """Whether programs started from here have no network, tested in a separate process."""
    tried = "import sys; from r2c2r_core.alone import leave_network; sys.exit(not leave_network())"
    return subprocess.run([sys.executable, "-c", tried], check=False, capture_output=True).returncode == 0


if __name__ == "__main__":
    main(sys.argv[1:])
