"""Evidence of one object for mesh generation: its good frames, cropped to it, with mask and depth."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Image, Mask, Points, Vector3
from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.geometry.camera import Intrinsics, depth_points, sample_through
from r2c2r_core.geometry.light import balanced
from r2c2r_core.geometry.masks import PackedMask, unpack_mask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.views import MaskView, choose_views, is_cropped, stands_open, view_scores
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.model.capture import Capture, Frame
from r2c2r_core.model.track import FrontPanel, MaskTrack
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of depth edges."""

    edge_step: float = param(
        0.06,
        "ratio",
        "Depth step within 3x3 pixels, relative to the depth, above which a pixel mixes depths at an edge",
        source="backends.md 2.7",
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """One frame, cropped to the object with a margin; colour, mask and depth keep their own resolutions."""

    frame_index: int
    rgb: Image  # at the recording's common exposure
    mask: Mask
    rgb_camera: Intrinsics
    depth_m: DepthMetres
    depth_camera: Intrinsics
    world_from_camera: Rigid3
    sharpness: float  # rank among the pool, 0..1
    is_cropped: bool  # the mask touches the image border
    noise: DepthNoise

    @property
    def eye_world(self) -> Vector3:
        """Camera centre."""
        return self.world_from_camera.translation


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """One object's capture, track and pool of good frames, best first."""

    capture: Capture
    track: MaskTrack
    pool: tuple[View, ...]


def gather_evidence(capture: Capture, track: MaskTrack, pool_size: int) -> Evidence:
    """Load the object's good frames (paper 4.2; see geometry/views.py), in one joint state; raises ObjectNotSeen."""
    frames = [frame for frame in capture.frames if frame.index in track.masks and track.masks[frame.index].area_px > 0]
    if not frames:
        raise ObjectNotSeen(f"{track.name}: its masks are empty in all frames", hint="click it in a frame that shows it")
    frames = [frame for frame in frames if frame.index not in track.opened_frames] or frames
    largest = max(frames, key=lambda frame: track.masks[frame.index].area_px)
    centre = object_centre(capture, track, largest)
    chosen = choose_views([_view_of(frame, track, centre) for frame in frames], pool_size)
    order = np.argsort(np.argsort([view.sharpness for view in chosen])) / max(len(chosen) - 1, 1)
    best_first = np.argsort(-view_scores(chosen), kind="stable")
    pool = [_load_view(capture, chosen[k].mask, capture.frame(chosen[k].frame_index), float(order[k])) for k in best_first]
    front = track.front
    closed = [
        view for view in pool if front is None or not _is_open(view, front)
    ]  # one joint state: the one in which the front was measured
    return Evidence(capture=capture, track=track, pool=tuple(closed or pool))


def object_centre(capture: Capture, track: MaskTrack, frame: Frame) -> Vector3:
    """World position of the object: the segmenter's measurement, else the median depth point of `frame`."""
    if track.box is not None:
        return track.box.world_from_object.translation
    if track.front is not None:
        return track.front.centre
    view = _load_view(capture, track.masks[frame.index], frame, 1.0)
    points = masked_points(view)
    if len(points) == 0:
        return frame.world_from_camera.apply(np.array([0.0, 0.0, 1.5]))
    return np.median(points, axis=0)


def masked_points(view: View, erosion_px: float = 1.0) -> Points:
    """World points of the depth pixels well inside the mask; `erosion_px` in depth pixels."""
    inside = depth_mask(view, erosion_px) & (view.depth_m > 0) & ~depth_edges(view.depth_m)
    return view.world_from_camera.apply(depth_points(view.depth_m, view.depth_camera)[inside])


def depth_mask(view: View, erosion_px: float = 0.0) -> Mask:
    """The mask at depth resolution, eroded by depth pixels (dilated where negative)."""
    ratio = view.rgb_camera.fx / view.depth_camera.fx
    mask = moved_edge(view.mask, -erosion_px * ratio)
    values, inside = sample_through(mask, view.rgb_camera, view.depth_camera)
    return values & inside


def moved_edge(mask: Mask, outwards_px: float) -> Mask:
    """The mask with its edge moved outwards by pixels (inwards where negative); the image border does not erode it."""
    radius = round(abs(outwards_px))
    if radius == 0:
        return mask
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    change = cv2.dilate if outwards_px > 0 else cv2.erode
    return np.asarray(change(mask.astype(np.uint8), kernel), dtype=bool)


def depth_edges(depth_m: DepthMetres) -> Mask:
    """Mask of pixels whose 3x3 neighbourhood contains a depth step."""
    filled = np.where(depth_m > 0, depth_m, np.nan).astype(np.float32)
    near = cv2.erode(np.where(np.isnan(filled), np.float32(1e3), filled), np.ones((3, 3), np.uint8))
    far = cv2.dilate(np.where(np.isnan(filled), np.float32(0), filled), np.ones((3, 3), np.uint8))
    return np.asarray((depth_m > 0) & (far - near > tuned(Params).edge_step * near))


def _view_of(frame: Frame, track: MaskTrack, centre_world: Vector3) -> MaskView:
    return MaskView(
        frame_index=frame.index,
        mask=track.masks[frame.index],
        sharpness=frame.sharpness,
        confidence=track.confidence.get(frame.index, 0.5),
        from_object=frame.world_from_camera.translation - centre_world,
    )


def _is_open(view: View, front: FrontPanel) -> bool:
    """Whether a view shows the front open."""
    return stands_open(-front.world_from_front.inverse.apply(masked_points(view))[:, 1])


def _load_view(capture: Capture, packed: PackedMask, frame: Frame, sharpness: float) -> View:
    rgb = capture.images.rgb(frame.index)
    depth = capture.images.depth(frame.index)
    margin = 0.2 * max(packed.box_width, packed.box_height) + 0.02 * packed.width
    box = (packed.left - margin, packed.top - margin)
    end = (packed.left + packed.box_width + margin, packed.top + packed.box_height + margin)
    scale = np.array([frame.depth_camera.fx / frame.rgb_camera.fx, frame.depth_camera.fy / frame.rgb_camera.fy])
    offset = np.array([frame.depth_camera.cx, frame.depth_camera.cy]) - scale * [frame.rgb_camera.cx, frame.rgb_camera.cy]
    rgb_window, rgb_camera = _window(frame.rgb_camera, np.array(box), np.array(end))
    depth_window, depth_camera = _window(frame.depth_camera, scale * box + offset, scale * end + offset)
    return View(
        frame_index=frame.index,
        rgb=np.ascontiguousarray(balanced(rgb[rgb_window], frame.gain)),
        mask=np.ascontiguousarray(unpack_mask(packed)[rgb_window]),
        rgb_camera=rgb_camera,
        depth_m=np.where(depth.valid, depth.metres, 0.0).astype(np.float32)[depth_window],
        depth_camera=depth_camera,
        world_from_camera=frame.world_from_camera,
        sharpness=sharpness,
        is_cropped=is_cropped(packed),
        noise=capture.depth_noise,
    )


def _window(camera: Intrinsics, start: np.ndarray, end: np.ndarray) -> tuple[tuple[slice, slice], Intrinsics]:
    """The image window between two corners, clipped to the image, and its camera."""
    left, top = (int(max(np.floor(v), 0)) for v in start)
    right, bottom = int(min(np.ceil(end[0]), camera.width)), int(min(np.ceil(end[1]), camera.height))
    right, bottom = max(right, left + 1), max(bottom, top + 1)
    cropped = Intrinsics(
        fx=camera.fx, fy=camera.fy, cx=camera.cx - left, cy=camera.cy - top, width=right - left, height=bottom - top
    )
    return (slice(top, bottom), slice(left, right)), cropped
