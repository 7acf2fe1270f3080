"""CPU time of motion search: tracking all objects of a recording with it, and with all fronts assumed closed.

    python benchmarks/opened_cost.py WORKDIR/ours-21 [WORKDIR/second-100 …] [--json FILE]

Uses recordings that benchmarks/opened.py has run. Both variants start with an empty cache and with the runs cut, each in its
own process, so that neither profits from files read or code compiled by the other.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from pathlib import Path
from unittest import mock

from r2c2r_core.errors import R2C2RError
from r2c2r_core.segment.motion.leaf import Leaf
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.segment.stage import open_session
from r2c2r_core.workspace import Workspace


def main(arguments: Sequence[str] | None = None) -> int:
    """Per recording: seconds with, seconds without, the difference in percent."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="+", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--way", choices=("opened", "closed"), help=argparse.SUPPRESS)  # for the child process
    options = parser.parse_args(arguments)
    if options.way is not None:
        print(tracking_seconds(options.recordings[0], closed=options.way == "closed"))
        return 0
    rows = {folder.name: {way: _apart(folder, way) for way in ("opened", "closed")} for folder in options.recordings}
    for name, row in rows.items():
        print(
            f"{name}: {row['opened']:.1f} s, {row['closed']:.1f} s closed, {100 * (row['opened'] / row['closed'] - 1):+.0f} %"
        )
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


def tracking_seconds(folder: Path, *, closed: bool) -> float:
    """CPU seconds to track every prompt of a recording; with `closed`, without the search for moving leaves."""
    capture = Workspace(folder / "run" / "work").load_latest("ingest", "scene")
    if capture is None:
        raise SystemExit(f"{folder}: no run found; run benchmarks/opened.py first")
    prompts = read_prompts(folder / "prompts.json")
    unmoved = mock.patch("r2c2r_core.segment.motion.filmed.find_motion", _never) if closed else nullcontext()
    with tempfile.TemporaryDirectory() as cache, unmoved:
        session = open_session(capture, Path(cache))
        session.prepare()
        start = time.process_time()
        for prompt in prompts.objects:
            with suppress(R2C2RError):  # objects that are not found are missing in both variants
                session.track(prompt)
        return time.process_time() - start


def _never(leaf: Leaf, *_: object, **__: object) -> tuple[Leaf, None]:
    return leaf, None


def _apart(folder: Path, way: str) -> float:
    done = subprocess.run([sys.executable, __file__, str(folder), "--way", way], capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])


if __name__ == "__main__":
    sys.exit(main())
