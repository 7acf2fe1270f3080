"""Semantic labels of a scene's parts in three taxonomies, used by every format of the bundle."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from r2c2r_core.export.plan import Body
from r2c2r_core.model.handle import Handle

Part = Literal["body", "door", "drawer", "sliding_door", "handle"]
Disposition = Literal["openable", "graspable", "pushable"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Labels:
    """Semantic labels of one link or handle."""

    category: str  # of its object, as typed by the user
    part: Part
    disposition: tuple[Disposition, ...]  # what can be done to it


def labels_of(body: Body) -> Labels:
    """Labels of a link: door (hinged), drawer (slides out of its front), sliding door (along it), else body."""
    opens: tuple[Disposition, ...] = ("openable",) if body.joint is not None else ()
    held: tuple[Disposition, ...] = ("graspable",) if body.free else ()
    return Labels(category=body.category, part=_part(body), disposition=(*opens, *held))


def labels_of_handle(handle: Handle, body: Body) -> Labels:
    """Labels of a handle of the link `body`."""
    return Labels(category=body.category, part="handle", disposition=("pushable" if handle.kind == "push" else "graspable",))


def _part(body: Body) -> Part:
    if body.joint is None:
        return "body"
    if body.joint.type == "revolute":
        return "door"
    assert body.axis_body is not None  # it has a joint
    return "drawer" if int(np.argmax(np.abs(body.axis_body))) == 1 else "sliding_door"
