"""The version of code: digests of its source, so that nothing computed by other code is used again."""

import hashlib
from functools import cache
from pathlib import Path


@cache
def source_key(*rooms: str) -> str:
    """A digest of the source of these packages of the core."""
    package = Path(__file__).parent
    digest = hashlib.sha256()
    for folder in rooms:
        for path in sorted((package / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
