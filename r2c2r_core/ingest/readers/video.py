"""Frames of a video, decoded once from front to back: a film cannot be entered anywhere without decoding what precedes it.

FFmpeg guesses a format from the content, and among its formats are lists of other files and descriptions of network streams,
which it opens. So only an MP4 (ISO 14496-12) reaches it, and it is told to know no other format.
"""

import os
import weakref
from typing import Any, cast

import cv2

from r2c2r_core.arrays import Image
from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.images import MAX_PIXELS
from r2c2r_core.ingest.readers.protocol import UnreadableFrame

_FORMATS = "mov,mp4,m4a,3gp,3g2,mj2"  # one demuxer of FFmpeg, under all its names
_FIRST_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")  # QuickTime files may begin with any
# Read by OpenCV each time it opens a video, and only from here. Its tracks may not lie in other files either
os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = f"format_whitelist;{_FORMATS}|protocol_whitelist;none|enable_drefs;0"


class Video:
    """A video among a recording's files, in the order of its frames; going back starts it anew."""

    def __init__(self, files: Files, name: str) -> None:
        """Raises CaptureError when its first frame cannot be decoded."""
        self.name = name
        self._files = files
        self._release: weakref.finalize | None = None
        self._require_mp4()
        self._restart()
        self.size = (int(self._capture.get(cv2.CAP_PROP_FRAME_WIDTH)), int(self._capture.get(cv2.CAP_PROP_FRAME_HEIGHT)))
        if not self._capture.isOpened() or self.size[0] * self.size[1] > MAX_PIXELS:
            raise CaptureError(
                f"{files.source}/{name}: not a readable video", hint="export the recording again, or copy it again"
            )
        try:
            self.frame(0)
        except UnreadableFrame as problem:
            raise CaptureError(
                f"{files.source}/{name}: OpenCV's FFmpeg cannot decode the codec '{self._codec()}'",
                hint="install opencv-python-headless from PyPI, or convert the video: ffmpeg -i rgb.mp4 -c:v libx264 -crf 14",
            ) from problem

    def frame(self, number: int) -> Image:
        """The frame of that number, RGB, as the sensor saw it (a rotation mark is not obeyed); raises UnreadableFrame."""
        if number < self._next - 1:
            self._restart()
        while self._next <= number:
            if not self._capture.grab():
                raise UnreadableFrame(f"{self.name}: ends or is damaged after {self._next} frames, frame {number} was wanted")
            self._next += 1
        decoded, bgr = self._capture.retrieve()
        if not decoded:
            raise UnreadableFrame(f"{self.name}: frame {number} cannot be decoded")
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)

    def _require_mp4(self) -> None:
        with self._files.open(self.name) as stream:
            head = stream.read(8)
        if head[4:] not in _FIRST_BOXES:
            raise CaptureError(
                f"{self._files.source}/{self.name}: begins with {head!r}, an MP4 was expected",
                hint="export the recording again, or copy it again",
            )

    def _restart(self) -> None:
        stream = self._files.open(self.name)
        # Never by path: a file in a zip has none. Any io.BufferedIOBase serves, which OpenCV's stubs do not say
        self._capture = cv2.VideoCapture(cast(Any, stream), cv2.CAP_FFMPEG, [])
        if self._release is not None:
            self._release()
        self._release = weakref.finalize(self, stream.close)
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        self._next = 0

    def _codec(self) -> str:
        code = int(self._capture.get(cv2.CAP_PROP_FOURCC))
        return "".join(chr(code >> shift & 0xFF) for shift in (0, 8, 16, 24)).strip("\0 ") or "unknown"
