"""prompts.json: which objects there are, and where a person clicked them."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint, Prompts
from r2c2r_core.schema.document import Document
from r2c2r_core.texts import OBEYED

MOST_OBJECTS, MOST_POINTS = 10_000, 1000
MOST_FRAMES = 2**31  # as they are stored
FARTHEST_PX = 100_000  # no image is wider
LONGEST = 60  # characters of a name: a mesh's file name holds it twice, and file systems end at 255 bytes


def _shows(text: str) -> str:
    if OBEYED.search(text):
        raise ValueError("a control character")
    return text


def _whole(value: Any) -> Any:
    if type(value) is not int:  # True and 1.0 equal 1, and would pass for it
        raise ValueError(f"found {value!r}"[:60])
    return value


Version = Annotated[Literal[1], BeforeValidator(_whole)]
Label = Annotated[Literal[0, 1], BeforeValidator(_whole)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_]+$", max_length=LONGEST)]
Category = Annotated[str, Field(max_length=LONGEST), AfterValidator(_shows)]
Pixel = Annotated[float, Field(ge=-FARTHEST_PX, le=FARTHEST_PX, allow_inf_nan=False)]


class PromptsFilePoint(Document):
    """One click of prompts.json."""

    frame: int = Field(ge=0, lt=MOST_FRAMES, description="a whole number: the frame's number in the recording")
    x: Pixel = Field(description="a number of pixels of the stored RGB frame, from its left edge")
    y: Pixel = Field(description="a number of pixels of the stored RGB frame, from its top edge")
    label: Label = Field(description="0 or 1: 1 is on the object, 0 off it")


class PromptsFileObject(Document):
    """One object of prompts.json."""

    name: Name = Field(description=f"1 to {LONGEST} letters, digits and underscores: simulators accept no more")
    category: Category = Field(description=f"a word such as drawer, of at most {LONGEST} characters")
    points: list[PromptsFilePoint] = Field(max_length=MOST_POINTS, description=f"a list of at most {MOST_POINTS} clicks")


class PromptsFile(Document):
    """prompts.json."""

    version: Version = Field(description="1, the current format")
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
        return self

    def prompts(self) -> Prompts:
        """The noun of the pipeline."""
        return Prompts(
            objects=tuple(
                ObjectPrompt(
                    name=item.name,
                    category=item.category,
                    points=tuple(PromptPoint(frame=p.frame, x=p.x, y=p.y, label=p.label) for p in item.points),
                )
                for item in self.objects
            )
        )
