"""Clicks of different objects on one front, which split the panel at the seam between them, live as in a run."""

import contextlib
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from r2c2r_core.errors import R2C2RError
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.segment.prompts import parse_prompts
from r2c2r_core.segment.protocol import SegmentSession
from r2c2r_core.segment.stage import find_disputed

Others = tuple[PromptPoint, ...]  # ObjectPrompt.others
Front = dict[str, Any] | None  # in the format of app.jobs.front_wire


class Told(NamedTuple):
    """An object of the project as sent by the server."""

    number: int
    key: str  # of its masks
    prompt: ObjectPrompt
    drawn_with: Others | None  # other clicks used for its finished masks; None without masks


class Again(NamedTuple):
    """Masks that changed because these objects are clicked on the same front; empty: none is any more."""

    number: int
    key: str
    clicked: list[int]


class Disputes:
    """Other objects' clicks used for each object's masks, and detection of masks to recompute."""

    def __init__(self, session: SegmentSession, front: Callable[[ObjectPrompt], Front]) -> None:
        self._session, self._front = session, front
        self._others: dict[int, Others] = {}
        self._drawn: dict[int, tuple[str, Others]] = {}  # of the last requested or computed masks

    def drawn_with(self, number: int, key: str) -> Others | None:
        """Other clicks used for these masks of the object; None where they are not computed here."""
        drawn = self._drawn.get(number)
        return drawn[1] if drawn is not None and drawn[0] == key else None

    def draw(self, number: int, key: str) -> Others:
        """The current other clicks for an object, recorded as used."""
        self._drawn[number] = key, self._others.get(number, ())
        return self._drawn[number][1]

    def settle(self, lines: Iterable[dict[str, Any]], waiting: Collection[int]) -> list[Again]:
        """Update the project's objects, and find those with masks that change as a result."""
        told = told_objects(lines)
        self._others = _disputed_clicks(self._session, told)
        changed = [one for one in told if one.number not in waiting and self._is_drawn_otherwise(one)]
        return [Again(one.number, one.key, _clicked(self._others.get(one.number, ()), told)) for one in changed]

    def _is_drawn_otherwise(self, one: Told) -> bool:
        here, others = self.drawn_with(one.number, one.key), self._others.get(one.number, ())
        before = one.drawn_with if here is None else here
        if before is None or set(before) == set(others):
            return False
        try:
            return self._front(replace(one.prompt, others=before)) != self._front(replace(one.prompt, others=others))
        except R2C2RError:  # it is reported when the object is segmented
            return False


def told_objects(lines: Iterable[dict[str, Any]]) -> list[Told]:
    """Parse the server's {"object", "key", "prompt", "others"}; an invalid one is reported when it is segmented."""
    told = []
    for line in lines:
        others = None if line["others"] is None else _read_others(line["others"])
        with contextlib.suppress(R2C2RError):
            prompt = read_prompt(line["prompt"])
            told.append(Told(int(line["object"]), str(line["key"]), prompt, others))
    return told


def read_prompt(document: dict[str, Any]) -> ObjectPrompt:
    """One object of prompts.json."""
    return parse_prompts({"version": 3, "objects": [document]}).objects[0]


def others_line(others: Others) -> list[list[float]]:
    """The clicks as JSON, in messages and mask files: frame, x, y of each."""
    return [[point.frame, point.x, point.y] for point in others]


def _read_others(line: Iterable[Sequence[float]]) -> Others:
    return tuple(PromptPoint(frame=int(frame), x=x, y=y, label=1) for frame, x, y in line)


def _disputed_clicks(session: SegmentSession, told: Sequence[Told]) -> dict[int, Others]:
    """Other objects' clicks on each object's front, by object."""
    disputed = find_disputed(session, [one.prompt for one in told])
    return {one.number: disputed[one.prompt.name] for one in told if one.prompt.name in disputed}


def _clicked(others: Others, told: Sequence[Told]) -> list[int]:
    """The objects to which these clicks belong."""
    return [one.number for one in told if any(point in others for point in one.prompt.points)]
