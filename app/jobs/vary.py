"""Variants of a bundle as a job: `python -m app.jobs.vary BUNDLE FOLDER --count 100 --seed 0`.

The folder gets the variants as one zip, a picture of the first of them and, last, facts.json.
"""

import argparse
import hashlib
import json
import sys
import tempfile
import time
from pathlib import Path

from app.files import VariantFiles
from app.jobs.messages import run_stage
from r2c2r_core.disk import explained_io
from r2c2r_core.limits import limit_this_process
from r2c2r_core.progress import Progress
from r2c2r_core.workspace import write_atomically


def main(arguments: list[str] | None = None) -> int:
    """Make the variants, and pack them."""
    parser = argparse.ArgumentParser(prog="app.jobs.vary", description=__doc__)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    options = parser.parse_args(arguments)
    limit_this_process()
    files = VariantFiles(options.folder)
    return run_stage("vary", lambda progress: vary(options.bundle, files, options.count, options.seed, progress))


def vary(bundle: Path, files: VariantFiles, count: int, seed: int, progress: Progress) -> None:
    """Make variants of the bundle; if interrupted, neither facts.json nor large files are left."""
    from r2c2r_core.export.archive import write_zip
    from r2c2r_core.variants.stage import make_variants

    half_packed = files.archive.with_suffix(".part")
    with tempfile.TemporaryDirectory(prefix="variants-") as scratch, explained_io(files.folder):
        made = make_variants(bundle, count, seed, Path(scratch) / "variants", progress=progress.part(0.0, 0.95))
        progress.at(0.95, "packing")
        files.folder.mkdir(parents=True, exist_ok=True)
        write_zip(made.folder, half_packed)
        half_packed.replace(files.archive)
        write_atomically(files.wall, made.wall.read_bytes())
    with files.archive.open("rb") as archive:
        digest = hashlib.file_digest(archive, "sha256").hexdigest()
    facts = {
        "count": count,
        "seed": seed,
        "sha256": digest,
        "size": files.archive.stat().st_size,
        "created": time.time(),
        "rejected": made.rejected,
        "checked": len(made.certified),
        "failed": [name for name, passed in made.certified.items() if not passed],
    }
    write_atomically(files.facts, json.dumps(facts, indent=1).encode())


if __name__ == "__main__":
    sys.exit(main())
