"""The recording formats. To add one: a file with a READER, and a line here."""

import re
from dataclasses import replace
from pathlib import Path

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.above import WithAbove, borrowed_by, with_folder_above
from r2c2r_core.ingest.files import Files, SubFiles, open_files, top_folders
from r2c2r_core.ingest.foreign import foreign_among, refuse_foreign
from r2c2r_core.ingest.readers import (
    arkitscenes,
    arti4d,
    nerfstudio,
    polycam,
    record3d,
    redwood,
    rtabmap,
    scanner_app,
    scannet,
    scannetpp,
    seven_scenes,
    stray,
    threedmatch,
    tum,
)
from r2c2r_core.ingest.readers.plausible import plausible
from r2c2r_core.ingest.readers.protocol import Reader, Recording
from r2c2r_core.ingest.readers.stored_depth import ENDING, WRITE
from r2c2r_core.ingest.upright import upright
from r2c2r_core.plugins import added

READERS: tuple[Reader, ...] = (
    record3d.READER,
    record3d.EXR_READER,
    stray.READER,
    polycam.READER,
    scanner_app.READER,
    arkitscenes.READER,
    scannet.READER,
    scannetpp.READER,
    seven_scenes.READER,
    threedmatch.READER,
    tum.READER,
    rtabmap.READER,
    nerfstudio.READER,  # before Redwood, whose folders it may have beside its transforms.json
    redwood.READER,
    arti4d.READER,
)
"""The project's own; `readers()` also has those of other packages."""

_BRING = (
    "bring colour, depth and poses: an .r3d of Record3D, a Stray Scanner folder, Polycam's Raw data or 3D Scanner App's "
    "All data; docs/recordings.md names every format"
)
_DEPTH = r"(?i)(?:^|/)depth[^/]*(?:/[^/]+)?$"
_KNOWN = rf".*\.(?:{ENDING}|json|txt|csv)"
_DEEPEST, _WIDEST = 6, 50  # folders searched


def readers() -> tuple[Reader, ...]:
    """Every format that is recognised, the project's own first."""
    return (*READERS, *added("r2c2r.readers", Reader))


def open_recording(source: Path) -> Recording:
    """The recording at `source`, with its format recognised from its files; raises CaptureError."""
    if source.is_file():
        refuse_foreign(source)
    files = open_files(source)
    outer, inner = _roots(with_folder_above(files, source))
    for root in outer:
        if reader := _reader_of(root):
            return _opened(reader, root)
    if matches := {folder: reader for folder, root in inner.items() if (reader := _reader_of(root))}:
        folder = next(iter(matches))
        recording = _opened(matches[folder], inner[folder])
        choice = f"{len(matches)} recordings found, {folder} is read: {', '.join(list(matches)[:6])}"
        return replace(recording, notices=(choice, *recording.notices)) if len(matches) > 1 else recording
    raise _unknown(source, files, [*outer, *inner.values()])


def _opened(reader: Reader, root: Files) -> Recording:
    recording = upright(plausible(reader.open(root)))
    borrowed = borrowed_by(root, recording.names)
    told = (f"the calibration was read from {borrowed[0]}, one folder up",) if borrowed else ()
    return replace(recording, notices=(*told, *recording.notices))


def _reader_of(root: Files) -> Reader | None:
    return next((reader for reader in readers() if not reader.missing(root.names())), None)


def _unknown(source: Path, files: Files, roots: list[Files]) -> CaptureError:
    """The error for an unknown format: the files found, and the nearest formats with their missing parts."""
    nearest = _nearest(roots)
    archives = sorted(name for name in files.names() if name.endswith((".r3d", ".zip")))
    if not nearest and archives:
        inside = f"{source}: holds {archives[0]}, which may be a recording itself"
        return CaptureError(inside, hint="choose that file; unpack it first if it is in another archive")
    if not nearest and (instead := foreign_among(files.names())):
        name, kind = instead
        return kind.refusal(str(source), name)
    if not nearest:
        return CaptureError(f"{source}: {_found(files)}; no known recording format", hint=_BRING)
    reader, missing = nearest[0]
    others = "".join(f"; {other.name} would need {' and '.join(lacking)}" for other, lacking in nearest[1:])
    lacks = f"{' and '.join(missing)} {'are' if len(missing) > 1 else 'is'} missing"
    has_depth = any("depth" in name.lower() for name in files.names())
    unread = next((n for n in sorted(files.names()) if re.search(_DEPTH, n) and not re.fullmatch(_KNOWN, n)), None)
    if unread and any("depth" in part for part in missing):
        return CaptureError(f"{source}: depth such as {unread} is not read", hint=WRITE)
    flat = "" if has_depth else "; captures without depth, as in a photo mode, cannot be used"
    return CaptureError(
        f"{source}: {_found(files)}; looks like {reader.name}, but {lacks}", hint=f"it holds {reader.expects}{flat}{others}"
    )


def _roots(files: Files) -> tuple[list[Files], dict[str, Files]]:
    """The top folder and its only subfolders down to the first with several, and the subfolders there by name."""
    outer: list[Files] = [files]
    while len(folders := top_folders(outer[-1])) == 1 and len(outer) < _DEEPEST:
        outer.append(WithAbove(SubFiles(outer[-1], folders[0]), outer[-1]))
    return outer, {folder: WithAbove(SubFiles(outer[-1], folder), outer[-1]) for folder in folders[:_WIDEST]}


def _nearest(roots: list[Files]) -> list[tuple[Reader, tuple[str, ...]]]:
    """The two formats with the smallest fraction of missing parts, among those with at least half present."""
    misses = [(reader, reader.missing(root.names())) for root in roots for reader in readers()]
    misses = [(reader, missing) for reader, missing in misses if len(missing) <= len(reader.parts) / 2]
    misses.sort(key=lambda miss: (len(miss[1]) / len(miss[0].parts), -len(miss[0].parts)))
    first = {reader.name: (reader, missing) for reader, missing in reversed(misses)}
    return sorted(first.values(), key=misses.index)[:2]


def _found(files: Files) -> str:
    names = sorted(files.names())
    if not names:
        return "holds no file"
    listed = ", ".join(names[:4])
    return f"found {listed}" + (f" and {len(names) - 4} more" if len(names) > 4 else "")
