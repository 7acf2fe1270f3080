"""Shared JSON file of the app's benchmark figures: each script prints its figures and replaces its own part of the file."""

import argparse
import json
import os
import subprocess
from pathlib import Path
from typing import Any


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the option --json FILE, the same in every script."""
    parser.add_argument("--json", type=Path, help="keep the figures in this file (benchmarks/app.json), beside those of others")


def report(part: str, figures: dict[str, Any], file: Path | None, *, failed: bool = False) -> int:
    """Print the figures, replace that part of the file, and return the exit status: whether a bar was missed."""
    figures = {
        "commit": _commit(),
        **figures,
        "load_average": round(os.getloadavg()[1], 1),
    }  # times are not meaningful on a busy machine
    print(json.dumps(figures, indent=1))
    if file is not None:
        parts = json.loads(file.read_text()) if file.exists() else {}
        parts[part] = figures
        beside = file.with_suffix(".part")
        beside.write_text(json.dumps(dict(sorted(parts.items())), indent=1) + "\n")
        os.replace(beside, file)
    return 1 if failed else 0


def _commit() -> str:
    """The commit that was measured, as git describes it: with "-dirty" if files were changed; empty outside a clone."""
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    return subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False).stdout.strip()
