"""A picture of the first variants side by side."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.robot.view import aimed, look, surfaces_of
from r2c2r_core.variants.overlay import START

WALL = 16
_COLUMNS = 4
_SIZE = (320, 240)
_FIELD_RAD = 0.8


def write_wall(scenes: Sequence[Path], path: Path) -> None:
    """Write the scenes' initial states, four in a row, as a JPEG."""
    pictures = [picture_of(scene) for scene in scenes]
    pictures += [np.full_like(pictures[0], 255)] * (-len(pictures) % _COLUMNS)
    rows = [np.concatenate(pictures[k : k + _COLUMNS], axis=1) for k in range(0, len(pictures), _COLUMNS)]
    path.write_bytes(cv2.imencode(".jpg", np.concatenate(rows)[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])[1].tobytes())


def picture_of(scene: Path) -> Image:
    """One scene in its initial state, from its own camera."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(scene))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(START).id)
    mujoco.mj_forward(model, data)
    eye, target = _view(model, data)
    return look(surfaces_of(model), model, data, *aimed(eye, target, _SIZE, _FIELD_RAD)).rgb


def _view(model: Any, data: Any) -> tuple[np.ndarray, np.ndarray]:
    """The bundle's camera and the scene's middle."""
    target = np.array(model.stat.center)
    return (np.array(data.cam_xpos[0]) if model.ncam else target + np.array([0.0, -3.0, 1.0])), target
