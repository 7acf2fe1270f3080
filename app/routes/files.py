"""Sending a file with an ETag."""

from pathlib import Path

from fastapi import Request
from fastapi.responses import FileResponse, Response

IMMUTABLE = "private, max-age=31536000, immutable"


def send(request: Request, path: Path, media_type: str, *, immutable: bool) -> Response:
    """The file, or 304 when the browser has it."""
    found = path.stat()
    tag = f'"{found.st_mtime_ns:x}-{found.st_size:x}"'
    headers = {"etag": tag, "cache-control": IMMUTABLE if immutable else "private, no-cache"}
    if tag in [given.strip() for given in request.headers.get("if-none-match", "").split(",")]:
        return Response(status_code=304, headers=headers)
    return FileResponse(path, media_type=media_type, headers=headers, stat_result=found)
