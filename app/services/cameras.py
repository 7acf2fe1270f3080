"""Frames' cameras in the recording's own world, in which users draw, and its transform to the levelled world."""

from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.errors import NotFound
from app.files import ProjectFiles
from app.services import views
from app.services.context import Context
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Capture


class Levelled(NamedTuple):
    """Levelling of a recording: transform and Manhattan yaw."""

    world_from_capture: Rigid3
    manhattan_yaw_rad: float


def camera(context: Context, project_id: str, index: int) -> schemas.FrameCamera:
    """A frame's camera."""
    with reading(context.engine) as session:
        files = context.files(queries.project_row(session, project_id))
    frame, level = views.frame_of(files, index), levelled(files)
    if frame is None or level is None:
        raise NotFound(f"the recording has no frame {index}", hint="its frames are listed under /frames")
    return schemas.FrameCamera(
        **pinhole(frame.rgb_camera),
        camera_from_capture=(frame.world_from_camera.inverse @ level.world_from_capture).matrix.tolist(),
    )


def pinhole(camera: Intrinsics) -> dict[str, Any]:
    """The intrinsics fields of a frame's camera."""
    return asdict(camera)


def levelled(files: ProjectFiles) -> Levelled | None:
    """Levelling of the recording; None while it is being read."""
    told = views.facts(files, "ingest", "scene", _told_level)
    return Levelled(Rigid3.from_matrix(np.array(told[0])), told[1]) if told is not None else None


def _told_level(capture: Capture) -> tuple[list[list[float]], float]:
    return capture.world_from_capture.matrix.tolist(), capture.room.manhattan_yaw_rad
