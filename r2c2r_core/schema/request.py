"""Model of request.json, a worker's input. The app writes it beside a project's work folder."""

from typing import Any

from pydantic import Field

from r2c2r_core.schema.document import Document

_LONGEST_PATH, _LONGEST_NAME = 4096, 60


class RequestTools(Document):
    """Backends by seam; absent ones are the defaults."""

    segmenter: str | None = Field(default=None, max_length=_LONGEST_NAME, description="the name of a segmenter")
    generator: str | None = Field(default=None, max_length=_LONGEST_NAME, description="the name of a generator")
    matcher: str | None = Field(default=None, max_length=_LONGEST_NAME, description="the name of a matcher")


class RequestFile(Document):
    """request.json; paths may be relative to its folder."""

    source: str = Field(min_length=1, max_length=_LONGEST_PATH, description="the path of the recording")
    prompts: str = Field(default="prompts.json", max_length=_LONGEST_PATH, description="the path of the prompts")
    overrides: str = Field(default="overrides.json", max_length=_LONGEST_PATH, description="the path of the corrections")
    config: dict[str, Any] = Field(default_factory=dict, description="an object of settings; see `r2c2r schema config`")
    tools: RequestTools = Field(default_factory=RequestTools, description="an object of backends by seam")
    seed: int = Field(default=0, ge=0, lt=2**31, description="a whole number from 0")
    inputs: str = Field(default="", max_length=200, description="whoever asks: the key of what was said; nothing depends on it")
