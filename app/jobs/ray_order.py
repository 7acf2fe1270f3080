"""What a node of a Ray cluster is to do."""

import sys
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """One step of a job, as the machine says it that has the job, and what it takes."""

    version: str  # as app.jobs.seats has it
    job: int
    project: str
    holder: str  # as app.store has it
    stage: str
    command: tuple[str, ...]
    data_dir: str
    store: str  # empty: all machines share the data folder, at the same path
    cache_gb: str
    cpus: int
    gpu: bool  # where the cluster has any
    memory_bytes: int
    grace_s: float
    python: str = sys.executable
