"""Live 3D points of an object during annotation: depth under its masks in the most confident frames."""

import base64
from typing import Any

import cv2
import numpy as np

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.files import ProjectFiles
from app.jobs.mask_wire import bits_mask
from app.services import cameras, masks, views
from app.services.context import Context
from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import unproject
from r2c2r_core.geometry.transforms import rotation_about_z
from r2c2r_core.ingest.depth import decode_depth
from r2c2r_core.ingest.store import depth_path, rgb_path

VIEWS = 10
POINTS_A_VIEW = 1200
_ROOM_M = 0.02  # margin of the suggested crop box around the points
_CORE_PERCENT = 2.0  # percentile at both ends that is treated as depth noise along the outline


def object_points(context: Context, project_id: str, object_id: int) -> schemas.ObjectPoints:
    """The object's points; empty without masks."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        files = context.files(project)
    found = masks.found_of(context, project, item)
    surest = sorted(found.masks.seen().tolist() if found else [], key=lambda seen: (-seen[1], seen[0]))[: 3 * VIEWS]
    spread = [int(frame) for frame, *_ in sorted(surest)[:: max(len(surest) // VIEWS, 1)][:VIEWS]]
    entries = [entry for frame in spread if found and (entry := found.masks.entry(frame)) is not None]
    parts = [part for entry in entries if len((part := _seen_in(files, entry))[0])]
    if not parts:
        return schemas.ObjectPoints(count=0, frames=0, centre_m=[0, 0, 0], size_m=[0, 0, 0], around=None, xyz_mm="", rgb="")
    points, colours = (np.concatenate(column) for column in zip(*parts, strict=True))
    low, high = np.percentile(points, (_CORE_PERCENT, 100 - _CORE_PERCENT), axis=0)
    kept = ((points >= low - 0.02) & (points <= high + 0.02)).all(axis=1)
    centre = (low + high) / 2
    millimetres = np.clip((points[kept] - centre) * 1000, -32000, 32000).astype("<i2")
    return schemas.ObjectPoints(
        count=int(kept.sum()),
        frames=len(parts),
        centre_m=centre.tolist(),
        size_m=(high - low).tolist(),
        around=_crop_around(files, points[kept]),
        xyz_mm=base64.b64encode(millimetres.tobytes()).decode(),
        rgb=base64.b64encode(colours[kept].tobytes()).decode(),
    )


def _crop_around(files: ProjectFiles, points: Points) -> schemas.PromptsFileCrop | None:
    """A box aligned with the room around world points with a margin, in the recording's own world."""
    level = cameras.levelled(files)
    if level is None:
        return None
    room_axes = rotation_about_z(level.manhattan_yaw_rad)
    local = points @ room_axes
    low, high = local.min(axis=0) - _ROOM_M, local.max(axis=0) + _ROOM_M
    capture_from_world = level.world_from_capture.inverse
    corner = capture_from_world.apply(room_axes @ low)
    edges = capture_from_world.turn(np.diag(high - low) @ room_axes.T)
    return schemas.PromptsFileCrop(corner_m=corner.round(6).tolist(), edges_m=edges.round(6).tolist())


def _seen_in(files: ProjectFiles, entry: dict[str, Any]) -> tuple[Points, np.ndarray]:
    """Points (n, 3) of the world under one mask, and their colours (n, 3)."""
    nothing = np.zeros((0, 3)), np.zeros((0, 3), np.uint8)
    index = int(entry["frame"])
    frame = views.frame_of(files, index)
    store = views.frames_folder(files)
    raw = cv2.imread(str(depth_path(store, index)), cv2.IMREAD_UNCHANGED)
    photo = cv2.imread(str(rgb_path(store, index)), cv2.IMREAD_REDUCED_COLOR_2)
    if frame is None or raw is None or photo is None:
        return nothing
    depth, camera = decode_depth(raw), frame.depth_camera
    mask = cv2.resize(bits_mask(entry["mask"]).astype(np.uint8), depth.shape[::-1], interpolation=cv2.INTER_NEAREST)
    mask = cv2.erode(mask, np.ones((3, 3), np.uint8)).astype(bool)  # depth along the outline belongs to the background
    rows, columns = np.nonzero(mask & (depth > 0))
    if not len(rows):
        return nothing
    chosen = np.random.default_rng(index).permutation(len(rows))[:POINTS_A_VIEW]
    rows, columns = rows[chosen], columns[chosen]
    z = depth[rows, columns].astype(np.float64)
    points = unproject(np.column_stack([columns, rows]) + 0.5, z, camera)
    small = cv2.resize(photo, depth.shape[::-1], interpolation=cv2.INTER_AREA)
    return frame.world_from_camera.apply(points), small[rows, columns][:, ::-1]
