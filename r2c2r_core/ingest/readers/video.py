"""Sequential decoding of video frames, since a frame cannot be decoded without those before it.

FFmpeg runs in a separate process, which a damaged video may crash (decoder.py); it is given MP4 only (ISO 14496-12).
"""

import signal
import socket
import struct
import subprocess
import sys
import weakref
from contextlib import suppress
from typing import Any

import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.errors import CaptureError, EnvironmentProblem
from r2c2r_core.ingest.files import Files
from r2c2r_core.ingest.readers.decoder import DECODED, NUMBER, OPENED
from r2c2r_core.ingest.readers.images import MAX_PIXELS
from r2c2r_core.ingest.readers.protocol import UnreadableFrame

_FIRST_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")  # QuickTime files may begin with any
_AGAIN = "export or copy the recording again"
_DECODER = (sys.executable, "-m", "r2c2r_core.alone", "r2c2r_core.ingest.readers.decoder")


class Video:
    """A video among a recording's files, read in frame order; seeking backwards restarts it."""

    def __init__(self, files: Files, name: str) -> None:
        """Raises CaptureError when its first frame cannot be decoded."""
        self.name = name
        self._path = f"{files.source}/{name}"
        self._require_mp4(files)
        self._process, self._channel = _started(files, name)
        self._answers = self._channel.makefile("rb")
        self._end = weakref.finalize(self, _end, self._process, self._channel)
        opened, codec, width, height = self._answer(OPENED)
        self.size = (width, height)
        if not opened or not 0 < width * height <= MAX_PIXELS:
            raise CaptureError(f"{self._path}: not a readable video", hint=_AGAIN)
        try:
            self.frame(0)
        except UnreadableFrame as problem:
            named = codec.decode("latin-1").strip("\0 ") or "unknown"
            raise CaptureError(
                f"{self._path}: OpenCV's FFmpeg cannot decode the codec '{named}'",
                hint="install opencv-python-headless from PyPI, or convert the video: "
                "ffmpeg -noautorotate -i rgb.mp4 -c:v libx264 -crf 14 new.mp4, then name new.mp4 rgb.mp4",
            ) from problem

    def frame(self, number: int) -> Image:
        """The frame of that number, RGB, in sensor orientation (a rotation tag is ignored).

        Raises UnreadableFrame, and CaptureError when the video crashed the decoder.
        """
        with suppress(OSError):  # a crashed decoder: reading the answer reports it
            self._channel.sendall(NUMBER.pack(number))
        known, width, height = self._answer(DECODED)
        if width * height > MAX_PIXELS:
            self._end()
            raise CaptureError(
                f"{self._path}: frame {number} has {width}x{height} pixels, {self.size} were expected", hint=_AGAIN
            )
        if not width * height and known <= number:
            raise UnreadableFrame(f"{self.name}: ends or is damaged after {known} frames, frame {number} was wanted")
        if not width * height:
            raise UnreadableFrame(f"{self.name}: frame {number} cannot be decoded")
        pixels = np.zeros((height, width, 3), np.uint8)
        self._receive(pixels.reshape(-1).data)
        return pixels

    def _answer(self, shape: struct.Struct) -> tuple[Any, ...]:
        said = bytearray(shape.size)
        self._receive(memoryview(said))
        return shape.unpack(said)

    def _receive(self, into: memoryview) -> None:
        """Fill the buffer with the decoder's next bytes; raises CaptureError when it has crashed."""
        try:
            if self._answers.readinto(into) == len(into):
                return
        except ConnectionError:
            pass
        raise self._died()

    def _died(self) -> CaptureError:
        self._channel.close()
        code = self._process.wait()
        how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return CaptureError(f"{self._path}: its decoder ended with {how}, the video is damaged", hint=_AGAIN)

    def _require_mp4(self, files: Files) -> None:
        with files.open(self.name) as stream:
            head = stream.read(8)
        if head[4:] not in _FIRST_BOXES:
            raise CaptureError(
                f"{self._path}: begins with {head!r}, an MP4 was expected",
                hint=_AGAIN,
            )


def _started(files: Files, name: str) -> tuple["subprocess.Popen[bytes]", socket.socket]:
    """A process that decodes the video, and the socket to it."""
    ours, theirs = socket.socketpair()
    with theirs:
        command = (*_DECODER, str(theirs.fileno()), *files.place(name))
        try:
            process = subprocess.Popen(
                command,
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        except OSError as error:
            ours.close()
            raise EnvironmentProblem(
                f"no process can be started to decode {name} ({error})",
                hint="end other programs, or raise the limit of processes",
            ) from error
    return process, ours


def _end(process: "subprocess.Popen[bytes]", channel: socket.socket) -> None:
    channel.close()
    process.kill()
    process.wait()
