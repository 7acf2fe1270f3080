"""Cut out the object under a click: python examples/click_and_cut.py SCAN.r3d CATEGORY FRAME X Y OUT.png"""

import sys
import tempfile
from pathlib import Path

import cv2

from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.segment.stage import open_session


def main(scan: str, category: str, frame: str, x: str, y: str, out: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        capture = read_capture(Path(scan), Path(folder) / "frames", IngestConfig())
        session = open_session(capture, Path(folder) / "cache")
        click = PromptPoint(frame=int(frame), x=float(x), y=float(y), label=1)
        prompt = ObjectPrompt(name="clicked", category=category, points=(click,))
        picture = capture.images.rgb(click.frame).copy()
        picture[~session.mask_at(prompt, click.frame)] //= 4
        cv2.imwrite(out, picture[..., ::-1])
        track = session.track(prompt)
        print(f"{track.kind} in {len(track.masks)} frames: {out}")


if __name__ == "__main__":
    if len(sys.argv) != 7:
        sys.exit(__doc__)
    main(*sys.argv[1:])
