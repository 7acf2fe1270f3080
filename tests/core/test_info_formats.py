"""`r2c2r info` on a recording of every supported format, in its current layout."""

from pathlib import Path

import pytest

from r2c2r_core.cli import main
from r2c2r_core.ingest.readers.table import READERS

from .ingest.test_readers import ROOM, write

FORMATS = {
    "r3d": "Record3D .r3d",
    "exr": "Record3D EXR+JPG",
    "stray": "Stray Scanner",
    "polycam": "Polycam raw export",
    "scanner-app": "3D Scanner App",
    "arkitscenes": "ARKitScenes",
    "scannet": "ScanNet export",
    "scannetpp": "ScanNet++ iPhone",
    "7scenes": "7-Scenes folder",
    "3dmatch": "3DMatch / 7-Scenes sequence",
    "tum": "TUM RGB-D",
    "rtabmap": "RTAB-Map export",
    "nerfstudio": "nerfstudio transforms.json",
    "redwood": "Redwood / Open3D",
    "arti4d": "Arti4D",
}


def test_the_format_table_covers_every_reader() -> None:
    assert set(FORMATS.values()) == {reader.name for reader in READERS}


QUICK = ("r3d", "tum", "scannetpp")  # tests/core/ingest/test_readers.py reads all of them


@pytest.mark.parametrize("kind", [kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.slow) for kind in FORMATS])
def test_info_prints_the_format_and_frame_count(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write(kind, tmp_path)
    assert main(["info", str(source)]) == 0
    said = capsys.readouterr().out.splitlines()
    rows = dict(line.split(maxsplit=1) for line in said if line.startswith(("format ", "frames ")))
    assert rows == {"format": FORMATS[kind], "frames": str(ROOM.count)}
    assert said[-1].startswith(f"{source}: usable")
