"""Renderings of an object's mesh over photos: ghost, outline, and residual to the measured depth."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from app import schemas
from app.db import history, queries
from app.db.engine import reading
from app.errors import NotFound, NotReady
from app.files import ProjectFiles
from app.services import masks, media, openings, views
from app.services.cameras import pinhole
from app.services.context import Context
from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import Intrinsics, ray_slopes, unproject
from r2c2r_core.geometry.masks import box_around
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.raster import rasterize, sample_texture
from r2c2r_core.geometry.transforms import Rigid3, joint_transform
from r2c2r_core.ingest.depth import decode_depth
from r2c2r_core.ingest.store import depth_path
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.scene import Joint, SceneObject
from r2c2r_core.synthesize.filmed import widest
from r2c2r_core.synthesize.marked import part_of
from r2c2r_core.workspace import content_key

WIDTH = 1920  # pixels: the size of the largest photos, and smooth when zooming into smaller ones
_LINE_OF = 960  # line width is the photo's width divided by this
PHOTOS = 12
_AT_BORDER = 0.01  # fraction of the image: closer to its edge, an object may be cut off
FAR_M = 0.03  # residual with full colour
_FAINT = 0.25  # opacity factor of occluded parts
_OUTLINE, _BORDER = np.array([77, 225, 255]), np.array([26, 19, 16])  # BGR
_CREASE = np.cos(np.radians(30.0))  # between faces that meet at an edge; those of a round body meet at less
_DRAWING = 2  # version of how overlays are drawn: browsers and previews keep those of a version
_SOFT_PX = 0.7  # standard deviation of the blur of lines, which is smooth when zoomed


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One mesh in the world, with a texture or with a colour."""

    vertices_world: Points
    faces: np.ndarray
    uv: np.ndarray | None = None
    texture: np.ndarray | None = None
    colour: tuple[float, float, float] = (0.7, 0.7, 0.7)  # RGB 0..1


def photos(context: Context, project_id: str, object_id: int) -> schemas.ObjectPhotos:
    """The frames that show most of the object, and the available overlays."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        said = openings.states_said(history.override_data(session, item))
        files = context.files(project)
    found = masks.found_of(context, project, item)
    stages = ("warp", "synthesize")
    fitted = next((one for stage in stages if (one := openings.built(files, stage, item.result_name, said))), None)
    seen = found.masks.seen().tolist() if found else []
    best = sorted(seen, key=lambda seen: -seen[2] * seen[1])[: 6 * PHOTOS]
    spread = sorted(best)[:: max(len(best) // PHOTOS, 1)][:PHOTOS]
    wanted = _opened_frames(fitted) | {frame for marks in said.values() for frame in marks} if fitted is not None else set()
    chosen = spread + [one for one in seen if int(one[0]) in wanted and one not in spread]
    shown = [
        photo
        for frame, sure, _ in chosen
        if found is not None and (photo := _photo(files, int(frame), sure, found.masks.entry(int(frame)), fitted)) is not None
    ]
    made_by: dict[schemas.OverlayOf, str] = {"placed": "align", "primitive": "synthesize", "fitted": "warp"}
    return schemas.ObjectPhotos(
        photos=sorted(shown, key=lambda photo: (not photo.whole, -photo.confidence)),
        version=_version(files, item.result_name, said),
        of=[name for name, stage in made_by.items() if _stored(files, stage, item.result_name)],
        world_from_object=fitted.world_from_object.matrix.tolist() if fitted else None,
        dimensions_m=fitted.dimensions_m.tolist() if fitted else None,
        leaves=[_leaf(object_id, fitted, joint) for joint in fitted.joints] if fitted else [],
    )


def overlay(
    context: Context, project_id: str, object_id: int, index: int, of: schemas.OverlayOf, look: schemas.OverlayLook
) -> Path:
    """Overlay of the object for one frame: a PNG with transparent background, cached until the object changes."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id, deleted=True)
        name, said = item.result_name, openings.states_said(history.override_data(session, item))
        files = context.files(project)
    kept = f"{index:06d}-{of}-{look}-{WIDTH}-{_version(files, name, said)}.png"
    target = files.previews / "overlays" / str(object_id) / kept
    return media.kept_file(files, target, lambda: _drawn(files, index, look, parts_of(files, name, of, index, said)))


