"""Stand-in stage that sleeps as long as the real one took and stores as much: `throughput_stage.py LENGTHS FAKE WORKDIR …`.

LENGTHS is a JSON file: seconds, files and bytes of each stage; for a stage that works object by object also the seconds before
the objects ("shared") and the start time of any process ("start"). FAKE is the tests' stand-in, which writes the files that the
app reads.
"""

import json
import os
import runpy
import sys
import time
from pathlib import Path

SAID_S = 0.25  # interval of progress messages, as in the real stages


def main() -> None:
    """Sleep, store, and end as the tests' stand-in does; with --only as r2c2r_core.worker does."""
    lengths, fake, workdir = Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
    stage = sys.argv[sys.argv.index("--until") + 1] if "--until" in sys.argv else "ingest"
    length = json.loads(lengths.read_text())[stage]
    folder = workdir / "nouns" / stage
    folder.mkdir(parents=True, exist_ok=True)
    if "--only" in sys.argv:
        some_objects(length, stage, folder, sys.argv[sys.argv.index("--only") + 1 :])
        return
    names = range(length["files"])
    if "shared" in length and all((folder / f"{name}.noun").exists() for name in objects()):
        sleep(stage, length["start"])
        names = range(0)
    else:
        sleep(stage, length["seconds"])
    for number in names:
        store(folder, str(number), length["bytes"] // length["files"])
    sys.argv = [fake, *sys.argv[3:]]
    runpy.run_path(fake, run_name="__main__")


def some_objects(length: dict[str, float], stage: str, folder: Path, names: list[str]) -> None:
    """Process these objects; with no names, the work that all objects share."""
    known = objects()
    each = (length["seconds"] - length["shared"]) / len(known)
    sleep(stage, length["start"] + each * len(names) if names else length["shared"])
    for name in names:
        store(folder, name, int(length["bytes"]) // len(known))
    say(done=stage, failures={}, left=[name for name in known if not (folder / f"{name}.noun").exists()])


def objects() -> list[str]:
    """Names of the objects in the job's request."""
    request = Path(sys.argv[len(sys.argv) - sys.argv[::-1].index("--request")])
    return [item["name"] for item in json.loads(request.with_name("prompts.json").read_text())["objects"]]


def sleep(stage: str, seconds: float) -> None:
    """Sleep while reporting progress."""
    began = time.monotonic()
    while (left := began + seconds - time.monotonic()) > 0:
        say(stage=stage, fraction=1 - left / seconds, text="a kitchen")
        time.sleep(min(SAID_S, left))


def store(folder: Path, name: str, size: int) -> None:
    """Write a noun of `size` random bytes."""
    (folder / f"{name}.noun").write_bytes(os.urandom(size))


def say(**words: object) -> None:
    """Print a JSON message for the parent process."""
    sys.stdout.write(json.dumps(words) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
