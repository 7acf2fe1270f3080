"""The interface of all readers: an opened recording in our conventions, with its pixels still in its own files."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from r2c2r_core.arrays import DepthMetres, Image, Vector3
from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.files import Files

Colour = bytes | Image
"""A colour image: the recording's own image file where it has one, else RGB pixels."""


class RawDepth(NamedTuple):
    """Depth as recorded: metres, 0, NaN or inf where unknown; confidence 0..2 (2 = high) where the format has one."""

    metres: DepthMetres
    confidence: np.ndarray | None
    damage: str | None = None  # why the confidence of the frame's own file could not be read


def with_confidence(metres: DepthMetres, read: Callable[[], np.ndarray | None]) -> RawDepth:
    """Depth with the confidence that `read` returns; a damaged confidence file costs the confidence only, not the frame."""
    try:
        return RawDepth(metres, read())
    except (UnreadableFrame, CaptureError) as problem:
        return RawDepth(metres, None, str(problem))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RawFrame:
    """One frame of a recording, converted to OpenCV camera axes and pixel centres at i + 0.5."""

    index: int  # the frame's number in the recording
    timestamp_s: float | None
    rgb_camera: Intrinsics
    depth_camera: Intrinsics
    capture_from_camera: Rigid3 | None  # None: the recording has no pose for it; ingest estimates those of a whole recording
    rgb_name: str  # the file the colour is in: its own, or a video that all frames share
    depth_name: str
    confidence_name: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """An opened recording."""

    format: str
    files: Files
    frames: tuple[RawFrame, ...]  # sorted by index
    colour_of: Callable[[RawFrame], Colour]  # cheapest in the order of the frames; raises UnreadableFrame
    depth_of: Callable[[RawFrame], RawDepth]  # raises UnreadableFrame
    up_capture: Vector3 | None  # unit, in the recording's own world, when the file knows gravity
    other_ups: tuple[Vector3, ...] = ()  # alternative interpretations of the file's gravity
    notices: tuple[str, ...] = ()
    other_names: tuple[str, ...] = ()  # metadata files that are part of the recording's identity

    @property
    def names(self) -> tuple[str, ...]:
        """All files the recording is made of."""
        of_frames = (n for f in self.frames for n in (f.rgb_name, f.depth_name, f.confidence_name) if n)
        return tuple(sorted({*of_frames, *self.other_names}))


class UnreadableFrame(Exception):
    """One frame cannot be used; the others may. Handled inside ingest: callers see CaptureError."""


class Part(NamedTuple):
    """A file, or a kind of file, that identifies a format."""

    what: str  # as a person would write it: "rgbd/N.jpg"
    pattern: str  # of the whole name

    def is_in(self, names: frozenset[str]) -> bool:
        """Whether a file of that name exists."""
        return any(re.fullmatch(self.pattern, name) for name in names)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reader:
    """One recording format."""

    name: str
    parts: tuple[Part, ...]  # a folder that holds all of them is of this format
    open: Callable[[Files], Recording]

    @property
    def expects(self) -> str:
        """Description of the files in a folder of this format."""
        return ", ".join(part.what for part in self.parts)

    def missing(self, names: frozenset[str]) -> tuple[str, ...]:
        """The parts without a matching file."""
        return tuple(part.what for part in self.parts if not part.is_in(names))