def point_under(context: Context, project_id: str, object_id: int, index: int, x: float, y: float) -> list[float] | None:
    """World point of the object's mesh under a pixel of the stored frame, or None."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        item = queries.object_row(session, project_id, object_id)
        name, said = item.result_name, openings.states_said(history.override_data(session, item))
        files = context.files(project)
    frame = views.frame_of(files, index)
    if frame is None:
        return None
    try:
        parts = parts_of(files, name, "fitted", index, said) or parts_of(files, name, "placed", index, said)
    except NotReady:
        return None
    camera = _camera_of(frame)
    _, depth = _render(parts, camera, frame.world_from_camera.inverse)
    scale = camera.width / frame.rgb_camera.width
    column, row = min(int(x * scale), camera.width - 1), min(int(y * scale), camera.height - 1)
    z = float(depth[row, column])
    if z <= 0:
        return None
    point = unproject(np.array([[x * scale, y * scale]]), np.array([z]), camera)
    return [float(value) for value in frame.world_from_camera.apply(point)[0]]


def parts_of(files: ProjectFiles, name: str, of: schemas.OverlayOf, index: int, said: openings.States) -> list[Part]:
    """The object's meshes in the world at a frame's joint states, filmed or marked; NotReady before that stage."""
    track = views.latest(files, "segment", name)
    carrier = track.box.carrier if track is not None and track.box is not None else None
    parts = _still_parts(files, name, of, index, said)
    if carrier is None:
        return parts
    opening = carrier.motion.opening(carrier.motion.state_in(index))
    return [replace(part, vertices_world=opening.apply(part.vertices_world)) for part in parts]


def _still_parts(files: ProjectFiles, name: str, of: schemas.OverlayOf, index: int, said: openings.States) -> list[Part]:
    """The object's meshes in the world, as if no drawer carried it."""
    if of == "placed":
        placement, made = (views.latest(files, stage, name) for stage in ("align", "generate"))
        asset = (
            next((c for c in made.candidates if placement and c.candidate_id == placement.candidate_id), None) if made else None
        )
        if placement is None or asset is None:
            raise NotReady(f"{name} is not placed yet", hint="run the project first")
        mesh = asset.mesh
        return [
            Part(
                vertices_world=placement.world_from_mesh.apply(mesh.vertices),
                faces=mesh.faces,
                uv=mesh.uv,
                texture=mesh.texture,
            )
        ]
    found = openings.built(files, "warp" if of == "fitted" else "synthesize", name, said)
    if found is None:
        raise NotReady(f"{name} is not {'fitted' if of == 'fitted' else 'built'} yet", hint="run the project first")
    return _scene_parts(found, index)


def _scene_parts(item: SceneObject, index: int) -> list[Part]:
    """The object's links at a frame's measured joint states; closed where unknown."""
    parts = []
    for link in item.links:
        world_from_link = item.world_from_object @ _moved(item, link.name, index) @ link.object_from_link
        if link.visual is not None:
            mesh = link.visual
            placed = world_from_link.apply(mesh.vertices)
            parts.append(Part(vertices_world=placed, faces=mesh.faces, uv=mesh.uv, texture=mesh.texture))
            continue
        for box in link.boxes:
            vertices, faces = box_mesh(-box.size_m / 2, box.size_m / 2)
            placed = (world_from_link @ box.link_from_box).apply(vertices)
            parts.append(Part(vertices_world=placed, faces=faces, colour=link.colour))
    return parts


