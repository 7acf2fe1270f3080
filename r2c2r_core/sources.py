"""Source digests as code versions, so that results of other code versions are not reused."""

import hashlib
from functools import cache
from pathlib import Path

from r2c2r_core.plugins import Group, plugin_key

_ADDED_TO: dict[str, Group] = {
    "ingest": "r2c2r.readers",
    "segment": "r2c2r.segmenters",
    "generate": "r2c2r.generators",
    "align": "r2c2r.matchers",
    "kitchen": "r2c2r.fixtures",
    "synthesize": "r2c2r.fixtures",
    "export": "r2c2r.formats",
}
"""By package of the core: what other packages may add to it."""


def source_key(*rooms: str) -> str:
    """Digest of all files of these core packages, and of the plug-ins that add to them."""
    further = [key for room in rooms if (key := plugin_key(_ADDED_TO[room]) if room in _ADDED_TO else "")]
    return hashlib.sha256("".join((_own_key(rooms), *further)).encode()).hexdigest()[:16] if further else _own_key(rooms)


@cache
def _own_key(rooms: tuple[str, ...]) -> str:
    """Digest of all files of these packages: code, and files copied into a bundle."""
    package = Path(__file__).parent
    digest = hashlib.sha256()
    for folder in rooms:
        for path in source_files(package / folder):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def source_files(package: Path) -> list[Path]:
    """The files of a package, except compiled and hidden ones."""
    files = (path for path in package.rglob("*") if path.is_file())
    return sorted(p for p in files if not any(part[0] == "." or part == "__pycache__" for part in p.relative_to(package).parts))
