"""A program in an empty folder and without network: `python -m r2c2r_core.alone MODULE [ARGUMENT...]`.

Decoders of other people's files run so: what a file makes them open by a relative path or an address is not there. The program
is started from here because Linux lets only a process of one thread leave its namespaces (unshare(2)), and importing numpy
starts threads. Paths among the arguments are absolute; pipes that were open stay.
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
    """Run the module as a program; where the system keeps the network, it goes on with it."""
    leave_network()
    with tempfile.TemporaryDirectory(prefix="r2c2r-alone-") as folder:
        os.chdir(folder)
        sys.argv = arguments
        runpy.run_module(arguments[0], run_name="__main__", alter_sys=True)


def leave_network() -> bool:
    """Move this process, which has one thread, to a network of nothing; False where the system does not let it.

    Root leaves it alone and keeps its rights to files. Anybody else needs a namespace of users for it, in which what they
    own stays theirs.
    """
    if not sys.platform.startswith("linux"):
        return False
    libc = ctypes.CDLL(None)
    return any(libc.unshare(flags) == 0 for flags in (_CLONE_NEWNET, _CLONE_NEWUSER | _CLONE_NEWNET))


def network_can_be_left() -> bool:
    """Whether programs started from here are without network, tried in a process of its own."""
    tried = "import sys; from r2c2r_core.alone import leave_network; sys.exit(not leave_network())"
    return subprocess.run([sys.executable, "-c", tried], check=False, capture_output=True).returncode == 0


if __name__ == "__main__":
    main(sys.argv[1:])
