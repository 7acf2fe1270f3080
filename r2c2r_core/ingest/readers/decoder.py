"""FFmpeg in a process of its own: `python -m r2c2r_core.alone r2c2r_core.ingest.readers.decoder FD FILE [MEMBER]`.

A damaged video can crash the process that decodes it; the caller survives. The video is FILE, or member MEMBER of the zip
FILE. The protocol on the socket FD: OPENED once, then for each requested frame number (NUMBER) DECODED and, if the frame
exists, its RGB pixels. The caller need not trust the answers: they are numbers only.

FFmpeg guesses the format from the content, and some of its formats list other files or network streams, which it would open.
It is therefore restricted to MP4 (ISO 14496-12).
"""

import os
import signal
import socket
import struct
import sys
import threading
import zipfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from queue import SimpleQueue
from typing import IO, Any, cast

import cv2
import numpy as np

OPENED = struct.Struct("<?4sii")  # whether it is a video; its codec, width and height (0 and below: unknown)
NUMBER = struct.Struct("<q")
DECODED = struct.Struct("<qII")  # frames counted so far; width and height of the requested frame, 0 if there is none

_FORMATS = "mov,mp4,m4a,3gp,3g2,mj2"  # one demuxer of FFmpeg, under all its names
# Read by OpenCV each time it opens a video, and only from here. Tracks in other files are forbidden too
os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = f"format_whitelist;{_FORMATS}|protocol_whitelist;none|enable_drefs;0"


def main(arguments: list[str]) -> int:
    """Answer requests until the socket is closed."""
    for number in (signal.SIGINT, signal.SIGTERM):  # they reach the whole process group: the caller decides
        signal.signal(number, signal.SIG_IGN)
    os.rmdir(os.getcwd())  # the empty folder: nothing is left of it whatever ends this process
    descriptor, *place = arguments
    with socket.socket(fileno=int(descriptor)) as channel, _opened(*place) as stream:
        film = _Film(stream)
        channel.sendall(film.opened())
        asked = _asked(channel)
        while True:
            header, pixels = film.frame(asked.get())
            channel.sendall(header)
            if pixels is not None:
                channel.sendall(pixels.reshape(-1).data)


def _asked(channel: socket.socket) -> "SimpleQueue[int]":
    """Queue of requested frame numbers. The process exits when the socket closes, even in the middle of a frame."""
    numbers: SimpleQueue[int] = SimpleQueue()

    def listen() -> None:
        try:
            while request := channel.recv(NUMBER.size, socket.MSG_WAITALL):
                numbers.put(*NUMBER.unpack(request))
        finally:
            os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    return numbers


@contextmanager
def _opened(file: str, member: str | None = None) -> Iterator[IO[bytes]]:
    with ExitStack() as stack:
        stream = stack.enter_context(open(file, "rb"))
        yield stream if member is None else stack.enter_context(zipfile.ZipFile(stream).open(member))


class _Film:
    """A video decoded sequentially; seeking backwards restarts it."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._restart()

    def opened(self) -> bytes:
        """The packed OPENED message."""
        codec, width, height = (int(self._capture.get(p)) for p in _ABOUT)
        return OPENED.pack(self._capture.isOpened(), (codec & 0xFFFFFFFF).to_bytes(4, "little"), width, height)

    def frame(self, number: int) -> tuple[bytes, np.ndarray | None]:
        """The packed DECODED message and the frame of that number, in sensor orientation (a rotation tag is ignored)."""
        if number < self._next - 1:
            self._restart()
        while self._next <= number:
            if not self._capture.grab():
                return DECODED.pack(self._next, 0, 0), None
            self._next += 1
        decoded, bgr = self._capture.retrieve()
        if not decoded:
            return DECODED.pack(self._next, 0, 0), None
        height, width = bgr.shape[:2]
        return DECODED.pack(self._next, width, height), cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)

    def _restart(self) -> None:
        self._stream.seek(0)
        # Never by path: a file in a zip has none. Any io.BufferedIOBase works, which OpenCV's stubs do not declare
        self._capture = cv2.VideoCapture(cast(Any, self._stream), cv2.CAP_FFMPEG, [])
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        self._next = 0


_ABOUT = (cv2.CAP_PROP_FOURCC, cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