def _moved(item: SceneObject, link: str, index: int) -> Rigid3:
    """Motion of a link from its closed pose in a frame, in the object's coordinates."""
    joint = next((joint for joint in item.joints if joint.child == link), None)
    if joint is None:
        return Rigid3()
    state = 0.0 if joint.motion is None else joint.motion.state_in(index)
    own = joint_transform(joint.axis_object, joint.origin_object, state, turns=joint.type == "revolute")
    return _moved(item, joint.parent, index) @ own


def _opened_frames(item: SceneObject) -> set[int]:
    """For each joint filmed open, a frame half way and one at the widest opening."""
    chosen = set()
    for joint in item.joints:
        known = {f: s.value for f, s in joint.motion.states.items() if s.value} if joint.motion is not None else {}
        for share in (0.5, 1.0) if known else ():
            wanted = share * max(known.values())
            chosen.add(min(known, key=lambda frame: abs(known[frame] - wanted)))
    return chosen


def _drawn(files: ProjectFiles, index: int, look: schemas.OverlayLook, parts: list[Part]) -> bytes:
    frame = views.frame_of(files, index)
    if frame is None:
        raise NotFound(f"the recording has no frame {index}")
    camera_from_world = frame.world_from_camera.inverse
    camera = _camera_of(frame)
    if look == "residual":
        image = _residual(files, index, parts, frame.depth_camera, camera_from_world)
        image = cv2.resize(image, (camera.width, camera.height), interpolation=cv2.INTER_NEAREST)
    else:
        colours, depth = _render(parts, camera, camera_from_world)
        image = _outline(depth, camera) if look == "outline" else np.dstack([colours, (depth > 0).astype(np.uint8) * 255])
        image[..., 3] = np.where(_covered(files, index, depth), _FAINT * image[..., 3], image[..., 3]).astype(np.uint8)
    return cv2.imencode(".png", image)[1].tobytes()


def _camera_of(frame: Frame) -> Intrinsics:
    """The photo's camera at overlay resolution."""
    return frame.rgb_camera.resized(WIDTH, round(WIDTH * frame.rgb_camera.height / frame.rgb_camera.width))


def _covered(files: ProjectFiles, index: int, depth: np.ndarray) -> np.ndarray:
    """Mask of measured occluders in front of the rendered surface; empty without a depth image.

    An outline's rim extends a pixel beyond the surface: occluders of the nearest surface also occlude the rim.
    """
    raw = cv2.imread(str(depth_path(views.frames_folder(files), index)), cv2.IMREAD_UNCHANGED)
    if raw is None:
        return np.zeros(depth.shape, bool)
    known = decode_depth(raw)
    metres, weight = (
        cv2.resize(one.astype(np.float32), depth.shape[::-1], interpolation=cv2.INTER_LINEAR) for one in (known, known > 0)
    )
    measured = metres / np.maximum(weight, 1e-6)  # interpolated, to avoid stair-stepped borders of the coarser depth image
    spread = cv2.dilate(depth, np.ones((5, 5), np.uint8))
    drawn = np.where(depth > 0, depth, spread)
    covered: np.ndarray = (weight > 0) & (drawn > measured + FAR_M)
    return covered


def _render(parts: list[Part], camera: Intrinsics, camera_from_world: Rigid3) -> tuple[np.ndarray, np.ndarray]:
    """BGR (h, w, 3) and z-depth (h, w) of the nearest surface."""
    colours = np.zeros((camera.height, camera.width, 3), np.uint8)
    depth = np.zeros((camera.height, camera.width), np.float32)
    for vertices, faces, attributes, texture in _surfaces(parts):
        drawn = rasterize(vertices, faces, attributes, camera, camera_from_world)
        near = box_around(drawn.depth_m > 0)
        found, values, known = drawn.depth_m[near], drawn.attributes[near], depth[near]
        if not found.size:  # outside the photo
            continue
        nearer = (found > 0) & ((known == 0) | (found < known))
        seen = sample_texture(texture, values[..., :2]) if texture is not None else 255 * values
        colours[near][nearer] = np.clip(seen[nearer], 0, 255).astype(np.uint8)[:, ::-1]
        known[nearer] = found[nearer]
    return colours, depth


