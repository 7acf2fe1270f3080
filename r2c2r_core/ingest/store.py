"""A recording's pixels on disk: rgb/<index:06d>.jpg and depth/<index:06d>.png in a folder that is written atomically."""

import errno
import shutil
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Image
from r2c2r_core.disk import explained_io
from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.depth import decode_depth, encode_depth
from r2c2r_core.model.capture import Depth, Frame

_CACHED_IMAGES, _CACHED_DEPTHS = 12, 48  # 25 MB at 960x720, 9 MB at 256x192
_PARTIAL = ".partial"
_OF_WRITING = (errno.ENOSPC, errno.EDQUOT, errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR)


class StoredImages:
    """Images read from disk on demand, with the last few cached. Safe to share between threads."""

    def __init__(self, store: Path) -> None:
        self.store = store
        self._rgb = _Recent(lambda index: _load_rgb(rgb_path(store, index)), _CACHED_IMAGES)
        self._depth = _Recent(lambda index: _load_depth(depth_path(store, index)), _CACHED_DEPTHS)

    def rgb(self, frame_index: int) -> Image:
        """The colour image, at its stored resolution; read-only."""
        return self._rgb.get(frame_index)

    def depth(self, frame_index: int) -> Depth:
        """The depth image, at its stored resolution, after confidence and flying-pixel rejection; read-only."""
        metres = self._depth.get(frame_index)
        return Depth(metres, metres > 0)

    def __reduce__(self) -> tuple[type["StoredImages"], tuple[Path]]:
        return StoredImages, (self.store,)


def open_images(store: Path, frames: tuple[Frame, ...]) -> StoredImages:
    """The stored images of a capture; raises CaptureError when a file is missing."""
    for frame in frames:
        for path in (rgb_path(store, frame.index), depth_path(store, frame.index)):
            if not path.is_file():
                raise CaptureError(
                    f"{path}: missing, though the capture has frame {frame.index}", hint="read the recording again"
                )
    return StoredImages(store)


def rgb_path(store: Path, index: int) -> Path:
    """Path of a frame's colour image."""
    return store / "rgb" / f"{index:06d}.jpg"


def depth_path(store: Path, index: int) -> Path:
    """Path of a frame's depth image."""
    return store / "depth" / f"{index:06d}.png"


@contextmanager
def new_store(store: Path) -> Iterator[Path]:
    """A temporary folder for a recording's images, renamed to `store` only if the block succeeds."""
    partial = store.with_name(store.name + _PARTIAL)
    try:
        shutil.rmtree(partial, ignore_errors=True)
        for name in ("rgb", "depth"):
            (partial / name).mkdir(parents=True)
        yield partial
        shutil.rmtree(store, ignore_errors=True)
        partial.rename(store)
    except OSError as problem:
        if problem.errno not in _OF_WRITING:
            raise
        with explained_io(store):
            raise
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def write_rgb(store: Path, index: int, jpeg: bytes) -> None:
    """Store a frame's colour image, byte for byte."""
    rgb_path(store, index).write_bytes(jpeg)


def write_depth(store: Path, index: int, depth_m: DepthMetres) -> None:
    """Store a frame's depth image; 0 is unknown."""
    done, png = cv2.imencode(".png", encode_depth(depth_m), [cv2.IMWRITE_PNG_COMPRESSION, 1])
    assert done, "encoding a uint16 array cannot fail"
    depth_path(store, index).write_bytes(png.tobytes())


class _Recent:
    """An LRU cache of a function of one number."""

    def __init__(self, load: Callable[[int], np.ndarray], size: int) -> None:
        self._load, self._size = load, size
        self._kept: OrderedDict[int, np.ndarray] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, index: int) -> np.ndarray:
        with self._lock:
            if index in self._kept:
                self._kept.move_to_end(index)
                return self._kept[index]
        loaded = self._load(index)
        loaded.setflags(write=False)  # several callers share it
        with self._lock:
            self._kept[index] = loaded
            while len(self._kept) > self._size:
                self._kept.popitem(last=False)
        return loaded


def _load_rgb(path: Path) -> np.ndarray:
    return cv2.cvtColor(_read(path, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION), cv2.COLOR_BGR2RGB)


def _load_depth(path: Path) -> np.ndarray:
    return decode_depth(_read(path, cv2.IMREAD_UNCHANGED))


def _read(path: Path, flags: int) -> np.ndarray:
    try:
        content = np.fromfile(path, np.uint8)
    except OSError as problem:
        raise CaptureError(f"{path}: {problem.strerror or problem}", hint="read the recording again") from problem
    image = cv2.imdecode(content, flags) if len(content) else None
    if image is None:
        raise CaptureError(f"{path}: not a readable image", hint="read the recording again")
    return np.asarray(image)
