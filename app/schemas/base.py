"""Common parts of the API schemas."""

from typing import Any

from pydantic import BaseModel, ConfigDict


class Shape(BaseModel):
    """Unknown fields are a mistake of the sender, not a wish."""

    model_config = ConfigDict(extra="forbid", json_schema_serialization_defaults_required=True)


class ErrorBody(Shape):
    """The one shape of an error; `current` is what is stored now when the kind is `conflict`."""

    kind: str
    message: str
    hint: str = ""
    current: Any = None
