"""Model of prompts.json: the objects, with their clicks, fronts, masks and crop boxes."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from r2c2r_core.geometry.masks import PackedMask, pack_mask
from r2c2r_core.model.inputs import CropBox, DrawnFront, DrawnHandle, FrameSaid, HingeSide, ObjectPrompt, PromptPoint, Prompts
from r2c2r_core.schema.document import Document
from r2c2r_core.texts import OBEYED

MOST_OBJECTS, MOST_POINTS = 10_000, 1000
MOST_FRAMES = 2**31  # as they are stored
FARTHEST_PX = 100_000  # no image is wider
LONGEST_SIDE_PX, MOST_RUNS = 20_000, 500_000  # of a mask
MOST_MASK_PX = 64_000_000  # no camera of a phone has more
MOST_PAINTED_PX = 4_000_000_000  # of all masks of a file: some 6000 at the size the app paints them
FARTHEST_M = 1000  # no scan reaches farther
SMALLEST_FRONT_M, LARGEST_FRONT_M = 0.02, 10.0
SMALLEST_CROP_M = 0.01
_SQUARE_COS = 0.001  # maximum cosine between a crop box's edges
_SQUARE_M = 0.002  # tolerance of a drawn rectangle's corners
_OVER_M = 0.002  # maximum overhang of a handle over its front
LONGEST = 60  # characters of a name: a mesh's file name holds it twice, and file systems end at 255 bytes


def _shows(text: str) -> str:
    if OBEYED.search(text):
        raise ValueError("a control character")
    return text


def _whole(value: Any) -> Any:
    if type(value) is not int:  # True and 1.0 equal 1, and would be accepted
        raise ValueError(f"found {value!r}"[:60])
    return value


Version = Annotated[Literal[1], BeforeValidator(_whole)]
PromptsVersion = Annotated[Literal[1, 2, 3], BeforeValidator(_whole)]
Label = Annotated[Literal[0, 1], BeforeValidator(_whole)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_]+$", max_length=LONGEST)]
Category = Annotated[str, Field(max_length=LONGEST), AfterValidator(_shows)]
Metres = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)]
Pixel = Annotated[float, Field(ge=-FARTHEST_PX, le=FARTHEST_PX, allow_inf_nan=False)]


class PromptsFilePoint(Document):
    """One click of prompts.json."""

    frame: int = Field(ge=0, lt=MOST_FRAMES, description="a whole number: the frame's number in the recording")
    x: Pixel = Field(description="a number of pixels of the stored RGB frame, from its left edge")
    y: Pixel = Field(description="a number of pixels of the stored RGB frame, from its top edge")
    label: Label = Field(description="0 or 1: 1 is on the object, 0 off it")


class PromptsFileHandle(Document):
    """Where a front's handle is: to the right and up from the front's centre."""

    left_m: Metres = Field(description="a number of metres")
    bottom_m: Metres = Field(description="a number of metres")
    right_m: Metres = Field(description="a number of metres, more than left_m")
    top_m: Metres = Field(description="a number of metres, more than bottom_m")

    @model_validator(mode="after")
    def _right_way_round(self) -> "PromptsFileHandle":
        if self.left_m >= self.right_m or self.bottom_m >= self.top_m:
            raise ValueError("a handle without width or height found, left_m < right_m and bottom_m < top_m expected")
        return self

    def within(self, width_m: float, height_m: float) -> bool:
        """Whether it lies on a front of that size."""
        across, up = width_m / 2 + _OVER_M, height_m / 2 + _OVER_M
        return -across <= self.left_m and self.right_m <= across and -up <= self.bottom_m and self.top_m <= up


class PromptsFileFront(Document):
    """A front's rectangle, drawn in the elevation of its run: used exactly as it is."""

    corners_m: list[Annotated[list[Metres], Field(min_length=3, max_length=3)]] = Field(
        min_length=4,
        max_length=4,
        description="four corners [x, y, z] in metres, in the recording's own world: top left, top right, bottom right, "
        "bottom left, as a person facing the front sees them",
    )
    handle: PromptsFileHandle | Literal["none"] | None = Field(
        default=None, description='a box, "none" for a front without a handle, or null: looked for in the picture'
    )
    hinge: HingeSide | None = Field(
        default=None, description="left, right, top or bottom, as a person facing the front sees it, or null: inferred"
    )

    @model_validator(mode="after")
    def _rectangle(self) -> "PromptsFileFront":
        corners = np.array(self.corners_m)
        across, down = corners[1] - corners[0], corners[3] - corners[0]
        sides = [float(np.linalg.norm(side)) for side in (across, down)]
        if not all(SMALLEST_FRONT_M <= side <= LARGEST_FRONT_M for side in sides):
            found = " by ".join(f"{side:.3f}" for side in sides)
            raise ValueError(f"a front of {found} m found, sides of {SMALLEST_FRONT_M} to {LARGEST_FRONT_M:g} m expected")
        slant_m = abs(across @ down) / max(sides)
        if np.abs(corners[0] + across + down - corners[2]).max() > _SQUARE_M or slant_m > _SQUARE_M:
            raise ValueError("corners of no rectangle found, top left, top right, bottom right, bottom left expected")
        if isinstance(self.handle, PromptsFileHandle) and not self.handle.within(*sides):
            found = " by ".join(f"{side:.3f}" for side in sides)
            raise ValueError(f"a handle outside its front of {found} m found, a box within it expected")
        return self

    def drawn(self) -> DrawnFront:
        """The pipeline's DrawnFront."""
        handle = DrawnHandle(**self.handle.model_dump()) if isinstance(self.handle, PromptsFileHandle) else self.handle
        corners = tuple((x, y, z) for x, y, z in self.corners_m)
        return DrawnFront(corners_capture=corners, handle=handle, hinge=self.hinge)


