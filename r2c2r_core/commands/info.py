"""`r2c2r info`."""

import argparse
import tempfile
from pathlib import Path
from typing import Any

from r2c2r_core.commands.options import Parsers, add_command, add_json, add_reading, existing, with_reading, write_json
from r2c2r_core.errors import CaptureError
from r2c2r_core.terminal import show_progress, table
from r2c2r_core.texts import shown


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "info", info)
    added.add_argument("capture", type=Path, help="recording: a file, a folder or a zip")
    added.add_argument("--overrides", type=Path, help="corrections of the room: up, floor, manhattan_yaw, walls")
    added.add_argument("--picture", type=Path, metavar="FILE.png", help="picture of the fused scan and the camera's path")
    add_reading(added)
    add_json(added)


def info(options: argparse.Namespace) -> int:
    """Examine a recording: what is wrong with it, the likely cause and the remedy."""
    from r2c2r_core.ingest.doctor import draw_scan, examine, refusal_to_json
    from r2c2r_core.ingest.readers.table import open_recording
    from r2c2r_core.ingest.stage import IngestConfig, read_capture
    from r2c2r_core.overrides import read_overrides

    source = existing(options.capture)
    config = with_reading(IngestConfig(), options)
    overrides = read_overrides(options.overrides) if options.overrides else None
    with tempfile.TemporaryDirectory(prefix="r2c2r-info-") as store, show_progress() as progress:
        reading = progress.for_stage("ingest")
        try:
            capture = read_capture(source, Path(store), config, overrides=overrides, progress=reading)
        except CaptureError as problem:
            if options.json:
                write_json(options.json, refusal_to_json(problem))
            raise
        report = examine(capture, open_recording(source))
    if options.json:
        write_json(options.json, report.to_json())
    if options.picture:
        _write_picture(options.picture, draw_scan(capture))
    print(table(("figure", "value"), [("format", report.format), *report.rows()]))
    for line in (*report.reasons, *report.notices):
        print(shown(f"- {line}"))
    print(shown(f"{source}: {report.verdict}"))
    return 1 if report.verdict == "unusable" else 0


def _write_picture(path: Path, pictures: Any) -> None:
    import cv2

    from r2c2r_core.ingest.doctor import side_by_side
    from r2c2r_core.workspace import write_atomically

    write_atomically(path, cv2.imencode(".png", cv2.cvtColor(side_by_side(pictures), cv2.COLOR_RGB2BGR))[1].tobytes())
