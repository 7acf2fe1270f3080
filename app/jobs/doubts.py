"""Early doubts about a front or an object from its masks, before a run."""

from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.model.track import FrontPanel, MaskTrack, ThingBox
from r2c2r_core.segment.contradictions import find_implausible


def doubts_about(prompt: ObjectPrompt, panel: FrontPanel | None, box: ThingBox | None, capture: Capture) -> list[str]:
    """One line per doubt, with a remedy and without the object's name, which may change."""
    track = MaskTrack(
        name=prompt.name,
        category=prompt.category,
        masks={},
        confidence={},
        front=panel,
        box=box,
        kind="thing" if panel is None else "front",
        backend="",
        prompt_count=len(prompt.points),
        warnings=(),
    )
    found = find_implausible(track, capture.room.walls)
    return [f"{_sentence(one.message.removeprefix(prompt.name).strip())}: {one.mend}" for one in found]


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
