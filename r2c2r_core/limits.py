"""Resource limits of a worker process: exceeding them ends only that process, with a one-line error.

Memory counts heap and private maps (RLIMIT_DATA), as address space alone costs nothing.
"""

import math
import os
import resource

import psutil

from r2c2r_core.errors import EnvironmentProblem

MEMORY_VARIABLE, HOURS_VARIABLE = "R2C2R_WORKER_MEMORY_GB", "R2C2R_WORKER_HOURS"
_SHARE = 0.9  # of the machine's memory, for our own computations
_LEAST_BYTES = 1 << 30
_HOURS = 48.0  # of processor time; a kitchen of an hour's recording takes a tenth of that


def limit_this_process(*, memory_bytes: int | None = None, cpu_s: int | None = None, file_bytes: int | None = None) -> None:
    """Limit this process's memory, processor seconds and file size, and disable core files.

    None is the machine's limit: nine tenths of its memory, two days of processor time, files of any size. The environment
    (R2C2R_WORKER_MEMORY_GB, R2C2R_WORKER_HOURS) overrides the machine's limits.
    """
    wanted = {
        resource.RLIMIT_DATA: max(memory_bytes or _machine_memory(), _LEAST_BYTES),
        resource.RLIMIT_CPU: cpu_s or int(3600 * _said(HOURS_VARIABLE, _HOURS)),
        resource.RLIMIT_CORE: 0,
    }
    if file_bytes is not None:
        wanted[resource.RLIMIT_FSIZE] = file_bytes
    for what, most in wanted.items():
        hard = resource.getrlimit(what)[1]
        resource.setrlimit(what, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def free_memory(share: float) -> int:
    """A fraction of the currently free memory, in bytes, at most the limit of the machine's workers."""
    return min(int(psutil.virtual_memory().available * share), _machine_memory())


def memory_met() -> EnvironmentProblem:
    """The error of a worker that reached its memory limit."""
    most = resource.getrlimit(resource.RLIMIT_DATA)[0]
    amount = "than is available" if most == resource.RLIM_INFINITY else f"than its limit of {most / 1e9:.1f} GB"
    hint = f"correct oversized inputs, keep fewer frames (ingest.most_frames), or raise the limit with {MEMORY_VARIABLE}"
    return EnvironmentProblem(f"it needs more memory {amount}", hint=hint)


def _machine_memory() -> int:
    return int(_said(MEMORY_VARIABLE, psutil.virtual_memory().total * _SHARE / 1e9) * 1e9)


def _said(variable: str, default: float) -> float:
    """A positive number from the environment, or the default."""
    try:
        value = float(os.environ.get(variable, ""))
    except ValueError:
        return default
    return value if math.isfinite(value) and value > 0 else default
