"""The recording as seen from a drawer: what lies in it stands still there while the drawer moves."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Points
from r2c2r_core.geometry.camera import depth_points
from r2c2r_core.geometry.fusion import DepthView, fuse_depth
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.model.capture import Depth, Frame, FrameImages, SceneSurface
from r2c2r_core.model.carrier import Carrier
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.segment.motion.inside import Params as InsideParams
from r2c2r_core.segment.motion.inside import drawer_walls
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.surface import draw, parts_of
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the view into a drawer."""

    above_m: float = param(0.25, "m", "Maximum height of a thing over its drawer's front", source="tall bottles in low drawers")
    gap_m: float = param(0.02, "m", "Distance from a unit's boards, and before its closed fronts, of depth in a drawer")
    level_cos: float = param(0.9, "cosine", "Minimum cosine between up and the normal of a drawer's floor")
    floor_m: float = param(
        0.03, "m", "Usual height of a drawer's floor over its front's lower edge", source="board, runner and floor: 22-40 mm"
    )
    floor_m2: float = param(0.002, "m²", "Minimum observed area of a drawer's floor for its height to be measured")
    voxel_m: float = param(0.005, "m", "Voxel size of the fused surface in a drawer", gt=0)


def seen_from_drawer(drawer: Carrier, scene: Scene) -> Scene:
    """Frames that show the drawer open, their cameras moved as it closes, with depth only on it and what may lie in it.

    Positions in the new scene are those with the drawer closed.
    """
    params, capture = tuned(Params), scene.capture
    opened = [frame for frame in capture.frames if is_open(drawer.motion, frame.index)]
    images = _InDrawer(capture.images, drawer.front, {frame.index: frame for frame in opened})
    frames = tuple(found for frame in opened if (found := drawer.frame(frame)) is not None)
    fused = fuse_depth([_view(frame, images) for frame in frames], params.voxel_m)
    surface = SceneSurface(vertices_world=fused.vertices, faces=fused.faces, colours=fused.colours, voxel_m=params.voxel_m)
    parts = parts_of(surface)
    return Scene(
        capture=replace(capture, frames=frames, images=images, surface=surface),
        rendered_mm={frame.index: draw(parts, frame) for frame in frames},
        parts=parts,
    )


def is_open(motion: JointMotion, frame_index: int) -> bool:
    """Whether a drawer stands open far enough in a frame to show what lies in it."""
    return motion.state_in(frame_index) > tuned(InsideParams).ajar_m


def in_drawer(front: Rectangle3, points_world: Points) -> np.ndarray:
    """Mask of the points (n,) that may lie in a drawer, open or closed: before its closed front, up to somewhat over that
    front's upper edge, or behind it, clear of the boards of its unit.
    """
    params, deepest_m, (half_w, half_h) = tuned(Params), tuned(InsideParams).deepest_m, front.half_m
    x, y, z = front.world_from_front.inverse.apply(points_world).T
    before = (np.abs(x) < half_w) & (y < -params.gap_m) & (z > -half_h) & (z < half_h + params.above_m)
    behind = (np.abs(x) < half_w - params.gap_m) & (y < deepest_m) & (np.abs(z) < half_h - params.gap_m)
    return np.asarray((y > -deepest_m) & (before | behind))


def drawer_boards(drawer: Carrier, scene: Scene) -> tuple[PlaneRegion, ...]:
    """Both faces of a drawer's front, and the inner faces of its sides and rear board as far as they were observed; closed.

    `scene` is the recording, not as seen from the drawer.
    """
    front, motion = Leaf.of(drawer.front), drawer.motion

    def place(frame: Frame) -> Rigid3 | None:
        opened = is_open(motion, frame.index)
        return motion.opening(motion.state_in(frame.index)) @ front.world_from_front if opened else None

    left, right, rear = drawer_walls(front, place, scene, motion.largest)
    across = [y for y in (0.0, front.thickness_m, rear) if y is not None]
    faces = [(Rigid3(translation=np.array([0.0, y, 0.0])), front.width_m) for y in across]
    reach_m = rear or tuned(InsideParams).deepest_m
    for x in (left, right):
        if x is not None:
            turned = Rigid3(rotation_about_z(np.pi / 2), np.array([x, reach_m / 2, 0.0]))
            faces.append((turned, reach_m))
    return tuple(_region(front.world_from_front @ pose, width_m, front.height_m) for pose, width_m in faces)


def _region(world_from_plane: Rigid3, width_m: float, height_m: float) -> PlaneRegion:
    """Plane observed over a whole rectangle."""
    cell_m = tuned(Params).voxel_m
    shape = (math.ceil(height_m / cell_m), math.ceil(width_m / cell_m))
    return PlaneRegion(world_from_plane, width_m, height_m, np.ones(shape, bool), cell_m, width_m * height_m)


def drawer_floor(front: Rectangle3, scene: Scene) -> float:
    """Height of a drawer's floor in the scene seen from it: of its lowest level surface, else as drawers are built."""
    params, parts, lowest = tuned(Params), scene.parts, front.centre[2] - front.half_m[1]
    local = front.world_from_front.inverse.apply(parts.middles)
    level = (parts.upward > params.level_cos) & front.covers(local) & (local[:, 1] > params.gap_m)
    level &= parts.middles[:, 2] < lowest + 2 * params.floor_m
    if parts.areas_m2[level].sum() < params.floor_m2:
        return float(lowest + params.floor_m)
    return float(np.average(parts.middles[level, 2], weights=parts.areas_m2[level]))


@dataclass(frozen=True, slots=True, eq=False)
class _InDrawer(FrameImages):
    """Images of a recording, with depth only on a drawer and what may lie in it."""

    images: FrameImages
    front: Rectangle3
    frames: Mapping[int, Frame]  # as recorded

    def rgb(self, frame_index: int) -> Image:
        """The colour image."""
        return self.images.rgb(frame_index)

    def depth(self, frame_index: int) -> Depth:
        """The depth image, 0 outside the drawer."""
        depth, frame = self.images.depth(frame_index), self.frames[frame_index]
        seen = depth_points(depth.metres, frame.depth_camera).reshape(-1, 3)
        within = in_drawer(self.front, frame.world_from_camera.apply(seen))
        valid = depth.valid & within.reshape(depth.valid.shape)
        return Depth(np.where(valid, depth.metres, 0).astype(np.float32), valid)


def _view(frame: Frame, images: FrameImages) -> DepthView:
    camera = frame.depth_camera
    colour = cv2.resize(images.rgb(frame.index), (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return DepthView(images.depth(frame.index).metres, camera, frame.world_from_camera, colour)
