"""A synthetic kitchen as a job: `python -m app.jobs.sample FOLDER --name NAME --frames 90 --size 960x720 --picture FILE`."""

import argparse
import sys
from functools import partial
from pathlib import Path

import cv2

from app.jobs.messages import run_stage
from r2c2r_core.arrays import Image
from r2c2r_core.limits import limit_this_process
from r2c2r_core.progress import Progress
from r2c2r_core.workspace import write_atomically

PICTURE_WIDTH = 480  # pixels, of the progress picture


def main(arguments: list[str] | None = None) -> int:
    """Write the recording unless it exists."""
    parser = argparse.ArgumentParser(prog="app.jobs.sample", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--name", required=True, help="the recording's, and so its bundles' title")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--frames", type=int, default=90)
    parser.add_argument("--size", default="960x720")
    parser.add_argument("--picture", type=Path, required=True, help="the newest frame, shown while the others are rendered")
    options = parser.parse_args(arguments)
    width, height = (int(side) for side in options.size.split("x"))

    def work(progress: Progress) -> None:
        from r2c2r_core.synthetic.stage import write_sample

        finished = options.folder / ".complete"
        if not finished.exists():
            options.picture.parent.mkdir(parents=True, exist_ok=True)
            write_sample(
                options.folder,
                seed=options.seed,
                frames=options.frames,
                size=(width, height),
                name=options.name,
                progress=progress,
                show=partial(write_picture, options.picture),
            )
            finished.touch()

    return run_stage("sample", work)


def write_picture(path: Path, rgb: Image) -> None:
    """Write a frame as a small JPEG, atomically."""
    height = round(rgb.shape[0] * PICTURE_WIDTH / rgb.shape[1])
    small = cv2.resize(rgb, (PICTURE_WIDTH, height), interpolation=cv2.INTER_AREA)
    write_atomically(path, cv2.imencode(".jpg", cv2.cvtColor(small, cv2.COLOR_RGB2BGR))[1].tobytes())


if __name__ == "__main__":
    limit_this_process()
    sys.exit(main())
