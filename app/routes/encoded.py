"""Answers that are what is stored: encoded as they are. The route's response_model says their schema, and a test compares."""

import json
from typing import Any

from fastapi.responses import Response


def as_json(content: Any) -> Response:
    """The content as JSON, not built as a model first."""
    return Response(json.dumps(content, separators=(",", ":")), media_type="application/json")
