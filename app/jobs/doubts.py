"""Early doubts about a front or an object from its masks, before a run."""

from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.model.track import FrontPanel, MaskTrack, ThingBox
from r2c2r_core.segment.contradictions import find_implausible
from r2c2r_core.segment.proposals.naming import FrontLook, name_front


def doubts_about(prompt: ObjectPrompt, panel: FrontPanel | None, box: ThingBox | None, capture: Capture) -> list[str]:
    """One line per doubt, with a remedy and without the object's name, which may change."""
    found = find_implausible(_track(prompt, prompt.category, panel, box), capture.room.walls)
    return [f"{_sentence(one.message.removeprefix(prompt.name).strip())}: {one.mend}" for one in found]


def suggested_category(prompt: ObjectPrompt, panel: FrontPanel, capture: Capture) -> str:
    """Category that a front's size and place suggest where its size is unlikely for its own; empty if there is none."""
    look = FrontLook(
        width_m=panel.width_m,
        height_m=panel.height_m,
        bottom_m=float(panel.corners[:, 2].min()) if capture.room.floor_found else None,
        handle=None,
        pair=category_of(prompt.category).opens == "pair",
    )
    other, _ = name_front(look, machines=False)
    own_fits, other_fits = (_is_usual(prompt, category, panel) for category in (prompt.category, other))
    return other if other_fits and not own_fits else ""


def _is_usual(prompt: ObjectPrompt, category: str, panel: FrontPanel) -> bool:
    found = find_implausible(_track(prompt, category, panel, None), ())
    return all(one.rule != "size-unlikely" for one in found)


def _track(prompt: ObjectPrompt, category: str, panel: FrontPanel | None, box: ThingBox | None) -> MaskTrack:
    return MaskTrack(
        name=prompt.name,
        category=category,
        masks={},
        confidence={},
        front=panel,
        box=box,
        kind="thing" if panel is None else "front",
        backend="",
        prompt_count=len(prompt.points),
        warnings=(),
    )


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
