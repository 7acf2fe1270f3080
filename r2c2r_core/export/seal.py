"""Checksums of a bundle's files in its manifest, to detect damaged or changed bundles.

They are not a signature: anyone who changes a file on purpose can recompute its checksum.
"""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

from r2c2r_core.export.rules.table import finding
from r2c2r_core.model.report import Finding

MANIFEST = "manifest.json"


def checksums(folder: Path) -> dict[str, str]:
    """SHA-256 of every file of a bundle's folder except the manifest, by relative path, sorted."""
    paths = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    return {name: _sha256(folder / name) for name in paths if name != MANIFEST}


def check_seal(folder: Path) -> tuple[Finding, ...]:
    """Findings on files that differ from the manifest's checksums; an unreadable manifest is reported by the linter."""
    try:
        manifest = json.loads((folder / MANIFEST).read_bytes())
        listed = manifest.get("files")
    except (OSError, ValueError, RecursionError, AttributeError):
        return ()
    if listed is None:
        return (finding("file-unsealed", MANIFEST, "it lists no checksums, so changed files cannot be detected"),)
    if not isinstance(listed, dict):
        return (finding("file-unsealed", MANIFEST, f"files is {type(listed).__name__}, expected a table of SHA-256 by path"),)
    return tuple(_differences(listed, checksums(folder)))


def _differences(listed: dict[str, object], there: dict[str, str]) -> Iterator[Finding]:
    for name in sorted(listed.keys() & there.keys()):
        if listed[name] != there[name]:
            what = f"its SHA-256 is {there[name][:12]}…, the manifest says {str(listed[name])[:12]}…: download the bundle again"
            yield finding("file-changed", name, what)
    for name in sorted(listed.keys() - there.keys()):
        yield finding("file-lost", name, "it is in the manifest, but not in the bundle")
    for name in sorted(there.keys() - listed.keys()):
        yield finding("file-unlisted", name, "it is in the bundle, but not in its manifest")


def _sha256(path: Path) -> str:
    with path.open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()
