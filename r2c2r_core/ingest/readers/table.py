"""The recording formats. To add one: a file with a READER, and a line here."""

from pathlib import Path

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.files import Files, SubFiles, open_files, top_folders
from r2c2r_core.ingest.readers import record3d, record3d_exr, seven_scenes, tum
from r2c2r_core.ingest.readers.protocol import Reader, Recording

READERS: tuple[Reader, ...] = (record3d.READER, record3d_exr.READER, seven_scenes.READER, tum.READER)


def open_recording(source: Path) -> Recording:
    """The recording at `source`, its format recognised from its content; raises CaptureError."""
    files = open_files(source)
    for root in _roots(files):
        for reader in READERS:
            if reader.recognise(root.names()):
                return reader.open(root)
    raise CaptureError(f"{source}: {_found(files)}; no known recording format", hint=_expected())


def _roots(files: Files) -> list[Files]:
    """The top, then the folders right below it: a zip of a folder has one, an export may lie beside other things."""
    return [files, *(SubFiles(files, folder) for folder in top_folders(files)[:50])]


def _found(files: Files) -> str:
    names = sorted(files.names())
    if not names:
        return "holds no file"
    listed = ", ".join(names[:4])
    return f"found {listed}" + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def _expected() -> str:
    return "expected one of: " + "; ".join(f"{r.name} ({r.expects})" for r in READERS)
