"""Our own files, from memory: a page asks for fifty modules at once, and a thread for each is what it would wait for."""

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

SERVED = ("index.html", "login.html", "css", "js", "icons", "favicon.svg")  # not the development files beside them
LEAST_BYTES = 500  # less is not worth compressing


class PageFiles(StaticFiles):
    """Static files that a browser asks about each time, so that an update is seen at once."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """The file, 304 when the browser has it; HTTPException 404 for what is not a page's, 405 for what is no question."""
        if scope["method"] not in ("GET", "HEAD"):
            raise HTTPException(405)
        file, found = self.lookup_path(path)
        if path.split("/", 1)[0] not in SERVED or found is None or not S_ISREG(found.st_mode):
            raise HTTPException(404)
        asked = Headers(scope=scope)
        headers = {
            "etag": f'"{found.st_mtime_ns:x}-{found.st_size:x}"',
            "cache-control": "no-cache",
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
    """The bytes, and the same compressed (none when that is not worth it)."""
    plain = file.read_bytes()
    return plain, gzip.compress(plain, mtime=0) if len(plain) >= LEAST_BYTES else b""


def _media_type(file: str) -> str:
    return mimetypes.guess_type(file)[0] or "application/octet-stream"
