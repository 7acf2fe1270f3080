"""The recording formats. To add one: a file with a READER, and a line here."""

from pathlib import Path

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.files import Files, SubFiles, open_files, top_folders
from r2c2r_core.ingest.readers import (
    arkitscenes,
    nerfstudio,
    polycam,
    record3d,
    record3d_exr,
    redwood,
    scannet,
    seven_scenes,
    stray,
    threedmatch,
    tum,
)
from r2c2r_core.ingest.readers.plausible import plausible
from r2c2r_core.ingest.readers.protocol import Reader, Recording
from r2c2r_core.ingest.upright import upright

READERS: tuple[Reader, ...] = (
    record3d.READER,
    record3d_exr.READER,
    stray.READER,
    polycam.READER,
    arkitscenes.READER,
    scannet.READER,
    seven_scenes.READER,
    threedmatch.READER,
    tum.READER,
    redwood.READER,
    nerfstudio.READER,
)
_DEEPEST, _WIDEST = 6, 50  # folders that are looked into


def open_recording(source: Path) -> Recording:
    """The recording at `source`, its format recognised from what it holds; raises CaptureError."""
    files = open_files(source)
    roots = _roots(files)
    for root in roots:
        for reader in READERS:
            if not reader.missing(root.names()):
                return upright(plausible(reader.open(root)))
    if archives := sorted(name for name in files.names() if name.endswith((".r3d", ".zip"))):
        raise CaptureError(
            f"{source}: holds {archives[0]}, which may be a recording itself", hint="choose that file (unpacked)"
        )
    miss = _nearest_miss(roots)
    if miss is None:
        raise CaptureError(f"{source}: {_found(files)}; no known recording format", hint=f"looked for {_formats()}")
    reader, missing = miss
    lacks = f"{' and '.join(missing)} {'are' if len(missing) > 1 else 'is'} missing"
    raise CaptureError(
        f"{source}: {_found(files)}; looks like {reader.name}, but {lacks}",
        hint=f"it holds {reader.expects}; also looked for {', '.join(r.name for r in READERS if r is not reader)}",
    )


def _roots(files: Files) -> list[Files]:
    """The top, the folders right below it (an export may lie beside other things), and down to the first fork."""
    roots: list[Files] = [files]
    while len(folders := top_folders(roots[-1])) == 1 and len(roots) < _DEEPEST:
        roots.append(SubFiles(roots[-1], folders[0]))
    return [*roots, *(SubFiles(roots[-1], folder) for folder in folders[:_WIDEST])]


def _nearest_miss(roots: list[Files]) -> tuple[Reader, tuple[str, ...]] | None:
    """The format that lacks the smallest share of its parts, if at least half of them are there."""
    misses = [(reader, reader.missing(root.names())) for root in roots for reader in READERS]
    reader, missing = min(misses, key=lambda miss: (len(miss[1]) / len(miss[0].parts), -len(miss[0].parts)))
    return (reader, missing) if len(missing) <= len(reader.parts) / 2 else None


def _found(files: Files) -> str:
    names = sorted(files.names())
    if not names:
        return "holds no file"
    listed = ", ".join(names[:4])
    return f"found {listed}" + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def _formats() -> str:
    return "; ".join(f"{reader.name} ({reader.expects})" for reader in READERS)
