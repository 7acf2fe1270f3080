"""Validation of frame references against the recording's frame table."""

from typing import Any

from app.db.tables import Project
from app.services.context import Context
from app.services.projects import frame_table
from r2c2r_core.errors import PromptError
from r2c2r_core.schema.prompts import PromptsFile, PromptsFileMask
from r2c2r_core.segment.prompts import check_mask_size

Table = dict[int, dict[str, Any]]
"""Frames by their numbers, each with its `width` and `height`."""


def table_of(context: Context, project: Project) -> Table:
    """The project's frame table; NotReady until the recording was read."""
    return {entry["index"]: entry for entry in frame_table(context.files(project))}


def check_frame(table: Table, frame: int) -> tuple[int, int]:
    """The frame's width and height; raises PromptError for an unknown frame."""
    if frame not in table:
        raise PromptError(f"the recording has no frame {frame}", hint=f"its {len(table)} frames are listed under /frames")
    return table[frame]["width"], table[frame]["height"]


def check_said(table: Table, name: str, frame: int, mask: PromptsFileMask | None) -> None:
    """Raise PromptError for an unknown frame, and for a mask that does not fit it."""
    size = check_frame(table, frame)
    if mask is not None:
        check_mask_size(f"{name}: frame {frame}", mask, size)


def check_point(table: Table, frame: int, x: float, y: float) -> None:
    """Raise PromptError for a click in an unknown frame or outside its image."""
    width, height = check_frame(table, frame)
    if not (0 <= x < width and 0 <= y < height):
        raise PromptError(
            f"the click at ({x:g}, {y:g}) is outside the image of {width}x{height}", hint="click inside the image"
        )


def check_file(table: Table, file: PromptsFile) -> None:
    """Raise PromptError for the first invalid click or painted mask of a prompts.json."""
    for entry in file.objects:
        for point in entry.points:
            check_point(table, point.frame, point.x, point.y)
        for said in entry.frames:
            check_said(table, entry.name, said.frame, said.mask)
