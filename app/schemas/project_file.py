"""project.json of an exported project: user input that is not in prompts.json and overrides.json beside it."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from app.schemas.base import Shape
from app.schemas.lengths import TrueLengthIn
from app.schemas.projects import ProjectPatch, ReadingIn
from app.schemas.states import CommentIn
from app.schemas.templates import ListedObject
from app.schemas.text import FileName, Word
from r2c2r_core.schema.document import Document
from r2c2r_core.schema.prompts import LONGEST_SIDE_PX, MOST_FRAMES, MOST_OBJECTS

MOST_SAID = 10_000  # comments of a project, or lengths
_Side = Annotated[int, Field(ge=1, le=LONGEST_SIDE_PX)]
_At = Annotated[FiniteFloat, Field(ge=0, description="seconds since 1970")]


class ProjectFileFrame(Document):
    """A frame of the recording; the frames identify the recording."""

    index: int = Field(ge=0, lt=MOST_FRAMES, description="a whole number: the frame's number in the recording")
    width: _Side = Field(description="a whole number of pixels")
    height: _Side = Field(description="a whole number of pixels")
    camera: Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)] = Field(
        description="where the camera was: three numbers of metres, in the world"
    )


class ProjectFileRecording(Document):
    """The annotated recording."""

    file_name: FileName = Field(description="a file name")
    frames: list[ProjectFileFrame] = Field(min_length=1, max_length=100_000, description="a list of frames, in order")
    included: bool = Field(description="whether it is in the file, as recording/ and its name")


class ProjectFileComment(Document):
    """A comment of a user."""

    who: Word = Field(description="a name")
    at: _At
    resolved: bool
    said: CommentIn = Field(description="a comment; its object by the place in prompts.json, from 0")


class ProjectFileLength(Document):
    """A length measured by a user."""

    who: Word = Field(description="a name")
    at: _At
    said: TrueLengthIn = Field(description="a length; its object by the place in prompts.json, from 0")


class ProjectFile(Document):
    """The whole document."""

    kind: Literal["r2c2r project"] = Field(default="r2c2r project", description="'r2c2r project'")
    version: Literal[1] = Field(default=1, description="1, the current format")
    tool_version: str = Field(max_length=60, description="which r2c2r wrote it")
    project: ProjectPatch = Field(description="its name, tags and backends")
    reading: ReadingIn = Field(description="how the recording is read")
    recording: ProjectFileRecording
    colours: list[Annotated[int, Field(ge=0, lt=2**31)]] = Field(
        max_length=MOST_OBJECTS, description="a list of places in the palette, one for each object of prompts.json"
    )
    locks: list[Word | None] = Field(
        default_factory=list,
        max_length=MOST_OBJECTS,
        description="a list of who locked each object of prompts.json; null: nobody",
    )
    checklist: list[ListedObject] = Field(
        default_factory=list, max_length=MOST_OBJECTS, description="a list of objects that are to be clicked"
    )
    comments: list[ProjectFileComment] = Field(max_length=MOST_SAID, description="a list of comments, oldest first")
    true_lengths: list[ProjectFileLength] = Field(max_length=MOST_SAID, description="a list of lengths, oldest first")


class ProjectFileOffer(Shape):
    """Size of a project's export file."""

    size_bytes: int  # approximate, without the recording
    recording_bytes: int | None  # None: the recording is not stored here


class RecordingIn(Shape):
    """The recording for a project without one: a complete upload."""

    upload: Word
