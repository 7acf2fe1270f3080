"""A capture with its acceleration structures: decoded images, the fused surface rendered into every frame, ray picking."""

import os
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Generic, TypeVar

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Image, Points, Vector3
from r2c2r_core.geometry.camera import Intrinsics, pixel_rays
from r2c2r_core.geometry.light import balanced
from r2c2r_core.geometry.visibility import DepthNoise, look_up
from r2c2r_core.model.capture import Capture, Frame
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.segment.holes import find_rim
from r2c2r_core.segment.surface import SurfaceParts, draw, drawn_size, parts_of
from r2c2r_core.threads import in_threads
from r2c2r_core.tuning import param, tuned

T = TypeVar("T", Image, DepthMetres)

_IMAGE_CACHE_BYTES = 500_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of depth at steps and in holes."""

    step_px: float = param(
        6.0,
        "px",
        "Maximum distance to a pixel with depth beside a step: farther off is surface that returns no light",
        gt=0,
        source="phones drop 2-5 pixels at either side of a step",
    )
    step_m: float = param(
        0.08, "m", "Minimum difference between the depths of a step's sides", gt=0, source="handles protrude by up to 5 cm"
    )
    level_m: float = param(0.02, "m", "Maximum distance from a level surface of depth around a hole that lies on it", gt=0)
    level_share: float = param(
        0.5,
        "share",
        "Minimum fraction of a hole's rim in a level surface, such as a glass hob's worktop, for the hole to lie in it",
    )
    below_m: float = param(0.08, "m", "Minimum depth below a level surface that is seen through: sinks have 0.12 m", gt=0)
    asked_frames: int = param(
        24, "count", "Maximum number of frames, spread over the recording, tested for seeing through a hole", ge=1
    )


@dataclass(slots=True, eq=False)
class Scene:
    """Images, sensor depth and rendered surface depth by frame number. All returned arrays are shared: do not write to them."""

    capture: Capture
    rendered_mm: dict[int, np.ndarray]  # uint16 millimetres, 0 = nothing
    parts: SurfaceParts
    _frames: dict[int, Frame] = field(default_factory=dict)
    _camera_from_world: np.ndarray | None = None
    _rgb: "_Recent[Image]" = field(default_factory=lambda: _Recent(_IMAGE_CACHE_BYTES))
    _balanced: "_Recent[Image]" = field(default_factory=lambda: _Recent(_IMAGE_CACHE_BYTES // 2))
    _depth: "_Recent[DepthMetres]" = field(default_factory=lambda: _Recent(_IMAGE_CACHE_BYTES // 4))
    _filled: "_Recent[DepthMetres]" = field(default_factory=lambda: _Recent(_IMAGE_CACHE_BYTES // 4))

    @property
    def noise(self) -> DepthNoise:
        """Depth noise model of the recording."""
        return self.capture.depth_noise

    @property
    def floor_m(self) -> float | None:
        """Height of the floor (world z); None where none was found."""
        return 0.0 if self.capture.room.floor_found else None

    @property
    def frames(self) -> tuple[Frame, ...]:
        """All frames of the capture."""
        return self.capture.frames

    def frame(self, frame_index: int) -> Frame:
        """Frame with a given index."""
        if not self._frames:
            self._frames = {frame.index: frame for frame in self.capture.frames}
        return self._frames[frame_index]

    def seen_from_all(self, point_world: Vector3) -> Points:
        """A world point in the camera frame of every frame, (frames, 3)."""
        if self._camera_from_world is None:
            self._camera_from_world = np.stack([frame.world_from_camera.inverse.matrix for frame in self.frames])[:, :3]
        return np.asarray(self._camera_from_world @ np.append(point_world, 1.0))

    def rgb(self, frame_index: int) -> Image:
        """Colour image; the most recent few hundred megabytes stay in memory."""
        return self._rgb.get(frame_index, self.capture.images.rgb)

    def balanced(self, frame_index: int) -> Image:
        """Colour image under the recording's common exposure and white balance."""
        return self._balanced.get(frame_index, lambda index: balanced(self.rgb(index), self.frame(index).gain))

    def depth(self, frame_index: int) -> DepthMetres:
        """Sensor depth in metres, float32, 0 where the sensor has none."""
        return self._depth.get(frame_index, self._sensor_depth)

    def prefetch(self) -> Iterator[None]:
        """Load the images of one frame after another, as many as stay in memory."""
        held = 0
        for frame in self.frames:
            held += self.rgb(frame.index).nbytes
            if held > _IMAGE_CACHE_BYTES:
                return
            self.filled_depth(frame.index)
            yield

    def surface_depth(self, frame_index: int, size: tuple[int, int]) -> DepthMetres:
        """Depth of the fused surface seen from a frame, at (width, height); 0 where the scan has no surface."""
        rendered = self.rendered_mm[frame_index]
        if (rendered.shape[1], rendered.shape[0]) != size:
            rendered = cv2.resize(rendered, size, interpolation=cv2.INTER_NEAREST)
        return rendered.astype(np.float32) / 1000

    def filled_depth(self, frame_index: int) -> DepthMetres:
        """Sensor depth, filled with the fused surface where the sensor has none; 0 where both lack it."""
        return self._filled.get(frame_index, self._fill_depth)

    def pick(self, frame_index: int, x_px: float, y_px: float) -> Vector3 | None:
        """World point under a pixel of the colour image; None where nothing is known.

        Sensor depth; in a hole of it the surrounding level surface (a glass hob), else the fused surface.
        """
        frame = self.frame(frame_index)
        depth = self._depth_near(frame_index, x_px, y_px)
        if depth is None:
            return None
        return frame.world_from_camera.apply(pixel_rays(np.array([x_px, y_px]), frame.rgb_camera) * depth)

    def ray(self, frame_index: int, x_px: float, y_px: float) -> tuple[Vector3, Vector3]:
        """Camera centre and unit direction (world) through a pixel of the colour image."""
        frame = self.frame(frame_index)
        direction = frame.world_from_camera.rotation @ pixel_rays(np.array([x_px, y_px]), frame.rgb_camera)
        return frame.world_from_camera.translation, direction / np.linalg.norm(direction)

    def has_depth(self, frame_index: int, x_px: float, y_px: float) -> bool:
        """Whether the sensor measured anything at a pixel of the colour image or next to it."""
        depth, camera = self.depth(frame_index), self.frame(frame_index).rgb_camera
        row, column = int(y_px * depth.shape[0] / camera.height), int(x_px * depth.shape[1] / camera.width)
        return bool((depth[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] > 0).any())

    def depth_at_step(self, frame_index: int, x_px: float, y_px: float) -> float | None:
        """Depth of the nearer side at a pixel of the colour image without depth beside a step; None elsewhere.

        Sensors drop pixels beside a step, and the surface fused from other frames ends short of such edges.
        """
        params, depth, camera = tuned(Params), self.depth(frame_index), self.frame(frame_index).rgb_camera
        x, y = x_px * depth.shape[1] / camera.width, y_px * depth.shape[0] / camera.height
        column, row = min(int(x), depth.shape[1] - 1), min(int(y), depth.shape[0] - 1)
        if depth[row, column] > 0:
            return None
        reach = int(2 * params.step_px)
        top, left = max(row - reach, 0), max(column - reach, 0)
        patch = depth[top : row + reach + 1, left : column + reach + 1]
        down, right = np.nonzero(patch > 0)
        away, known = np.hypot(down + top + 0.5 - y, right + left + 0.5 - x), patch[down, right]
        if away.min(initial=np.inf) > params.step_px or np.diff(np.sort(known)).max(initial=0.0) < params.step_m:
            return None
        return float(known[np.argmin(away)])

    def _sensor_depth(self, frame_index: int) -> DepthMetres:
        depth = self.capture.images.depth(frame_index)
        return np.where(depth.valid, depth.metres, 0).astype(np.float32)

    def _fill_depth(self, frame_index: int) -> DepthMetres:
        sensor = self.depth(frame_index)
        surface = self.surface_depth(frame_index, (sensor.shape[1], sensor.shape[0]))
        return np.where(sensor > 0, sensor, surface)

    def _depth_near(self, frame_index: int, x_px: float, y_px: float) -> float | None:
        camera = self.frame(frame_index).rgb_camera
        beside = self.depth_at_step(frame_index, x_px, y_px)
        if beside is not None:
            return beside
        measured = _value_near(self.depth(frame_index), camera, x_px, y_px)
        if measured is not None:
            return measured
        fused = _value_near(self.surface_depth(frame_index, drawn_size(camera)), camera, x_px, y_px)
        level = self.level_depth(frame_index, x_px, y_px)
        return level if fused is None or (level is not None and level < fused) else fused

    def level_depth(self, frame_index: int, x_px: float, y_px: float) -> float | None:
        """Depth, at a pixel without any, of the level surface that contains most of the hole's rim, on all sides of the pixel.

        None where there is no such surface, or where other frames look through it. No frame has depth on a glass hob, and the
        fused surface shows the space below the worktop through it.
        """
        params, frame = tuned(Params), self.frame(frame_index)
        rim = find_rim(frame, self.depth(frame_index), x_px, y_px)
        if rim is None or len(rim.points) == 0:
            return None
        heights = np.sort(rim.points[:, 2])
        ends = np.searchsorted(heights, heights + 2 * params.level_m, side="right")
        level_m = heights[int(np.argmax(ends - np.arange(len(heights))))] + params.level_m
        flush = np.abs(rim.points[:, 2] - level_m) <= params.level_m
        if flush.mean() < params.level_share or not rim.encloses(flush):
            return None
        level_m = float(np.median(rim.points[flush, 2]))
        ray = frame.world_from_camera.rotation @ pixel_rays(np.array([x_px, y_px]), frame.rgb_camera)
        depth = (level_m - frame.world_from_camera.translation[2]) / ray[2]
        place = frame.world_from_camera.translation + depth * ray
        return None if self._seen_through(place) else float(depth)

    def _seen_through(self, point_world: Vector3) -> bool:
        """Whether most frames that measured depth at or behind a world point measured it behind."""
        params, votes = tuned(Params), 0
        ahead = [self.frames[i] for i in np.flatnonzero(self.seen_from_all(point_world)[:, 2] > 0)]
        for i in np.linspace(0, len(ahead) - 1, min(len(ahead), params.asked_frames)).round().astype(int):
            frame = ahead[i]
            sight = look_up(point_world[None], frame.world_from_camera, frame.depth_camera, self.depth(frame.index))
            votes += int(self.noise.seen_through(sight.seen_m, sight.z_m, params.below_m)[0])
            votes -= int(self.noise.agrees(sight.seen_m, sight.z_m, params.below_m)[0])
        return votes > 0


