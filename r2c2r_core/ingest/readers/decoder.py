"""FFmpeg in a process of its own: `python -m r2c2r_core.alone r2c2r_core.ingest.readers.decoder FD FILE [MEMBER]`.

A damaged video can end the process that decodes it; here no other dies with it. The video is FILE, or member MEMBER of the zip
FILE. What is asked and answered goes through the socket FD: once OPENED, then for each number of a frame (NUMBER) DECODED and,
where there is one, the frame's pixels, RGB. Who asks need not trust what is answered: it is numbers only.

FFmpeg guesses a format from the content, and among its formats are lists of other files and descriptions of network streams,
which it opens. So it is told to know no other format than MP4 (ISO 14496-12).
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

OPENED = struct.Struct("<?4sii")  # whether it is a video; its codec, width and height, of which 0 and below are unknown
NUMBER = struct.Struct("<q")
DECODED = struct.Struct("<qII")  # frames that could be counted so far, width and height of the one asked for: 0 without it

_FORMATS = "mov,mp4,m4a,3gp,3g2,mj2"  # one demuxer of FFmpeg, under all its names
# Read by OpenCV each time it opens a video, and only from here. Its tracks may not lie in other files either
os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = f"format_whitelist;{_FORMATS}|protocol_whitelist;none|enable_drefs;0"


def main(arguments: list[str]) -> int:
    """Answer until the socket is closed."""
    for number in (signal.SIGINT, signal.SIGTERM):  # they reach the whole process group: who asks decides
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
    """The numbers asked for. When nobody can ask any more this process ends, even in the middle of a frame."""
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
    """A video, decoded from front to back; going back starts it anew."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._restart()

    def opened(self) -> bytes:
        """OPENED."""
        codec, width, height = (int(self._capture.get(p)) for p in _ABOUT)
        return OPENED.pack(self._capture.isOpened(), (codec & 0xFFFFFFFF).to_bytes(4, "little"), width, height)

    def frame(self, number: int) -> tuple[bytes, np.ndarray | None]:
        """DECODED and the frame of that number, as the sensor saw it (a rotation mark is not obeyed)."""
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
        # Never by path: a file in a zip has none. Any io.BufferedIOBase serves, which OpenCV's stubs do not say
        self._capture = cv2.VideoCapture(cast(Any, self._stream), cv2.CAP_FFMPEG, [])
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        self._next = 0


_ABOUT = (cv2.CAP_PROP_FOURCC, cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
