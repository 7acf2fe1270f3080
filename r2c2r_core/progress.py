"""Progress and cancellation, passed down as one argument."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import TypeVar

from r2c2r_core.errors import Cancelled

T = TypeVar("T")

Report = Callable[[str, float, str], None]
"""(stage, fraction 0..1 within the stage, text for a person)."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Channel for a stage's progress reports and cancellation checks.

    `span` maps the caller's fraction onto the stage's 0..1, so that nested work reports without knowing its position.
    """

    report: Report | None = None
    is_cancelled: Callable[[], bool] | None = None
    stage: str = ""
    span: tuple[float, float] = field(default=(0.0, 1.0))

    def at(self, fraction: float, text: str = "") -> None:
        """Report a fraction 0..1 of this span; raises Cancelled when the user has cancelled."""
        self.check()
        if self.report is not None:
            low, high = self.span
            self.report(self.stage, low + (high - low) * min(max(fraction, 0.0), 1.0), text)

    def check(self) -> None:
        """Raise Cancelled when the user has cancelled; reports nothing."""
        if self.is_cancelled is not None and self.is_cancelled():
            raise Cancelled(f"{self.stage or 'work'}: cancelled")

    def for_stage(self, stage: str) -> "Progress":
        """The same channel, reporting under another stage's name from zero."""
        return Progress(self.report, self.is_cancelled, stage, (0.0, 1.0))

    def part(self, start: float, end: float) -> "Progress":
        """The slice `start..end` of this span."""
        low, high = self.span
        width = high - low
        return Progress(self.report, self.is_cancelled, self.stage, (low + start * width, low + end * width))

    def each(self, items: Iterable[T], text: str = "", count: int | None = None) -> Iterator[T]:
        """Yield the items, reporting before each; `count` when the items have no length."""
        materialised = list(items) if count is None else items
        total = count if count is not None else len(list(materialised))
        for position, item in enumerate(materialised):
            self.at(position / max(total, 1), f"{text} {position + 1}/{total}".strip())
            yield item
        self.at(1.0, text)


SILENT = Progress()
