"""Cached execution of stages: content keys, stored nouns, failures of single objects, and where to stop.

A stage is a plain function of a module: its inputs, then `progress`. Its result is stored under a key derived from the
stage's source and its inputs, so the arguments of the call define the dependencies of the result.
"""

import logging
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar, get_args

from r2c2r_core.errors import EnvironmentProblem
from r2c2r_core.failing import OBJECT_FAILS, apart, record
from r2c2r_core.pool import Failed, Pool, Task
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.sources import modules_of, source_key
from r2c2r_core.tuning import in_force, tuning
from r2c2r_core.workspace import Workspace, content_key

T = TypeVar("T")

Stage = Literal["ingest", "segment", "generate", "align", "synthesize", "warp", "export"]
STAGES: tuple[Stage, ...] = get_args(Stage)

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Place:
    """Storage location of a noun."""

    root: Path
    stage: str
    name: str
    key: str


class Kept(Generic[T]):
    """A value with the content key of its inputs; with an empty key, nothing depends on it.

    A stored value is passed to another process by location and read there on first use.
    """

    __slots__ = ("_value", "key", "place")

    def __init__(self, value: T, key: str, place: _Place | None = None) -> None:
        self._value: list[T] = [value]
        self.key = key
        self.place = place

    @property
    def value(self) -> T:
        """The noun."""
        if not self._value:
            assert self.place is not None
            return _stored(self.place)
        return self._value[0]

    def __getstate__(self) -> tuple[list[T], str, _Place | None]:
        return ([] if self.place else self._value), self.key, self.place

    def __setstate__(self, state: tuple[list[T], str, _Place | None]) -> None:
        self._value, self.key, self.place = state


def aside(value: T) -> Kept[T]:
    """An input that does not affect the result: a cache folder, an earlier run's output."""
    return Kept(value, "")


@dataclass(frozen=True, slots=True)
class Shared:
    """An input computed once per process for all objects: `make` of these inputs, and `progress`."""

    make: Callable[..., Any]
    inputs: tuple[Any, ...]

    @property
    def key(self) -> str:
        """Content key of its inputs."""
        return content_key(_keys(self.inputs))


class Reached(Exception):  # a signal, not an error
    """The stage requested by the caller is done."""


