"""Static files from memory, as a page requests fifty modules at once, which would wait for file-reading threads.

Pages name them below `/static/@VERSION/`: browsers keep those of the current version and revalidate all others.
"""

import gzip
import mimetypes
from functools import lru_cache
from pathlib import Path
from stat import S_ISREG

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from app.routes.files import IMMUTABLE
from app.services.pages import FOLDERS, version_of

SERVED = ("index.html", "login.html", *FOLDERS)  # without development files
LEAST_BYTES = 500  # smaller files are not compressed


class PageFiles(StaticFiles):
    """Static files by path, or by version and path."""

    def __init__(self, static: Path) -> None:
        super().__init__(directory=static)
        self._static = static

    async def get_response(self, path: str, scope: Scope) -> Response:
        """The file, or 304 if the browser has it; HTTPException 404 for files that are not served, 405 for other methods."""
        if scope["method"] not in ("GET", "HEAD"):
            raise HTTPException(405)
        version, path = path.partition("/")[::2] if path.startswith("@") else ("", path)
        file, found = self.lookup_path(path)
        if path.split("/", 1)[0] not in SERVED or found is None or not S_ISREG(found.st_mode):
            raise HTTPException(404)
        asked = Headers(scope=scope)
        headers = {
            "etag": f'"{found.st_mtime_ns:x}-{found.st_size:x}"',
            "cache-control": IMMUTABLE if version == f"@{version_of(self._static)}" else "no-cache",
            "vary": "Accept-Encoding",
        }
        if headers["etag"] in [given.strip().removeprefix("W/") for given in asked.get("if-none-match", "").split(",")]:
            return Response(status_code=304, headers=headers)
        plain, packed = _contents(Path(file), found.st_mtime_ns)
        if packed and "gzip" in asked.get("accept-encoding", ""):
            return Response(packed, headers={**headers, "content-encoding": "gzip"}, media_type=_media_type(file))
        return Response(plain, headers=headers, media_type=_media_type(file))


@lru_cache(maxsize=256)
def _contents(file: Path, _changed: int) -> tuple[bytes, bytes]:
    """The content, and its gzip (empty for small files)."""
    plain = file.read_bytes()
    return plain, gzip.compress(plain, mtime=0) if len(plain) >= LEAST_BYTES else b""


def _media_type(file: str) -> str:
    return mimetypes.guess_type(file)[0] or "application/octet-stream"
