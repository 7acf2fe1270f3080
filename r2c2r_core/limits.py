"""What a worker process may use: one that wants more ends with one line, and nothing else on the machine does.

Memory is counted as heap and private maps (RLIMIT_DATA): address space alone costs nothing.
"""

import math
import os
import resource

import psutil

from r2c2r_core.errors import EnvironmentProblem

MEMORY_VARIABLE, HOURS_VARIABLE = "R2C2R_WORKER_MEMORY_GB", "R2C2R_WORKER_HOURS"
_SHARE = 0.9  # of the machine's memory, for what we compute ourselves
_LEAST_BYTES = 1 << 30
_HOURS = 48.0  # of processor time; a kitchen of an hour's recording takes a tenth of that


def limit_this_process(*, memory_bytes: int | None = None, cpu_s: int | None = None, file_bytes: int | None = None) -> None:
    """Bound this process's memory, processor seconds and largest file, and leave no core file behind.

    None is the machine's: nine tenths of its memory, two days of processor time, files of any size. What the environment
    says (R2C2R_WORKER_MEMORY_GB, R2C2R_WORKER_HOURS) counts instead of the machine's.
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
    """That share of the memory that is free now, in bytes; no more than the machine's workers may use."""
    return min(int(psutil.virtual_memory().available * share), _machine_memory())


def memory_met() -> EnvironmentProblem:
    """What a worker says that met its limit of memory."""
    most = resource.getrlimit(resource.RLIMIT_DATA)[0]
    amount = "than there is" if most == resource.RLIM_INFINITY else f"than the {most / 1e9:.1f} GB that it may use"
    hint = f"correct what is oversized, keep fewer frames (ingest.most_frames), or allow more with {MEMORY_VARIABLE}"
    return EnvironmentProblem(f"it needs more memory {amount}", hint=hint)


def _machine_memory() -> int:
    return int(_said(MEMORY_VARIABLE, psutil.virtual_memory().total * _SHARE / 1e9) * 1e9)


def _said(variable: str, default: float) -> float:
    """A positive number of the environment; the default where it says none."""
    try:
        value = float(os.environ.get(variable, ""))
    except ValueError:
        return default
    return value if math.isfinite(value) and value > 0 else default
