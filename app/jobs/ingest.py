"""Reading a recording as a job: `python -m app.jobs.ingest WORKDIR PROJECTDIR --request FILE`.

Beside the workspace it writes data that the web process needs without loading the recording: frames.json (the frame
table), facts.json (facts about the recording, and its problems) and pictures of the scan.
"""

import argparse
import json
import sys
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from app import archives
from app.files import ProjectFiles
from app.jobs.messages import run_stage
from app.settings import Settings
from r2c2r_core.errors import CaptureError, PromptError
from r2c2r_core.limits import free_memory, limit_this_process
from r2c2r_core.model.capture import Capture
from r2c2r_core.progress import Progress
from r2c2r_core.workspace import Workspace, write_atomically

MEMORY_SHARE = 0.7  # of the free memory at start, as it decodes untrusted files
CPU_S = 4 * 3600  # a recording of an hour takes a tenth of that
FILE_BYTES = 8 << 30
SAME_PATH_M = 0.01  # poses are read, not estimated, so another recording differs by decimetres


def main(arguments: list[str] | None = None) -> int:
    """Read the recording and describe it."""
    parser = argparse.ArgumentParser(prog="app.jobs.ingest", description=__doc__)
    parser.add_argument("workdir", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--request", type=Path, required=True)
    options = parser.parse_args(arguments)
    limit_this_process(memory_bytes=free_memory(MEMORY_SHARE), cpu_s=CPU_S, file_bytes=FILE_BYTES)
    return run_stage("ingest", lambda progress: ingest(options.workdir, options.folder, options.request, progress))


def ingest(workdir: Path, folder: Path, request: Path, progress: Progress) -> None:
    """Read the request's recording, and describe it in the project's folder."""
    from r2c2r_core.pipeline import reconstruct
    from r2c2r_core.worker import read_request

    document = json.loads(request.read_text())
    source = _checked_source(Path(document["source"]))
    work = Workspace(workdir)
    with suppress(PromptError):  # there are no clicks yet; the recording is read before this is detected
        reconstruct(read_request(request), work, until="ingest", progress=progress)
    capture: Capture | None = work.load_latest("ingest", "scene")
    if capture is None:
        raise PromptError("the recording was not read", hint="see the job's log")
    files = ProjectFiles(folder, workdir)
    if files.awaited_frames.is_file() and not files.frames.is_file():  # the first reading
        refuse_another(source.name, frame_table(capture), json.loads(files.awaited_frames.read_text()))
    describe(capture, folder, source)


def refuse_another(name: str, found: list[dict[str, Any]], awaited: list[dict[str, Any]]) -> None:
    """Raise CaptureError if the recording is not the one of an imported project, by frames and camera path."""
    hint = "choose the recording that the project was made from"
    if [entry["index"] for entry in found] != [entry["index"] for entry in awaited]:
        raise CaptureError(f"{name}: {len(found)} frames, {len(awaited)} or others expected by the project", hint=hint)
    for ours, theirs in zip(found, awaited, strict=True):
        size, wanted = ((entry["width"], entry["height"]) for entry in (ours, theirs))
        if size != wanted:
            raise CaptureError(
                f"{name}: frame {ours['index']} has {size[0]}x{size[1]} pixels, {wanted[0]}x{wanted[1]} expected", hint=hint
            )
    ways = [np.array([entry["camera"] for entry in table]) for table in (found, awaited)]
    far_m = np.abs(
        np.subtract(*(np.linalg.norm(way - way[0], axis=1) for way in ways))
    ).max()  # independent of the up direction
    if far_m > SAME_PATH_M:
        raise CaptureError(f"{name}: the camera path is {far_m:.2f} m away from the project's", hint=hint)


def describe(capture: Capture, folder: Path, source: Path | None) -> None:
    """Write frames.json, facts.json, scan-plan.png and scan-view.png."""
    from r2c2r_core.ingest.doctor import draw_scan

    for name, picture in draw_scan(capture)._asdict().items():
        png = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGBA2BGRA))[1]
        write_atomically(folder / f"scan-{name}.png", png.tobytes())
    write_atomically(folder / "frames.json", json.dumps(frame_table(capture)).encode())
    facts = {
        "facts": capture_facts(capture, source),
        "notices": list(capture.notices),
        "source": str(source) if source else None,
    }
    write_atomically(folder / "facts.json", json.dumps(facts, indent=1).encode())


def frame_table(capture: Capture) -> list[dict[str, Any]]:
    """The frames as schemas.FrameInfo."""
    return [
        {
            "index": frame.index,
            "timestamp_s": frame.timestamp_s,
            "width": frame.rgb_camera.width,
            "height": frame.rgb_camera.height,
            "sharpness": round(float(frame.sharpness), 3),
            "camera": [round(float(value), 4) for value in frame.world_from_camera.translation],
        }
        for frame in capture.frames
    ]


def capture_facts(capture: Capture, source: Path | None) -> dict[str, Any]:
    """Facts about the recording as schemas.CaptureFacts."""
    from r2c2r_core.ingest.doctor import examine
    from r2c2r_core.ingest.readers.table import open_recording

    # a finished run outlives its recording: the doctor then uses the stored frames only
    recording = open_recording(source) if source is not None and source.exists() else None
    report = examine(capture, recording)
    first = capture.frames[0]
    path = np.array([frame.world_from_camera.translation for frame in capture.frames])
    stamps = [frame.timestamp_s for frame in capture.frames if frame.timestamp_s is not None]
    return {
        "format": capture.format,
        "sha256": capture.sha256,
        "frame_count": len(capture.frames),
        "width": first.rgb_camera.width,
        "height": first.rgb_camera.height,
        "depth_width": first.depth_camera.width,
        "depth_height": first.depth_camera.height,
        "duration_s": round(stamps[-1] - stamps[0], 3) if len(stamps) > 1 else None,
        "path_length_m": round(float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()), 3),
        "up_source": capture.room.up_source,
        "floor_found": capture.room.floor_found,
        "verdict": report.verdict,
        "remarks": [asdict(remark) for remark in report.remarks],
        "figures": [{"name": name, "value": value} for name, value in report.rows()],
        "moments": [asdict(moment) for moment in report.moments],
    }


def _checked_source(source: Path) -> Path:
    """The recording, after a safety check of an archive."""
    if source.is_file() and source.suffix.lower() in (".zip", ".r3d"):
        limits = Settings(data_dir=source.parent)
        archives.check_archive(source, source.name, max_bytes=limits.max_unpacked_bytes, max_files=limits.max_unpacked_files)
    return source


if __name__ == "__main__":
    sys.exit(main())
