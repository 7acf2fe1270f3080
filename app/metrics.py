"""Server metrics in the text format of Prometheus.

https://prometheus.io/docs/instrumenting/exposition_formats/: one histogram for requests, one for the stages of jobs; states,
such as the length of the queue, are looked up on request (app.services.metrics).
"""

import threading
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
REQUEST_BOUNDS_S = (0.005, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.5, 10.0, 60.0)
STAGE_BOUNDS_S = (1.0, 5.0, 15.0, 60.0, 300.0, 900.0, 3600.0, 14400.0)


@dataclass(slots=True)
class _Series:
    """Series of one label combination: count per bucket, and the sum."""

    counts: list[int]
    total_s: float = 0.0


@dataclass(slots=True)
class Histogram:
    """Thread-safe histogram of durations by labels."""

    name: str
    help: str
    labels: tuple[str, ...]
    bounds_s: tuple[float, ...]
    _series: dict[tuple[str, ...], _Series] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def observe(self, seconds: float, *values: str) -> None:
        """Add an observation with these label values."""
        with self._lock:
            found = self._series.setdefault(values, _Series([0] * (len(self.bounds_s) + 1)))
            found.counts[bisect_left(self.bounds_s, seconds)] += 1
            found.total_s += seconds

    def lines(self) -> Iterator[str]:
        """Lines of the text format, with cumulative buckets."""
        with self._lock:
            known = [(values, list(series.counts), series.total_s) for values, series in sorted(self._series.items())]
        yield from _head(self.name, self.help, "histogram")
        for values, counts, total_s in known:
            named, so_far = tuple(zip(self.labels, values, strict=True)), 0
            for bound, count in zip((*map(_number, self.bounds_s), "+Inf"), counts, strict=True):
                so_far += count
                yield _sample(f"{self.name}_bucket", (*named, ("le", bound)), so_far)
            yield _sample(f"{self.name}_sum", named, total_s)
            yield _sample(f"{self.name}_count", named, so_far)


@dataclass(slots=True)
class Metrics:
    """Metrics of one server since its start."""

    requests: Histogram = field(
        default_factory=lambda: Histogram(
            "r2c2r_request_seconds", "Requests by route and answer", ("method", "route", "status"), REQUEST_BOUNDS_S
        )
    )
    stages: Histogram = field(
        default_factory=lambda: Histogram(
            "r2c2r_stage_seconds", "Stages of jobs that ended here", ("stage", "outcome"), STAGE_BOUNDS_S
        )
    )


def gauge(name: str, help: str, samples: Iterable[tuple[Sequence[tuple[str, str]], float]]) -> Iterator[str]:
    """A gauge in the text format: a value for each label combination."""
    yield from _head(name, help, "gauge")
    for labels, value in samples:
        yield _sample(name, labels, value)


def _head(name: str, help: str, kind: str) -> tuple[str, str]:
    return f"# HELP {name} {help}", f"# TYPE {name} {kind}"


def _sample(name: str, labels: Sequence[tuple[str, str]], value: float) -> str:
    inside = ",".join(f'{label}="{_escaped(text)}"' for label, text in labels)
    return f"{name}{{{inside}}} {_number(value)}" if inside else f"{name} {_number(value)}"


def _number(value: float) -> str:
    return str(int(value)) if value == int(value) else repr(float(value))


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
