"""What a run has computed and may use again: keys, stored nouns, failures of single objects, and where to stop."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, Literal, TypeVar, get_args

from r2c2r_core.errors import PromptError, StageError
from r2c2r_core.progress import Progress
from r2c2r_core.sources import source_key
from r2c2r_core.workspace import Workspace, content_key

T = TypeVar("T")
S = TypeVar("S")

Stage = Literal["ingest", "segment", "generate", "align", "synthesize", "warp", "export"]
STAGES: tuple[Stage, ...] = get_args(Stage)

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Kept(Generic[T]):
    """A noun and the key that says what it was made from."""

    value: T
    key: str


class Reached(Exception):  # a signal, not an error
    """The stage the caller asked for is done."""


@dataclass(slots=True)
class Ledger:
    """Runs stages against a workspace, computing only what is not there yet."""

    work: Workspace
    progress: Progress
    until: Stage = "export"
    seconds: dict[str, float] = field(default_factory=dict)  # by stage: what its results took when they were computed
    failures: dict[str, str] = field(default_factory=dict)  # by object: one line

    def one(self, stage: Stage, inputs: tuple[object, ...], compute: Callable[[Progress], T]) -> Kept[T]:
        """The stage's single result, computed when its inputs changed."""
        progress = self._begin(stage)
        key = content_key(stage, _code_key(stage), inputs)
        value, seconds = self.work.once(stage, "scene", key, lambda: compute(progress))
        self.seconds[stage] = seconds
        progress.at(1.0, "done")
        return Kept(value, key)

    def each(
        self,
        stage: Stage,
        items: Mapping[str, Kept[S]],
        inputs: Callable[[str], tuple[object, ...]],
        compute: Callable[[str, S, Progress], T],
    ) -> dict[str, Kept[T]]:
        """The stage's result for every object; an object that fails is left out and recorded, the others go on."""
        progress = self._begin(stage)
        results: dict[str, Kept[T]] = {}
        for position, (name, item) in enumerate(items.items()):
            part = progress.part(position / len(items), (position + 1) / len(items))
            part.at(0.0, name)
            key = content_key(stage, _code_key(stage), item.key, inputs(name))
            try:
                results[name] = self._once(stage, name, key, item.value, compute, part)
            except (StageError, PromptError) as error:
                _log.warning("%s: %s: %s", stage, name, error)
                self.failures[name] = f"{stage}: {error}"
        progress.at(1.0, "done")
        return results

    def stored(self, stage: Stage, name: str, item: Kept[S], inputs: tuple[object, ...]) -> Any | None:
        """What an earlier run made of the item with these inputs, when nothing has taken its place yet."""
        found = self.work.find(stage, name, content_key(stage, _code_key(stage), item.key, inputs))
        return None if found is None else found[0]

    def sort_out(self, stage: Stage, items: Mapping[str, Kept[S]], decide: Callable[[str, S], T]) -> dict[str, Kept[T]]:
        """Quick decisions on a stage's results, with the same treatment of failures; their keys stay."""
        results: dict[str, Kept[T]] = {}
        for name, item in items.items():
            try:
                results[name] = Kept(decide(name, item.value), item.key)
            except StageError as error:
                self.failures[name] = f"{stage}: {error}"
        return results

    def _once(
        self, stage: Stage, name: str, key: str, item: S, compute: Callable[[str, S, Progress], T], part: Progress
    ) -> Kept[T]:
        value, seconds = self.work.once(stage, name, key, lambda: compute(name, item, part))
        self.seconds[stage] = self.seconds.get(stage, 0.0) + seconds
        return Kept(value, key)

    def _begin(self, stage: Stage) -> Progress:
        if STAGES.index(stage) > STAGES.index(self.until):
            raise Reached
        progress = self.progress.for_stage(stage)
        progress.at(0.0, "")
        return progress


def _code_key(stage: str) -> str:
    """The stage's version: a digest of its source and of the geometry and nouns it stands on."""
    return source_key(stage, "geometry", "model")


def keys_of(results: Mapping[str, Kept[Any]]) -> list[list[str]]:
    """The keys of many results, as an input of the next stage."""
    return [[name, kept.key] for name, kept in results.items()]