@dataclass(slots=True)
class Ledger:
    """Runs stages against a workspace, computing only missing results."""

    work: Workspace
    progress: Progress
    until: Stage = "export"
    pool: Pool = field(default_factory=lambda: Pool(1))
    seconds: dict[str, float] = field(default_factory=dict)  # by stage: computation time of its results
    failures: dict[str, str] = field(default_factory=dict)  # by object: one line
    only: Collection[str] | None = None  # objects to compute in the last stage; None: all objects of every stage
    left: list[str] = field(default_factory=list)  # objects of the last stage that are missing and were skipped

    def one(
        self,
        stage: Stage,
        compute: Callable[..., T],
        *inputs: Any,
        name: str = "scene",
        span: tuple[float, float] = (0.0, 1.0),
    ) -> Kept[T]:
        """The stage's single result, computed if its inputs changed; `span` is its fraction of the stage's progress."""
        progress = self._begin(stage).part(*span)
        kept = self._once(self._job(stage, name, compute, inputs), progress)
        progress.at(1.0, "done")
        return kept

    def each(
        self, stage: Stage, compute: Callable[..., T], names: Collection[str], *inputs: Any, alone: bool = False
    ) -> dict[str, Kept[T]]:
        """The stage's result for every object; a failed object is recorded and left out, the others continue.

        From an input that is a mapping, each object gets its own entry. `alone`: in this process, regardless of the pool.
        """
        progress = self._begin(stage)
        names = [name for name in names if not self.only or name in self.only]
        jobs = {name: self._job(stage, name, compute, _own(name, inputs)) for name in names}
        results = {name: kept for name, job in jobs.items() if (kept := self._found(job)) is not None}
        wanted = self._without_left(stage, {name: job for name, job in jobs.items() if name not in results})
        parallel = not alone and min(len(wanted), self.pool.workers) > 1
        results |= self._side_by_side(wanted, progress) if parallel else self._one_by_one(wanted, progress)
        progress.at(1.0, "done")
        return {name: results[name] for name in names if name in results}

    def stored(self, stage: Stage, compute: Callable[..., T], name: str, *inputs: Any) -> T | None:
        """An earlier run's result for the object with these inputs, unless overwritten since; else None."""
        found = self.work.find(stage, name, self._job(stage, name, compute, _own(name, inputs)).key)
        return None if found is None else found[0]

    def decide(self, stage: Stage, choose: Callable[..., T], items: Mapping[str, Kept[Any]], *inputs: Any) -> dict[str, T]:
        """Quick decisions on a stage's results, not stored, with the same handling of failures."""
        results: dict[str, T] = {}
        for name, item in items.items():
            with apart(stage, name, self.failures):
                results[name] = choose(*_values((item, *_own(name, inputs)), SILENT))
        return results

    def _without_left(self, stage: Stage, missing: "dict[str, _Job]") -> "dict[str, _Job]":
        """The missing jobs that this run computes; the others of its last stage are recorded as left."""
        if self.only is None:
            return missing
        wanted = {name: job for name, job in missing.items() if stage == self.until and name in self.only}
        if stage == self.until:
            self.left += [name for name in missing if name not in wanted]
        return wanted

    def _one_by_one(self, jobs: "dict[str, _Job]", progress: Progress) -> dict[str, Kept[Any]]:
        results = {}
        for position, (name, job) in enumerate(jobs.items()):
            part = progress.part(position / len(jobs), (position + 1) / len(jobs))
            part.at(0.0, name)
            with apart(job.stage, name, self.failures):
                results[name] = self._once(job, part)
        _opened.cache_clear()
        return results

    def _side_by_side(self, jobs: "dict[str, _Job]", progress: Progress) -> dict[str, Kept[Any]]:
        """Run jobs in the pool; shared inputs are prepared first, so that the workers find them on disk."""
        opening, rest = progress.part(0.0, 0.3), progress.part(0.3, 1.0)
        shared = {input.key: input for job in jobs.values() for input in job.inputs if isinstance(input, Shared)}
        for input in shared.values():
            _open(input, opening)
        _opened.cache_clear()
        results = {}
        tasks = {name: Task(store_noun, (job,)) for name, job in jobs.items()}
        for name, answer in self.pool.run(tasks, rest if shared else progress):
            if not isinstance(answer, Failed):
                self.work.computed.append(f"{jobs[name].stage}/{name}")
                kept = self._found(jobs[name])
                assert kept is not None, "it was stored a moment ago"
                results[name] = kept
            elif isinstance(answer.error, OBJECT_FAILS):
                record(jobs[name].stage, name, answer.error, self.failures, answer.where)
            else:
                _log.error("%s: %s", name, answer.where)
                raise answer.error
        return results

    def _job(self, stage: Stage, name: str, compute: Callable[..., Any], inputs: tuple[Any, ...]) -> "_Job":
        code = (stage, *sorted(set(_modules_in(inputs))))
        return _Job(self.work.root, stage, name, compute, inputs, code, in_force(modules_of(*code)))

    def _found(self, job: "_Job") -> Kept[Any] | None:
        found = self.work.find(job.stage, job.name, job.key)
        return None if found is None else self._kept(job, *found)

    def _once(self, job: "_Job", progress: Progress) -> Kept[Any]:
        return self._kept(job, *_compute(self.work, job, progress))

    def _kept(self, job: "_Job", noun: Any, seconds: float) -> Kept[Any]:
        self.seconds[job.stage] = self.seconds.get(job.stage, 0.0) + seconds
        return Kept(noun, job.key, _Place(job.root, job.stage, job.name, job.key))

    def _begin(self, stage: Stage) -> Progress:
        if STAGES.index(stage) > STAGES.index(self.until):
            raise Reached
        progress = self.progress.for_stage(stage)
        progress.at(0.0, "")
        return progress


