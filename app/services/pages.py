"""The single HTML page with preload hints for the resources that its address needs first.

Otherwise the browser discovers modules level by level, the frames from a module, and the first picture from the frames:
a round trip each, which take seconds on a busy machine.
"""

import os
import re
from functools import lru_cache
from hashlib import sha256
from html import escape
from pathlib import Path
from posixpath import join, normpath
from time import monotonic
from urllib.parse import urlsplit

from app.db import queries
from app.db.engine import reading
from app.errors import NotFound, NotReady
from app.security import Person
from app.services import projects
from app.services.context import Context

OF_A_PROJECT = ("annotate", "elevation", "run", "review", "download", "agreement")
FOLDERS = ("css", "js", "icons")  # of static files
SHOWN_WIDTH = 960  # of a frame, as requested by static/js/annotate/frames.js
_IMPORTED = re.compile(r'^(?:import|export)\b[^;]*?from "(\.[^"]+)";', re.MULTILINE)


def html(context: Context, path: str, frame: str = "", person: Person | None = None) -> str:
    """The page at a path, preloading its modules and, on annotation pages, the first frame."""
    page, project = shown_at(path)
    shown = page == "annotate" and context.access.sees(person or context.person, project)
    head = _first_frame(context, project, frame) if shown else []
    head += [f'<link rel="modulepreload" href="/static/{module}" />' for module in modules(context.static, page)]
    text = _read(context.static, "index.html")
    return text.replace("</head>", _versioned(context.static, "".join(f"  {line}\n  " for line in head)) + "</head>", 1)


def sign_in(context: Context, refused: str = "") -> str:
    """The sign-in page, with the identity provider if there is one, and the reason of a refusal."""
    text = _read(context.static, "login.html")
    if context.provider is not None:
        host = escape(urlsplit(context.provider.issuer).netloc)
        text = text.replace('href="/login/provider" hidden', 'href="/login/provider"').replace("PROVIDER", host)
    return text.replace('id="refused">', f'id="refused">{escape(refused)}')


def _read(static: Path, name: str) -> str:
    """A page whose static files have the current version."""
    return _versioned(static, (static / name).read_text(encoding="utf-8"))


def _versioned(static: Path, text: str) -> str:
    return text.replace('"/static/', f'"/static/@{version_of(static)}/')


def version_of(static: Path) -> str:
    """Version of all static files together, at most a second old, so that updates take effect at once."""
    return _version_at(static, int(monotonic()))


@lru_cache(maxsize=1)
def _version_at(static: Path, _second: int) -> str:
    folders = (walked for folder in FOLDERS for walked in os.walk(static / folder))
    files = sorted(os.path.join(parent, name) for parent, _, names in folders for name in names)
    states = [(file, found.st_mtime_ns, found.st_size) for file in files for found in (os.stat(file),)]
    return sha256(repr(states).encode()).hexdigest()[:12]


def shown_at(path: str) -> tuple[str, str]:
    """Page and project of a path ("" for none), as in static/js/router.js."""
    first, project, page = [*(part for part in path.split("/") if part), "", "", ""][:3]
    if first in ("inbox", "people", "templates", "webhooks"):
        return first, ""
    if first != "p" or not project:
        return "projects", ""
    return page if page in OF_A_PROJECT else "overview", project


@lru_cache(maxsize=16)
def modules(static: Path, page: str) -> list[str]:
    """The modules needed by the page, relative to the static folder: the shell's and its own."""
    waiting, found = ["js/main.js", f"js/pages/{page}.js"], dict[str, None]()
    while waiting:
        module = waiting.pop(0)
        if module in found or not (static / module).is_file():
            continue
        found[module] = None
        text = (static / module).read_text(encoding="utf-8")
        waiting += [normpath(join(module, "..", name)) for name in _IMPORTED.findall(text)]
    return list(found)


def _first_frame(context: Context, project_id: str, frame: str) -> list[str]:
    """The first picture and the frame table; empty for an unknown or unread project."""
    try:
        with reading(context.engine) as session:
            project = queries.project_row(session, project_id)
        indices = [entry["index"] for entry in projects.frame_table(context.files(project))]
    except (NotFound, NotReady):
        return []
    if not indices:
        return []
    first = int(frame) if frame in map(str, indices) else indices[0]
    picture = escape(f"/media/{project.id}/frames/{first}.jpg?w={SHOWN_WIDTH}&v={project.media_version}")
    return [
        f'<link rel="preload" as="image" fetchpriority="high" href="{picture}" />',
        f'<link rel="preload" as="fetch" crossorigin href="/api/projects/{project.id}/frames" />',
    ]