def _value_near(depth_m: DepthMetres, camera: Intrinsics, x_px: float, y_px: float) -> float | None:
    """Depth at a pixel of the colour image, else the median of its neighbours; None where none of them is known."""
    height, width = depth_m.shape
    column = min(int(x_px * width / camera.width), width - 1)
    row = min(int(y_px * height / camera.height), height - 1)
    if depth_m[row, column] > 0:
        return float(depth_m[row, column])
    patch = depth_m[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    return float(np.median(patch[patch > 0])) if (patch > 0).any() else None


def prepare_scene(capture: Capture, cache: Path, *, progress: Progress = SILENT) -> Scene:
    """Scene with the fused surface rendered into every frame, or loaded from `cache`."""
    path = cache / "surface_depth.npz"
    indices = np.array([frame.index for frame in capture.frames])
    parts = parts_of(capture.surface)
    if path.is_file():
        with np.load(path) as stored:
            if np.array_equal(stored["frames"], indices):
                drawn_before = dict(zip(indices.tolist(), stored["millimetres"], strict=True))
                return Scene(capture=capture, rendered_mm=drawn_before, parts=parts)
    rendered: dict[int, np.ndarray] = {}
    for frame, drawn in zip(capture.frames, in_threads(lambda frame: draw(parts, frame), capture.frames), strict=True):
        rendered[frame.index] = drawn
        progress.at(len(rendered) / len(indices), f"looking at the surface from frame {len(rendered)}/{len(indices)}")
    if len({image.shape for image in rendered.values()}) == 1:
        cache.mkdir(parents=True, exist_ok=True)
        unfinished = cache / f".surface_depth.{os.getpid()}.npz"
        np.savez(unfinished, frames=indices, millimetres=np.stack(list(rendered.values())))
        unfinished.replace(path)
    return Scene(capture=capture, rendered_mm=rendered, parts=parts)


class _Recent(Generic[T]):
    """Most recent arrays by frame number, up to a number of bytes. Thread-safe."""

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes, self._bytes = most_bytes, 0
        self._kept: OrderedDict[int, T] = OrderedDict()
        self._lock = Lock()

    def get(self, frame_index: int, load: Callable[[int], T]) -> T:
        with self._lock:
            if frame_index in self._kept:
                self._kept.move_to_end(frame_index)
                return self._kept[frame_index]
        loaded = load(frame_index)
        with self._lock:
            if frame_index not in self._kept:
                self._kept[frame_index] = loaded
                self._bytes += loaded.nbytes
            while len(self._kept) > 1 and self._bytes > self._most_bytes:
                self._bytes -= self._kept.popitem(last=False)[1].nbytes
        return loaded