@dataclass(frozen=True, slots=True)
class _Job:
    """One noun to compute: storage location, function and inputs."""

    root: Path
    stage: Stage
    name: str
    compute: Callable[..., Any]
    inputs: tuple[Any, ...]
    code: tuple[str, ...]  # the stage's package, and the modules of functions and objects among its inputs
    numbers: Mapping[str, Any]  # changed tuned numbers of this code, by module

    @property
    def key(self) -> str:
        """Content key of the source, its tuned numbers and the inputs."""
        function = self.compute.__name__
        return content_key(self.stage, self.name, function, source_key(*self.code), self.numbers, _keys(self.inputs))


def _modules_in(inputs: Iterable[Any]) -> Iterator[str]:
    """Modules of the core whose functions and objects are passed to a stage, which need not import them."""
    for item in inputs:
        if isinstance(item, tuple | list):
            yield from _modules_in(item)
        elif isinstance(item, Shared):
            yield from _modules_in((item.make, *item.inputs))
        elif not isinstance(item, Kept) and (module := getattr(item, "__module__", "")).startswith(f"{__package__}."):
            yield module.removeprefix(f"{__package__}.")


def store_noun(job: _Job, *, progress: Progress) -> None:
    """Compute a noun in a worker process, and store it."""
    if not any(isinstance(item, Shared) for item in job.inputs):
        _opened.cache_clear()  # the stage that shared it has ended: a prepared recording takes half a gigabyte
    with tuning({type(params): params for params in job.numbers.values()}):
        _compute(Workspace(job.root), job, progress)


def _compute(work: Workspace, job: _Job, progress: Progress) -> tuple[Any, float]:
    return work.once(job.stage, job.name, job.key, lambda: job.compute(*_values(job.inputs, progress), progress=progress))


def _own(name: str, inputs: tuple[Any, ...]) -> tuple[Any, ...]:
    """The inputs of one object: its own entry from each mapping."""
    return tuple(item[name] if isinstance(item, Mapping) else item for item in inputs)


def _keys(inputs: Any) -> Any:
    """The inputs with stored values replaced by their keys, for content_key."""
    if isinstance(inputs, Kept | Shared):
        return inputs.key
    if isinstance(inputs, tuple | list):
        return [_keys(item) for item in inputs]
    return inputs


def _values(inputs: tuple[Any, ...], progress: Progress) -> list[Any]:
    return [_value(item, progress) for item in inputs]


def _value(item: Any, progress: Progress) -> Any:
    if isinstance(item, Kept):
        return item.value
    if isinstance(item, Shared):
        return _open(item, progress)
    if isinstance(item, tuple | list):
        return type(item)(_value(part, progress) for part in item)
    return item


@lru_cache(maxsize=4)  # the recording, and nouns of the current object
def _stored(place: _Place) -> Any:
    found = Workspace(place.root).find(place.stage, place.name, place.key)
    if found is None:
        raise EnvironmentProblem(
            f"{place.root}: the result of {place.stage} for {place.name} is missing",
            hint="do not change the folder during a run",
        )
    return found[0]


def _open(shared: Shared, progress: Progress) -> Any:
    return _opened(_Once(shared, progress))


@lru_cache(maxsize=1)
def _opened(once: "_Once") -> Any:
    return once.shared.make(*_values(once.shared.inputs, once.progress), progress=once.progress)


@dataclass(frozen=True, slots=True, eq=False)
class _Once:
    """A shared input, hashed by its key, with the progress of its computation."""

    shared: Shared
    progress: Progress

    def __hash__(self) -> int:
        return hash(self.shared.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Once) and self.shared.key == other.shared.key