def _surfaces(parts: list[Part]) -> Iterator[tuple[Points, np.ndarray, np.ndarray, np.ndarray | None]]:
    """Vertices, faces, vertex attributes and texture of each textured part, and of all others as one mesh."""
    for part in parts:
        if part.texture is not None and part.uv is not None:
            yield part.vertices_world, part.faces, np.column_stack([part.uv, np.ones(len(part.uv))]), part.texture
    plain = [part for part in parts if part.texture is None or part.uv is None]
    if plain:
        counts = [len(part.vertices_world) for part in plain]
        firsts = np.cumsum([0, *counts[:-1]])
        faces = np.concatenate([part.faces + first for part, first in zip(plain, firsts, strict=True)])
        attributes = np.repeat([part.colour for part in plain], counts, axis=0)
        yield np.concatenate([part.vertices_world for part in plain]), faces, attributes, None


def _outline(depth: np.ndarray, camera: Intrinsics) -> np.ndarray:
    """BGRA: silhouette and inner edges, with dark borders for visibility on any photo."""
    image, width_px = np.zeros((*depth.shape, 4), np.uint8), round(depth.shape[1] / _LINE_OF)
    rows, columns = near = box_around(depth > 0, 2 * width_px + round(6 * _SOFT_PX))
    part = depth[near]
    if not part.size:
        return image
    window = replace(camera, width=part.shape[1], height=part.shape[0], cx=camera.cx - columns.start, cy=camera.cy - rows.start)
    rim = _widened(edges_of(part, window), width_px)
    line, border = _softened(rim), _softened(_widened(rim, 1 + 2 * width_px))
    colour = _BORDER + line[..., None] * (_OUTLINE - _BORDER)
    image[near] = np.dstack([colour, np.maximum(255 * line, 200 * border)]).astype(np.uint8)
    return image


