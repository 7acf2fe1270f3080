"""Images and meshes for the browser, created once and cached in the project's previews."""

import threading
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from app.db import queries
from app.db.engine import reading
from app.errors import NotFound, NotReady
from app.files import ProjectFiles, inside
from app.services import projects, views
from app.services.candidates import candidate_mesh, generate_key
from app.services.context import Context
from r2c2r_core.ingest.store import depth_path, rgb_path

WIDTHS = (160, 320, 480, 960, 1920)
_DEPTH_WIDTH = 640  # pixels of a depth picture
_FILLED_OPACITY = 70  # of pixels without a measurement

_LOCKS = [threading.Lock() for _ in range(16)]


def frame(context: Context, project_id: str, index: int, width: int | None) -> Path:
    """A frame's JPEG, at its stored size or at one of the cached widths."""
    files = _files(context, project_id)
    stored, size = _stored_frame(files, index)
    if width is None or width >= size[0]:
        return stored
    kept = next((w for w in WIDTHS if w >= width), size[0])
    if kept >= size[0]:
        return stored
    return kept_file(files, files.previews / "frames" / str(kept) / f"{index:06d}.jpg", lambda: _shrink(stored, kept))


def depth(context: Context, project_id: str, index: int) -> Path:
    """A frame's depth in colours, at preview size; unmeasured pixels are filled in faintly."""
    files = _files(context, project_id)
    colour, _ = _stored_frame(files, index)
    stored = depth_path(views.frames_folder(files), index)
    if not stored.is_file():
        raise NotFound(f"frame {index} has no depth image")
    return kept_file(
        files, files.previews / "depth" / f"{index:06d}.png", lambda: _colour_depth(stored, _shrink(colour, _DEPTH_WIDTH))
    )


def thumbnail(context: Context, project_id: str) -> Path:
    """The picture of the finished scene, or the sharpest frame from the middle of the recording."""
    table = projects.frame_table(_files(context, project_id))
    middle = table[len(table) // 4 : max(3 * len(table) // 4, len(table) // 4 + 1)]
    best = max(middle, key=lambda entry: float(entry["sharpness"]))
    return frame(context, project_id, int(best["index"]), 480)


def arriving(context: Context, project_id: str) -> Path:
    """The newest frame of a sample that is being rendered."""
    path = _files(context, project_id).arriving
    if not path.is_file():
        raise NotFound("nothing is rendered for this project now", hint="look at its frames")
    return path


def scan(context: Context, project_id: str, side: str) -> Path:
    """The fused scan from above ("plan") or from the filming side ("view"), rendered when the recording was read."""
    path = _files(context, project_id).root / f"scan-{side}.png"
    if not path.is_file():
        raise NotFound("the scan was not drawn", hint="import the recording again")
    return path


def candidate_glb(context: Context, project_id: str, object_id: int, candidate: str) -> Path:
    """A candidate as GLB."""
    files, name = _object_files(context, project_id, object_id)
    key = generate_key(files, name)
    target = inside(files.previews, "candidates", str(object_id), f"{candidate}-{key}.glb")
    return kept_file(files, target, lambda: _glb(files, name, candidate))


def candidate_png(context: Context, project_id: str, object_id: int, candidate: str) -> Path:
    """A candidate rendered."""
    files, name = _object_files(context, project_id, object_id)
    key = generate_key(files, name)
    target = inside(files.previews, "candidates", str(object_id), f"{candidate}-{key}.png")
    return kept_file(files, target, lambda: _picture(files, name, candidate))


def _files(context: Context, project_id: str) -> ProjectFiles:
    with reading(context.engine) as session:
        return context.files(queries.drawn_in(session, project_id))


def _object_files(context: Context, project_id: str, object_id: int) -> tuple[ProjectFiles, str]:
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        return context.files(project), queries.object_row(session, project_id, object_id, deleted=True).result_name


def _stored_frame(files: ProjectFiles, index: int) -> tuple[Path, tuple[int, int]]:
    for entry in projects.frame_table(files):
        if entry["index"] == index:
            stored = rgb_path(views.frames_folder(files), index)
            if not stored.is_file():
                raise NotReady(f"frame {index} is being read again", hint="wait for the running job")
            return stored, (int(entry["width"]), int(entry["height"]))
    raise NotFound(f"the recording has no frame {index}")


def kept_file(files: ProjectFiles, target: Path, make: Callable[[], bytes]) -> Path:
    """The project's file, created if missing, and only once for concurrent requests."""
    if target.is_file():
        return target
    with _LOCKS[hash(target) % len(_LOCKS)]:
        if not target.is_file():
            files.write(target, make())
    return target


def _shrink(stored: Path, width: int) -> bytes:
    scale = next((f for f in (8, 4, 2) if _reduced_width(stored, f) >= width), 1)
    flag = {8: cv2.IMREAD_REDUCED_COLOR_8, 4: cv2.IMREAD_REDUCED_COLOR_4, 2: cv2.IMREAD_REDUCED_COLOR_2}.get(
        scale, cv2.IMREAD_COLOR
    )
    image = cv2.imread(str(stored), flag | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise NotFound(f"{stored.name} is not readable")
    height = max(round(image.shape[0] * width / image.shape[1]), 1)
    small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    return cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 82])[1].tobytes()


def _reduced_width(stored: Path, factor: int) -> int:
    from PIL import Image

    with Image.open(stored) as opened:  # reads the header only
        return opened.width // factor


def _colour_depth(stored: Path, preview: bytes) -> bytes:
    from r2c2r_core.ingest.depth import decode_depth, fill_for_display
    from r2c2r_core.ingest.upsample import upsample_depth

    raw = cv2.imread(str(stored), cv2.IMREAD_UNCHANGED)
    if raw is None:
        raise NotFound(f"{stored.name} is not readable")
    guide = cv2.cvtColor(cv2.imdecode(np.frombuffer(preview, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    metres = upsample_depth(decode_depth(raw), guide)
    valid = metres > 0
    near, far = np.percentile(metres[valid], (2, 98)) if valid.any() else (0.0, 1.0)
    shown = fill_for_display(metres) if valid.any() else metres
    share = np.clip((shown - near) / max(far - near, 1e-3), 0, 1)
    colours = cv2.applyColorMap((255 - share * 255).astype(np.uint8), cv2.COLORMAP_TURBO)
    opacity = np.where(valid, 255, _FILLED_OPACITY if valid.any() else 0).astype(np.uint8)
    return cv2.imencode(".png", np.dstack([colours, opacity]))[1].tobytes()


def _glb(files: ProjectFiles, name: str, candidate: str) -> bytes:
    from app.services.meshes import mesh_glb, upright

    asset = candidate_mesh(files, name, candidate)
    return mesh_glb(asset.mesh, upright(files, name, candidate))


def _picture(files: ProjectFiles, name: str, candidate: str) -> bytes:
    from app.drawing import mesh_picture
    from app.services.meshes import upright

    asset = candidate_mesh(files, name, candidate)
    return mesh_picture(asset.mesh, upright(files, name, candidate))
