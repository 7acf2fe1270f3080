"""Ground truth of every joint in a recording: its state and its front's visibility in each frame, and its interior."""

from dataclasses import asdict, dataclass

import cv2
import numpy as np

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.atlas import LitScene
from r2c2r_core.synthetic.opening import Film, Front, share_of
from r2c2r_core.synthetic.render import View

_BEHIND_M = 0.05
MIN_SEEN_PX, MIN_SEEN_SHARE = 400, 0.25  # as required by evaluate (records.py); stages do not import each other


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """Visible part of a front in one frame."""

    seen_px: int
    seen_share: float  # fraction of its whole outline, reduced by occlusion and the frame's edges

    @property
    def shows(self) -> bool:
        """Whether a person would call the front visible in the frame."""
        return self.seen_px >= MIN_SEEN_PX and self.seen_share >= MIN_SEEN_SHARE


def sights(
    film: Film, states: dict[str, float], scene: LitScene, view: View, camera: Intrinsics, camera_from_kitchen: Rigid3
) -> dict[str, Sight]:
    """Visibility of every front, by its joint's name."""
    names = np.array(scene.mover_of_patch)
    counts = np.bincount(view.patch[view.patch >= 0], minlength=len(names)) * ~scene.body_patch
    found = {}
    for name, front in film.fronts.items():
        seen = int(counts[names == name].sum())
        whole = _outline_px(front, states[name], camera, camera_from_kitchen)
        found[name] = Sight(seen_px=seen, seen_share=round(min(seen / whole, 1.0), 4) if whole else 0.0)
    return found


def motion_entries(film: Film, seen: list[dict[str, Sight]]) -> dict[str, dict[str, object]]:
    """Additional truth.json entries of each joint."""
    frames = len(seen)
    times = [share_of(i, frames) for i in range(frames)]
    states = [film.states(time) for time in times]
    entries: dict[str, dict[str, object]] = {}
    for name, front in film.fronts.items():
        values = [round(each[name], 6) for each in states]
        opens = any(values)
        entries[name] = {
            "states": values,
            "seen_px": [each[name].seen_px for each in seen],
            "seen_share": [each[name].seen_share for each in seen],
            "largest": max((value for value, each in zip(values, seen, strict=True) if each[name].shows), default=0.0),
            "inside": asdict(film.hollows[front.hollow_key].inside) if opens else None,
        }
    return entries


def _outline_px(front: Front, state: float, camera: Intrinsics, camera_from_kitchen: Rigid3) -> float:
    """Area of a front's outline without cropping at the image border; 0 where a part of it is behind the camera."""
    corners = camera_from_kitchen.apply(front.pose(state).apply(front.corners))
    if corners[:, 2].min() < _BEHIND_M:
        return 0.0
    uv = corners[:, :2] / corners[:, 2:] * [camera.fx, camera.fy]
    return float(cv2.contourArea(cv2.convexHull(uv.astype(np.float32))))
