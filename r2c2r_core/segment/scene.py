"""A capture prepared for segmenting: images at hand, the fused surface seen from every frame, rays into it."""

from collections import OrderedDict
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Image, Vector3
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.model.capture import Capture, Frame
from r2c2r_core.progress import SILENT, Progress

_SURFACE_WIDTH_PX = 256  # of the rendered surface: the occluders that sensors miss are broad
_IMAGE_CACHE_BYTES = 500_000_000


@dataclass(slots=True, eq=False)
class Scene:
    """Images, sensor depth and rendered surface depth by frame number. Everything it returns is shared: do not write to it."""

    capture: Capture
    rendered_mm: dict[int, np.ndarray]  # uint16 millimetres, 0 = nothing
    _frames: dict[int, Frame] = field(default_factory=dict)
    _rgb: "OrderedDict[int, Image]" = field(default_factory=OrderedDict)
    _depth: "OrderedDict[int, DepthMetres]" = field(default_factory=OrderedDict)

    @property
    def frames(self) -> tuple[Frame, ...]:
        """All frames of the capture."""
        return self.capture.frames

    def frame(self, frame_index: int) -> Frame:
        """The frame with that number."""
        if not self._frames:
            self._frames = {frame.index: frame for frame in self.capture.frames}
        return self._frames[frame_index]

    def rgb(self, frame_index: int) -> Image:
        """The colour image; the latest few hundred megabytes stay in memory."""
        if frame_index in self._rgb:
            self._rgb.move_to_end(frame_index)
            return self._rgb[frame_index]
        image = self.capture.images.rgb(frame_index)
        self._rgb[frame_index] = image
        while len(self._rgb) > 1 and len(self._rgb) * image.nbytes > _IMAGE_CACHE_BYTES:
            self._rgb.popitem(last=False)
        return image

    def depth(self, frame_index: int) -> DepthMetres:
        """Sensor depth in metres, float32, 0 where the sensor has none."""
        if frame_index in self._depth:
            self._depth.move_to_end(frame_index)
            return self._depth[frame_index]
        depth = self.capture.images.depth(frame_index)
        metres = np.where(depth.valid, depth.metres, 0).astype(np.float32)
        self._depth[frame_index] = metres
        while len(self._depth) > 1 and len(self._depth) * metres.nbytes > _IMAGE_CACHE_BYTES // 2:
            self._depth.popitem(last=False)
        return metres

    def surface_depth(self, frame_index: int, size: tuple[int, int]) -> DepthMetres:
        """Depth of the fused surface seen from a frame, at (width, height); 0 where the scan has nothing."""
        rendered = self.rendered_mm[frame_index]
        if (rendered.shape[1], rendered.shape[0]) != size:
            rendered = cv2.resize(rendered, size, interpolation=cv2.INTER_NEAREST)
        return rendered.astype(np.float32) / 1000

    def filled_depth(self, frame_index: int) -> DepthMetres:
        """Sensor depth, and the fused surface where the sensor has none; 0 where neither knows."""
        sensor = self.depth(frame_index)
        surface = self.surface_depth(frame_index, (sensor.shape[1], sensor.shape[0]))
        return np.where(sensor > 0, sensor, surface)

    def pick(self, frame_index: int, x_px: float, y_px: float) -> Vector3 | None:
        """World point under a pixel of the colour image: sensor depth, else the fused surface, else None."""
        frame = self.frame(frame_index)
        depth = self._depth_near(frame_index, x_px, y_px)
        if depth is None:
            return None
        camera = frame.rgb_camera
        ray = np.array([(x_px - camera.cx) / camera.fx, (y_px - camera.cy) / camera.fy, 1.0])
        return frame.world_from_camera.apply((ray * depth)[None])[0]

    def ray(self, frame_index: int, x_px: float, y_px: float) -> tuple[Vector3, Vector3]:
        """Camera centre and unit direction (world) through a pixel of the colour image."""
        frame = self.frame(frame_index)
        camera = frame.rgb_camera
        direction = frame.world_from_camera.rotation @ np.array(
            [(x_px - camera.cx) / camera.fx, (y_px - camera.cy) / camera.fy, 1.0]
        )
        return frame.world_from_camera.translation, direction / np.linalg.norm(direction)

    def has_depth(self, frame_index: int, x_px: float, y_px: float) -> bool:
        """Whether the sensor measured anything at a pixel of the colour image or next to it."""
        depth, camera = self.depth(frame_index), self.frame(frame_index).rgb_camera
        row, column = int(y_px * depth.shape[0] / camera.height), int(x_px * depth.shape[1] / camera.width)
        return bool((depth[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] > 0).any())

    def _depth_near(self, frame_index: int, x_px: float, y_px: float) -> float | None:
        camera = self.frame(frame_index).rgb_camera
        for image, reach in ((self.depth(frame_index), 1), (self.surface_depth(frame_index, _surface_size(camera)), 1)):
            height, width = image.shape
            column = min(int(x_px * width / camera.width), width - 1)
            row = min(int(y_px * height / camera.height), height - 1)
            if image[row, column] > 0:
                return float(image[row, column])
            patch = image[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
            if (patch > 0).any():
                return float(np.median(patch[patch > 0]))
        return None


def prepare_scene(capture: Capture, cache: Path, *, progress: Progress = SILENT) -> Scene:
    """Render the fused surface into every frame, or take it from `cache`."""
    path = cache / "surface_depth.npz"
    indices = np.array([frame.index for frame in capture.frames])
    if path.is_file():
        with np.load(path) as stored:
            if np.array_equal(stored["frames"], indices):
                images = stored["millimetres"]
                return Scene(capture=capture, rendered_mm=dict(zip(indices.tolist(), images, strict=True)))
    rendered = {}
    for position, frame in enumerate(capture.frames):
        progress.at(position / len(capture.frames), f"looking at the surface from frame {position + 1}/{len(capture.frames)}")
        rendered[frame.index] = _render(capture, frame)
    if len({image.shape for image in rendered.values()}) == 1:
        cache.mkdir(parents=True, exist_ok=True)
        np.savez(path, frames=indices, millimetres=np.stack(list(rendered.values())))
    return Scene(capture=capture, rendered_mm=rendered)


def _surface_size(camera: Intrinsics) -> tuple[int, int]:
    return _SURFACE_WIDTH_PX, max(1, round(_SURFACE_WIDTH_PX * camera.height / camera.width))


def _render(capture: Capture, frame: Frame) -> np.ndarray:
    camera = frame.rgb_camera.resized(*_surface_size(frame.rgb_camera))
    surface = capture.surface
    raster = rasterize(
        surface.vertices_world,
        surface.faces,
        np.zeros((len(surface.vertices_world), 3), np.float32),
        camera,
        frame.world_from_camera.inverse,
    )
    return (raster.depth_m * 1000 + 0.5).clip(0, 65535).astype(np.uint16)
