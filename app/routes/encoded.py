"""Responses encoded directly from stored data. The route's response_model documents the schema, and a test compares."""

import json
from typing import Any

from fastapi.responses import Response


def as_json(content: Any) -> Response:
    """The content as JSON, without building a model first."""
    return Response(json.dumps(content, separators=(",", ":")), media_type="application/json")
