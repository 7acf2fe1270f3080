"""Evidence for report.html: each object in a photo, and the closed model from the same camera."""

from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.export.plan import Plan
from r2c2r_core.export.preview import Soup, albedo, alone, scene_soup, shaded, soup_faces
from r2c2r_core.failing import apart
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.reconstruction import Reconstruction
from r2c2r_core.model.track import MaskTrack, at_rest
from r2c2r_core.progress import SILENT, Progress

_HEIGHT_PX = 180
_MARGIN = 0.25  # of the object's own box in the photo


def write_pictures(reconstruction: Reconstruction, plan: Plan, folder: Path, *, progress: Progress = SILENT) -> dict[str, str]:
    """One JPEG per object under pictures/; returns files by object name, without objects that no frame shows."""
    soup = scene_soup(plan, 0.0)
    tracks = {track.name: track for track in reconstruction.tracks if track.masks}
    written = {}
    for item in progress.each(reconstruction.scene.objects, "pictures"):
        track = tracks.get(item.name)
        frame = None if track is None else _best_frame(at_rest(reconstruction.capture, track).frames, track)
        if track is None or frame is None:
            continue
        with apart("export", item.name, {}):
            bodies = {number for number, body in enumerate(plan.bodies, start=1) if body.object_name == item.name}
            photo = reconstruction.capture.images.rgb(frame.index)
            name = f"pictures/{item.name}.jpg"
            shown = soup if item.carried_by is None else alone(soup, bodies)  # a closed drawer hides it
            pair = side_by_side(photo, track.masks[frame.index], frame, shown, bodies)
            (folder / "pictures").mkdir(exist_ok=True)
            (folder / name).write_bytes(cv2.imencode(".jpg", pair[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 88])[1].tobytes())
            written[item.name] = name
    return written


def side_by_side(photo: Image, mask: PackedMask, frame: Frame, soup: Soup, bodies: set[int]) -> Image:
    """The photo cropped to the object's mask, and the same crop of the model: the object in colour, the rest pale."""
    left, top, right, bottom = _window(mask)
    scale = _HEIGHT_PX / (bottom - top)
    size = (max(1, round((right - left) * scale)), _HEIGHT_PX)
    camera = frame.rgb_camera
    window = Intrinsics(
        fx=camera.fx * scale,
        fy=camera.fy * scale,
        cx=(camera.cx - left) * scale,
        cy=(camera.cy - top) * scale,
        width=size[0],
        height=size[1],
    )
    crop = np.ascontiguousarray(photo[top:bottom, left:right])
    seen = cv2.resize(crop, size, interpolation=cv2.INTER_AREA)
    drawn = _model_in(window, frame.world_from_camera.inverse, soup, bodies)
    gap = np.full((_HEIGHT_PX, 4, 3), 255, np.uint8)
    return np.concatenate([np.asarray(seen, dtype=np.uint8), gap, drawn], axis=1)


def _model_in(camera: Intrinsics, camera_from_world: Rigid3, soup: Soup, bodies: set[int]) -> Image:
    marks = rasterize(soup.corners, soup_faces(soup), np.column_stack([soup.uv, soup.ids]), camera, camera_from_world)
    normals = rasterize(soup.corners, soup_faces(soup), soup.normals, camera, camera_from_world).attributes
    colour = shaded(albedo(soup, marks.attributes), normals, camera_from_world)
    own = np.isin(np.rint(marks.attributes[..., 2]), list(bodies))
    colour[~own] = 0.75 * 250 + 0.25 * colour[~own]
    colour[marks.depth_m == 0] = 250
    return np.asarray(colour.clip(0, 255), dtype=np.uint8)


def _best_frame(frames: tuple[Frame, ...], track: MaskTrack) -> Frame | None:
    """The frame that shows most of the object, preferring sharp ones among nearly equal ones."""
    seen = [frame for frame in frames if frame.index in track.masks and track.masks[frame.index].area_px > 0]
    if not seen:
        return None
    most = max(track.masks[frame.index].area_px for frame in seen)
    large = [frame for frame in seen if track.masks[frame.index].area_px > 0.8 * most]
    return max(large, key=lambda frame: (frame.sharpness, -frame.index))


def _window(mask: PackedMask) -> tuple[int, int, int, int]:
    """Left, top, right, bottom of the photo's window: the mask's box with a margin, at most twice as wide as high."""
    margin = _MARGIN * max(mask.box_width, mask.box_height) + 4
    height = mask.box_height + 2 * margin
    width = min(max(mask.box_width + 2 * margin, 0.75 * height), 2.0 * height)
    if mask.box_width + margin > width:
        height = (mask.box_width + margin) / 2
        width = 2.0 * height
    middle_x, middle_y = mask.left + mask.box_width / 2, mask.top + mask.box_height / 2
    left, right = _inside(middle_x - width / 2, width, mask.width)
    top, bottom = _inside(middle_y - height / 2, height, mask.height)
    return left, top, right, bottom


def _inside(start: float, length: float, size: int) -> tuple[int, int]:
    length = min(length, size)
    first = round(min(max(start, 0.0), size - length))
    return first, max(first + 1, min(size, round(first + length)))
