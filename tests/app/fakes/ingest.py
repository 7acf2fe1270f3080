"""Stand-in ingest that reads any recording as three frames: `ingest.py WORKDIR PROJECTDIR --request FILE`."""

import json
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).parent
FRAMES = (0, 3, 7)  # numbered with gaps, as in recordings


def write_recording(work: Path, folder: Path, source: str) -> None:
    """Files that the real ingest writes, for three small frames."""
    for index in FRAMES:
        for name, picture in (("rgb", "frame.jpg"), ("depth", "depth.png")):
            path = work / "capture" / name / f"{index:06d}{Path(picture).suffix}"
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(HERE / picture, path)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "frames.json").write_text(json.dumps([frame(index) for index in FRAMES]))
    facts = {"format": "fake", "sha256": "ab" * 32, "frame_count": 3, "width": 160, "height": 120, "verdict": "good"}
    (folder / "facts.json").write_text(json.dumps({"facts": facts, "notices": ["a notice"], "source": source}))


def frame(index: int) -> dict[str, object]:
    size = {"width": 160, "height": 120}
    return {"index": index, "timestamp_s": index / 10, **size, "sharpness": 10.0 + index, "camera": [0.0, 0.0, 1.5]}


if __name__ == "__main__":
    workdir, project = Path(sys.argv[1]), Path(sys.argv[2])
    request = json.loads(Path(sys.argv[4]).read_text())
    if "broken" in request["source"]:  # fails late
        write_recording(workdir, project, request["source"])
        error = {"kind": "CaptureError", "message": "no depth in it", "hint": "record again"}
        sys.stdout.write(json.dumps({"error": error}) + "\n")
        sys.exit(2)
    sys.stdout.write(json.dumps({"stage": "ingest", "fraction": 0.4, "text": "reading"}) + "\n")
    write_recording(workdir, project, request["source"])
    sys.stdout.write(json.dumps({"done": "ingest"}) + "\n")