def edges_of(depth: np.ndarray, camera: Intrinsics) -> np.ndarray:
    """Pixels of the silhouette, and those between which the surface turns by more than a crease, or jumps."""
    seen = depth > 0
    inverse = np.where(seen, 1.0 / np.maximum(depth, 1e-3), 0.0).astype(np.float32)  # of a plane, affine in the pixels
    across, down = np.zeros_like(inverse), np.zeros_like(inverse)
    across[:, :-1], down[:-1] = np.diff(inverse, axis=1) * camera.fx, np.diff(inverse, axis=0) * camera.fy
    x, y = (slope.astype(np.float32) for slope in ray_slopes(np.arange(camera.width), np.arange(camera.height), camera))
    normals = np.dstack([across, down, inverse - across * x - down * y[:, None]])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    flat = seen & np.roll(seen, -1, 0) & np.roll(seen, -1, 1)
    edges = cv2.morphologyEx(seen.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 0
    for axis in (0, 1):
        turns = (normals * np.roll(normals, -2, axis)).sum(axis=-1) < _CREASE
        edges |= np.roll(turns & flat & np.roll(flat, -2, axis), 1, axis)
    return np.asarray(edges)


def _widened(line: np.ndarray, width_px: int) -> np.ndarray:
    return np.asarray(cv2.dilate(line.astype(np.uint8), np.ones((width_px, width_px), np.uint8)) > 0)


def _softened(line: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.GaussianBlur(line.astype(np.float32), (0, 0), _SOFT_PX))


def _residual(files: ProjectFiles, index: int, parts: list[Part], camera: Intrinsics, camera_from_world: Rigid3) -> np.ndarray:
    """BGRA at depth size: red where the mesh is in front of the measured surface, blue where behind, pale in agreement."""
    raw = cv2.imread(str(depth_path(views.frames_folder(files), index)), cv2.IMREAD_UNCHANGED)
    if raw is None:
        raise NotFound(f"frame {index} has no depth image")
    measured = decode_depth(raw)
    if measured.shape != (camera.height, camera.width):
        raise NotReady("the recording was read again since this was made", hint="run the project again")
    _, depth = _render(parts, camera, camera_from_world)
    both = (depth > 0) & (measured > 0)
    off = np.clip((measured - depth) / FAR_M, -1, 1)
    occluded = off < -0.999  # an occluder: no information about the object
    strength = np.abs(off)
    before, behind = np.array([40, 40, 220.0]), np.array([220, 120, 30.0])
    pale = np.array([235, 245, 235.0])
    image = pale + strength[..., None] * (np.where(off[..., None] > 0, before, behind) - pale)
    alpha = np.where(both & ~occluded, 200, 0)
    return np.dstack([image.astype(np.uint8), alpha.astype(np.uint8)])


def _photo(
    files: ProjectFiles, index: int, confidence: float, entry: dict[str, Any] | None, item: SceneObject | None
) -> schemas.Photo | None:
    frame = views.frame_of(files, index)
    if frame is None or entry is None:
        return None
    bits = entry["mask"]
    x, y = bits["left"] / bits["width"], bits["top"] / bits["height"]
    right, bottom = x + bits["box_width"] / bits["width"], y + bits["box_height"] / bits["height"]
    joints = item.joints if item is not None else ()
    return schemas.Photo(
        frame=frame.index,
        **pinhole(frame.rgb_camera),
        camera_from_world=frame.world_from_camera.inverse.matrix.tolist(),
        confidence=confidence,
        box=[x, y, right, bottom],
        whole=min(x, y) > _AT_BORDER and max(right, bottom) < 1 - _AT_BORDER,
        states=[
            schemas.PhotoState(joint=joint.name, type=joint.type, value=state.value, sigma=state.sigma)
            for joint in joints
            if joint.motion is not None and (state := joint.motion.states.get(index)) is not None
        ],
    )


def _leaf(object_id: int, item: SceneObject, joint: Joint) -> schemas.Leaf:
    """The part moved by a joint, closed: box of its front boards, or of all boards without any."""
    link = next(link for link in item.links if link.name == joint.child)
    boxes = link.of_role("front") or link.boxes
    corners = [box.link_from_box.apply(box_mesh(-box.size_m / 2, box.size_m / 2)[0]) for box in boxes]
    points = link.object_from_link.apply(np.vstack(corners))
    low, high = points.min(axis=0), points.max(axis=0)
    return schemas.Leaf(
        joint=joint.name,
        part=part_of(joint, item.name),
        type=joint.type,
        most=widest(joint.axis_object, joint.type, item.dimensions_m),
        pose=(item.world_from_object @ Rigid3(np.eye(3), (low + high) / 2)).matrix.tolist(),
        size_m=(high - low).tolist(),
        axis=item.world_from_object.turn(joint.axis_object).tolist(),
        pivot=item.world_from_object.apply(joint.origin_object).tolist(),
        opening=openings.opening_of(object_id, item, joint),
    )


def _stored(files: ProjectFiles, stage: str, name: str) -> bool:
    return _path(files, stage, name).is_file()


def _path(files: ProjectFiles, stage: str, name: str) -> Path:
    return files.work / "nouns" / stage / f"{name if stage == 'align' else 'scene'}.noun"


def _version(files: ProjectFiles, name: str, said: openings.States) -> str:
    """Key that changes whenever a stage recomputes the object, or a state is marked."""
    times = [
        path.stat().st_mtime_ns for stage in ("align", "synthesize", "warp") if (path := _path(files, stage, name)).is_file()
    ]
    return f"{_DRAWING}-{max(times, default=0):x}" + (f"-{content_key(said)[:12]}" if said else "")
