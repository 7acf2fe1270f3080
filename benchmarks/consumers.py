"""Compatibility test of bundles and datasets with third-party programs, each installed in its own environment and run once.

    python benchmarks/consumers.py BUNDLE DATASET [--only PROBE …] [--environments DIR] [--update]

BUNDLE is a bundle's folder, DATASET is written by `r2c2r dataset` from the same kitchen. A program's counts (joints, masks) are
compared with the contents of the files. --update writes the rows into benchmarks/consumers.json.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import venv
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from consumer_probes import PROBES

HERE = Path(__file__).resolve().parent
RESULTS, PROBE = HERE / "consumers.json", HERE / "consumer_probes.py"
MINUTES = 15  # for one program's installation and run
REQUIRES = {  # by probe: what pip installs; the probe's name with hyphens where it is not listed
    "pinocchio": ["pin"],
    "dm_control": ["dm_control", "mujoco<4"],  # 1.0.50 reads fields that MuJoCo 4 no longer has
    "mujoco_urdf": ["mujoco"],
    "trimesh_glb": ["trimesh", "pillow"],
    "rod": ["rod"],
    "compas_robots": ["compas_robots", "pycollada"],
    "torchvision": ["torchvision", "pycocotools"],
    "catkin_pkg": ["catkin_pkg"],
    "urdf_parser_py": ["urdf_parser_py", "setuptools<81"],
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Install and run each program; exit 1 if any count differs from the contents of the files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--only", nargs="+", choices=sorted(PROBES), default=list(PROBES), metavar="PROBE")
    parser.add_argument("--environments", type=Path, help="kept afterwards and reused")
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args(arguments)
    held = held_counts(options.bundle, options.dataset)
    rows: dict[str, dict[str, Any]] = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    with tempfile.TemporaryDirectory(prefix="r2c2r-consumers-") as scratch:
        for name in options.only:
            rows[name] = tried(name, options.bundle, options.dataset, (options.environments or Path(scratch)) / name, held)
            print(f"| {name} | {rows[name]['version']} | {rows[name]['result']} |", flush=True)
            if options.update:
                RESULTS.write_text(json.dumps(rows, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    return int(any(rows[name]["result"] != "read" for name in options.only))


def held_counts(bundle: Path, dataset: Path) -> dict[str, int]:
    """The true counts of the files, by the name of what a probe may count."""
    root = ET.parse(bundle / "scene.urdf").getroot()
    labels = json.loads((dataset / "annotations.json").read_text(encoding="utf-8"))
    return {
        "joints": sum(joint.get("type") != "fixed" for joint in root.findall("joint")),
        "links": len(root.findall("link")),
        "colliders": len(root.findall("link/collision")),
        "visuals": len(root.findall("link/visual")),
        "masks": len(labels["annotations"]),
        "packages": 1,
    }


def tried(name: str, bundle: Path, dataset: Path, environment: Path, held: dict[str, int]) -> dict[str, Any]:
    """The version of a program and its outcome: "read", or the error in one line."""
    packages = REQUIRES.get(name, [name.replace("_", "-")])
    try:
        python = environment_python(environment, packages)
    except RuntimeError as error:
        return {"version": "", "result": f"not installed: {error}"}
    shown = _run([str(python), "-m", "pip", "show", packages[0]]).stdout
    version = next((line.split(": ")[1] for line in shown.splitlines() if line.startswith("Version: ")), "")
    ran = _run([str(python), str(PROBE), name, str(bundle.resolve()), str(dataset.resolve())])
    if ran.returncode:
        return {"version": version, "result": f"failed: {last_line(ran)}"}
    counted: dict[str, int] = json.loads(ran.stdout.strip().splitlines()[-1])
    off = [f"{count} {kind}, the files hold {held[kind]}" for kind, count in counted.items() if held.get(kind, count) != count]
    return {"version": version, "result": "; ".join(off) or "read", **counted}


def environment_python(environment: Path, packages: Sequence[str]) -> Path:
    """Python of a virtual environment with the packages, created where missing; raises RuntimeError where pip fails."""
    python = environment.absolute() / "bin" / "python"  # not resolved: it is a link out of the environment
    if not python.exists():
        venv.create(environment, with_pip=True)
    installed = _run([str(python), "-m", "pip", "install", "--quiet", *packages])
    if installed.returncode:
        raise RuntimeError(last_line(installed))
    return python


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=60 * MINUTES, cwd=tempfile.gettempdir())
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 124, "", f"took more than {MINUTES} minutes")


def last_line(ran: subprocess.CompletedProcess[str]) -> str:
    """The last non-empty line of a command's errors, or else of its output."""
    lines = [line for line in (ran.stderr or ran.stdout).splitlines() if line.strip()]
    return lines[-1].strip()[:200] if lines else f"exit status {ran.returncode}"


if __name__ == "__main__":
    sys.exit(main())
