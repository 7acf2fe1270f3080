"""Validation of uploaded archives before they are read. Nothing is unpacked to disk."""

import stat
import zipfile
from pathlib import Path, PurePath, PurePosixPath

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.foreign import refuse_foreign

MAX_DIRECTORY_BYTES = 64 * 1024 * 1024  # of the archive's own table of contents
MAX_RATIO = 200.0  # unpacked to packed, over the whole archive; images and depth compress far less
LONGEST_NAME = 1000  # characters, folders included
DEEPEST = 32  # folders in folders
READ_BYTES = 1 << 20  # of the table of contents at once
MIN_SUSPICIOUS = 64 * 1024 * 1024  # bytes unpacked below which no ratio is suspicious


def check_archive(path: Path, name: str, *, max_bytes: int, max_files: int) -> None:
    """Raise CaptureError, in one line, unless the file is a complete zip that is safe to read; it is called `name`."""
    refuse_foreign(PurePath(name))
    with path.open("rb") as handle:
        if handle.read(4) != b"PK\x03\x04":
            raise CaptureError(
                f"{name} is not a zip or an .r3d", hint="send an .r3d from Record3D, or a zip of a recording's folder"
            )
    _refuse_large_directory(path, max_files)
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, NotImplementedError, ValueError, OSError, OverflowError) as error:
        raise CaptureError(f"{name} is damaged or cut short ({error})", hint="copy it from the phone again") from error
    if members and min(member.header_offset for member in members) > 0:  # the end record belongs to a zip inside it
        raise CaptureError(f"{name} is cut short: its table of contents is missing", hint="copy it again")
    _refuse_unsafe(members, path.stat().st_size, max_bytes, max_files)


def _refuse_unsafe(members: list[zipfile.ZipInfo], packed: int, max_bytes: int, max_files: int) -> None:
    if not members:
        raise CaptureError("the archive is empty", hint="pack the recording's folder")
    total = sum(member.file_size for member in members)
    if total > max_bytes:
        raise CaptureError(
            f"the archive unpacks to {total / 1e9:.1f} GB, at most {max_bytes / 1e9:.1f} GB allowed", hint="cut the recording"
        )
    if total > MIN_SUSPICIOUS and total > MAX_RATIO * packed:
        raise CaptureError(
            f"the archive unpacks to {total / max(packed, 1):.0f} times its size", hint="this is not a recording"
        )
    _refuse_two_of_a_name(members)
    for member in members:
        inner = member.filename
        parts = PurePosixPath(inner.replace("\\", "/")).parts
        if inner.startswith(("/", "\\")) or ".." in parts or (parts and ":" in parts[0]) or "\x00" in inner:
            raise CaptureError(f"the archive holds the path {inner[:80]!r}", hint="pack the folder with relative paths")
        if len(inner) > LONGEST_NAME or len(parts) > DEEPEST:
            raise CaptureError(
                f"the archive holds a path of {len(inner)} characters and {len(parts)} folders ({inner[:40]!r}…)",
                hint="pack the recording's folder only",
            )
        kind = stat.S_IFMT(member.external_attr >> 16)
        if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
            raise CaptureError(f"the archive holds a link or a device ({inner[:80]!r})", hint="pack plain files only")
        if member.flag_bits & 0x1:
            raise CaptureError("the archive is encrypted", hint="pack it without a password")


def _refuse_two_of_a_name(members: list[zipfile.ZipInfo]) -> None:
    """Refuse two files with the same name, as readers differ in which one they use."""
    seen: set[str] = set()
    for member in members:
        if member.filename in seen:
            raise CaptureError(f"the archive holds two files named {member.filename[:80]!r}", hint="pack the folder again")
        seen.add(member.filename)


def _refuse_large_directory(path: Path, max_files: int) -> None:
    """Check the end record by hand, as parsing a hostile table of contents costs memory before it can be refused."""
    size = path.stat().st_size
    with path.open("rb") as handle:
        handle.seek(max(size - 66_000, 0))
        tail = handle.read()
    at = tail.rfind(b"PK\x05\x06")
    if at < 0 or len(tail) - at < 22:
        raise CaptureError("the archive is cut short: its table of contents is missing", hint="copy it from the phone again")
    directory_bytes = int.from_bytes(tail[at + 12 : at + 16], "little")
    if directory_bytes == 0xFFFFFFFF:  # zip64: the true size is in the record before
        record = tail.rfind(b"PK\x06\x06", 0, at)
        directory_bytes = int.from_bytes(tail[record + 40 : record + 48], "little") if record >= 0 else 0
    if directory_bytes > min(MAX_DIRECTORY_BYTES, max_files * 400):
        raise CaptureError("the archive's table of contents is implausibly large", hint="pack one recording only")
    entries = entries_at_most(path, max(size - directory_bytes - len(tail), 0))
    if entries > max_files:
        raise CaptureError(f"the archive holds {entries} files, at most {max_files} expected", hint="pack one recording only")


def entries_at_most(path: Path, start: int) -> int:
    """Upper bound on the entries of a table of contents in the file from byte `start`, by counting entry signatures."""
    mark, found, kept = b"PK\x01\x02", 0, b""
    with path.open("rb") as handle:
        handle.seek(start)
        while piece := handle.read(READ_BYTES):
            found += (kept + piece).count(mark)
            kept = (kept + piece)[-3:]  # a signature split between pieces; too short to contain a counted one
    return found
