"""Common parts of the API schemas."""

from typing import Any

from pydantic import BaseModel, ConfigDict


class Shape(BaseModel):
    """Base class of the API schemas; unknown fields are rejected, as they are mistakes of the sender."""

    model_config = ConfigDict(extra="forbid", json_schema_serialization_defaults_required=True)


class ErrorBody(Shape):
    """Body of every error response; `current` is the stored state when the kind is `conflict`."""

    kind: str
    message: str
    hint: str = ""
    current: Any = None