class PromptsFileMask(Document):
    """A mask of a whole frame by run lengths."""

    width: int = Field(ge=1, le=LONGEST_SIDE_PX, description="a whole number of pixels; the frame's own, or fewer")
    height: int = Field(ge=1, le=LONGEST_SIDE_PX, description="a whole number of pixels, in the frame's proportion")
    runs: list[Annotated[int, Field(ge=0)]] = Field(
        max_length=MOST_RUNS,
        description="a list of lengths, row by row from the top left: off it, on it, off it and so on",
    )

    @model_validator(mode="after")
    def _whole_frame(self) -> "PromptsFileMask":
        if self.width * self.height > MOST_MASK_PX:  # a few bytes of runs can encode any number of pixels
            raise ValueError(f"a mask of {self.width} x {self.height} found, at most {MOST_MASK_PX} pixels expected")
        if sum(self.runs) != self.width * self.height:
            raise ValueError(f"runs of {sum(self.runs)} pixels found, {self.width} x {self.height} expected")
        return self

    def packed(self) -> PackedMask:
        """The mask."""
        on = np.arange(len(self.runs)) % 2 == 1
        return pack_mask(np.repeat(on, self.runs).reshape(self.height, self.width))


class PromptsFileFrame(Document):
    """The corrected state of an object in one frame."""

    frame: int = Field(ge=0, lt=MOST_FRAMES, description="a whole number: the frame's number in the recording")
    mask: PromptsFileMask | None = Field(description="its mask there, which stands; null: it is not visible there")


class PromptsFileCrop(Document):
    """A box around a thing: what is found outside is none of it."""

    corner_m: list[Metres] = Field(
        min_length=3, max_length=3, description="one corner [x, y, z] in metres, in the recording's own world"
    )
    edges_m: list[Annotated[list[Metres], Field(min_length=3, max_length=3)]] = Field(
        min_length=3,
        max_length=3,
        description="three edges [x, y, z] in metres from that corner, at right angles to each other",
    )

    @model_validator(mode="after")
    def _box(self) -> "PromptsFileCrop":
        edges = np.array(self.edges_m)
        lengths = np.linalg.norm(edges, axis=1)
        if lengths.min() < SMALLEST_CROP_M:
            raise ValueError(f"a crop box's edge of {lengths.min():.3f} m found, at least {SMALLEST_CROP_M} m expected")
        units = edges / lengths[:, None]
        if np.abs(units @ units.T - np.eye(3)).max() > _SQUARE_COS:
            raise ValueError("edges of no box found, three at right angles to each other expected")
        return self

    def drawn(self) -> CropBox:
        """The pipeline's CropBox."""
        x, y, z = self.corner_m
        return CropBox(corner_capture=(x, y, z), edges_capture=tuple((x, y, z) for x, y, z in self.edges_m))


class PromptsFileObject(Document):
    """One object of prompts.json."""

    name: Name = Field(description=f"1 to {LONGEST} letters, digits and underscores, no digit first: simulators accept no more")
    category: Category = Field(description=f"a word such as drawer, of at most {LONGEST} characters")
    points: list[PromptsFilePoint] = Field(max_length=MOST_POINTS, description=f"a list of at most {MOST_POINTS} clicks")
    front: PromptsFileFront | None = Field(default=None, description="from version 2 on: drawn, whatever is clicked")
    frames: list[PromptsFileFrame] = Field(
        default_factory=list, max_length=MOST_POINTS, description="from version 2 on: a list of frames, each at most once"
    )
    crop: PromptsFileCrop | None = Field(default=None, description="from version 3 on: of a thing, a box that it lies in")


class PromptsFile(Document):
    """prompts.json."""

    version: PromptsVersion = Field(
        description="1, 2 where a front is drawn or a frame is set right, 3 where a thing has a crop box"
    )
    objects: list[PromptsFileObject] = Field(
        max_length=MOST_OBJECTS, description="a list of objects, each with a name of its own"
    )

    @model_validator(mode="after")
    def _distinct(self) -> "PromptsFile":
        seen: set[str] = set()
        for item in self.objects:
            if item.name in seen:
                raise ValueError(f"two objects named '{item.name}' found, unique names expected")
            seen.add(item.name)
            if item.front is not None and self.version == 1:
                raise ValueError(f"a drawn front of '{item.name}' found in version 1, version 2 expected")
            if item.frames and self.version == 1:
                raise ValueError(f"frames of '{item.name}' found in version 1, version 2 expected")
            if item.crop is not None and self.version < 3:
                raise ValueError(f"a crop box of '{item.name}' found in version {self.version}, version 3 expected")
            if len({said.frame for said in item.frames}) < len(item.frames):
                raise ValueError(f"two of the frames of '{item.name}' have one number, each at most once expected")
        masks = [said.mask for item in self.objects for said in item.frames if said.mask is not None]
        painted_px = sum(mask.width * mask.height for mask in masks)
        if painted_px > MOST_PAINTED_PX:
            raise ValueError(f"masks of {painted_px} pixels in all found, at most {MOST_PAINTED_PX} expected")
        return self

    def prompts(self) -> Prompts:
        """The pipeline's Prompts."""
        return Prompts(
            objects=tuple(
                ObjectPrompt(
                    name=item.name,
                    category=item.category,
                    points=tuple(PromptPoint(frame=p.frame, x=p.x, y=p.y, label=p.label) for p in item.points),
                    front=item.front.drawn() if item.front is not None else None,
                    frames=tuple(
                        FrameSaid(frame=said.frame, mask=said.mask.packed() if said.mask is not None else None)
                        for said in item.frames
                    ),
                    crop=item.crop.drawn() if item.crop is not None else None,
                )
                for item in self.objects
            )
        )
