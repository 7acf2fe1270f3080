"""Order for a node of a Ray cluster."""

import sys
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """One step of a job with its resources, as issued by the machine that owns the job."""

    version: str  # as in app.jobs.seats
    job: int
    project: str
    holder: str  # as in app.store
    stage: str
    command: tuple[str, ...]
    data_dir: str
    store: str  # empty: all machines share the data folder, at the same path
    cache_gb: str
    cpus: int
    gpu: bool  # required if the cluster has any
    memory_bytes: int
    grace_s: float
    python: str = sys.executable
