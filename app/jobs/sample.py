"""A synthetic kitchen as a job: `python -m app.jobs.sample FOLDER --seed 0 --frames 90 --size 960x720`."""

import argparse
import sys
from pathlib import Path

from app.jobs.messages import run_stage
from r2c2r_core.limits import limit_this_process
from r2c2r_core.progress import Progress


def main(arguments: list[str] | None = None) -> int:
    """Write the recording unless it is there already."""
    parser = argparse.ArgumentParser(prog="app.jobs.sample", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--frames", type=int, default=90)
    parser.add_argument("--size", default="960x720")
    options = parser.parse_args(arguments)
    width, height = (int(side) for side in options.size.split("x"))

    def work(progress: Progress) -> None:
        from r2c2r_core.synthetic.stage import write_sample

        finished = options.folder / ".complete"
        if not finished.exists():
            write_sample(options.folder, seed=options.seed, frames=options.frames, size=(width, height), progress=progress)
            finished.touch()

    return run_stage("sample", work)


if __name__ == "__main__":
    limit_this_process()
    sys.exit(main())
