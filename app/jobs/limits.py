"""What a process that decodes other people's files may use: a file that wants more ends that process, nothing else."""

import resource

import psutil

MEMORY_SHARE = 0.7  # of what is free when it starts
LEAST_MEMORY = 1 << 30


def limit_this_process(*, cpu_s: int, file_bytes: int) -> None:
    """Bound this process's memory, CPU seconds and largest file, and leave no core file behind."""
    memory = max(int(psutil.virtual_memory().available * MEMORY_SHARE), LEAST_MEMORY)
    for what, most in (
        (resource.RLIMIT_DATA, memory),  # heap and private maps: address space alone costs nothing
        (resource.RLIMIT_CPU, cpu_s),
        (resource.RLIMIT_FSIZE, file_bytes),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(what)[1]
        resource.setrlimit(what, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
