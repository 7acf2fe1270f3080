"""Table of the engines that load, move and agree with bundles, and of single objects opened from another folder.

    python benchmarks/engines.py BUNDLE.zip … [--environments DIR] [--only ENGINE …] [--update]

Every loader of the certificate reads each bundle; those with a Python environment of their own are installed below
--environments, or taken from their variable (R2C2R_…_PYTHON). One drawer (or the first object with a joint) is then referenced
from an empty MJCF, URDF and USD scene in another folder and opened. check_urdf (Debian: liburdfdom-tools) parses the URDF files
if it is installed. --update writes the rows into benchmarks/engines.json, which docs/how-to/simulators.md shows.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from consumers import environment_python, last_line

from r2c2r_core.export.archive import opened_bundle
from r2c2r_core.export.loaders import APART, try_loaders
from r2c2r_core.export.reading import read_urdf

HERE = Path(__file__).resolve().parent
RESULTS, EXAMPLES = HERE / "engines.json", HERE.parent / "examples"
REQUIRES = {
    "SAPIEN": ["sapien", "setuptools<81"],
    "Drake": ["drake"],
    "MJX": ["mujoco-mjx"],
    "MuJoCo Warp": ["mujoco-warp"],
    "Newton": ["newton[sim,importers]"],
    "Genesis": ["genesis-world", "torch==2.13.0"],
    "NVIDIA asset validator": ["omniverse-asset-validator", "usd-core"],
}
_ROW = re.compile(r"^(\S+): ([-\d.]+) of ([\d.]+)$", re.MULTILINE)


def main(arguments: Sequence[str] | None = None) -> int:
    """Try every bundle; exit 1 if a loader rejects one or an object does not open."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundles", type=Path, nargs="+")
    parser.add_argument("--environments", type=Path, help="folder of the engines' Python environments, created where missing")
    parser.add_argument("--only", nargs="+", choices=sorted(APART), default=sorted(APART), metavar="ENGINE")
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args(arguments)
    _name_environments(options.only, options.environments)
    rows: dict[str, dict[str, Any]] = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    faults = []
    for path in options.bundles:
        with opened_bundle(path) as folder:
            row = tried(folder)
        kept = rows.get(path.stem, {"loaders": {}, "alone": {}})
        row["loaders"] = {**kept["loaders"], **{n: said for n, said in row["loaders"].items() if said["state"] != "not tried"}}
        row["alone"] = {**row["alone"], **kept["alone"], **{n: said for n, said in row["alone"].items() if not _not_run(said)}}
        rows[path.stem] = row
        faults += faults_of(path.stem, row)
        print(f"| {path.stem} | {row['joints']} joints | {', '.join(_words(row))} |", flush=True)
        if options.update:
            RESULTS.write_text(json.dumps(rows, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    print("\n".join(faults) or "every loader passed, every object opened")
    return int(bool(faults))


def tried(folder: Path) -> dict[str, Any]:
    """Results of one unpacked bundle: its loaders, and the share of its travel that one object opens in each format."""
    urdf = read_urdf(folder / "scene.urdf")
    loaders = {
        result.loader: {
            "state": result.state,
            "detail": result.detail,
            "steps_per_s": {str(worlds): round(speed) for worlds, speed in result.steps_per_s},
        }
        for result in try_loaders(folder, urdf)
    }
    if shutil.which("check_urdf"):
        loaders["check_urdf"] = _parsed(folder)
    name = _one_object(folder)
    return {
        "joints": sum(joint.type in ("revolute", "prismatic") for joint in urdf.joints),
        "loaders": loaders,
        "alone": {"object": name, **opened_alone(folder, name)},
    }


def opened_alone(folder: Path, name: str) -> dict[str, float | str]:
    """Share of its travel reached by the joint farthest from its end, by format; an error or a reason where it was not run."""
    newton = os.environ.get(APART["Newton"].variable) or sys.executable
    with tempfile.TemporaryDirectory(prefix="r2c2r-elsewhere-") as elsewhere:
        bundle = os.path.relpath(folder, elsewhere)
        commands = {
            "MJCF": [sys.executable, EXAMPLES / "asset_in_mujoco.py", bundle, name],
            "URDF": [sys.executable, EXAMPLES / "asset_in_pybullet.py", bundle, name],
            "USD": [newton, EXAMPLES / "asset_in_usd.py", bundle, name, "stage.usda"],
        }
        return {kind: _opened([str(word) for word in command], elsewhere) for kind, command in commands.items()}


def faults_of(kitchen: str, row: dict[str, Any]) -> list[str]:
    """One line for each failed loader and each object that opened less than 95 % or more than 105 % of its travel."""
    lines = [f"{kitchen}: {n}: {said['detail']}" for n, said in row["loaders"].items() if said["state"] == "failed"]
    shares = {kind: share for kind, share in row["alone"].items() if kind != "object"}
    return lines + [
        f"{kitchen}: {row['alone']['object']} alone in {kind}: {share}"
        for kind, share in shares.items()
        if not (isinstance(share, float) and abs(share - 1) <= 0.05) and not _not_run(share)
    ]


def _not_run(share: float | str) -> bool:
    return str(share).startswith("not run")


def _name_environments(engines: Sequence[str], folder: Path | None) -> None:
    """Set the engines' variables to their Pythons, installed where missing; an engine that does not install is not tried."""
    for name in sorted(APART):
        if name not in engines:
            os.environ.pop(APART[name].variable, None)
        elif folder is not None:
            try:
                python = environment_python(folder / name.lower().replace(" ", "-"), REQUIRES[name])
            except RuntimeError as error:
                print(f"{name}: not installed: {error}", flush=True)
                continue
            os.environ[APART[name].variable] = str(python)


def _one_object(folder: Path) -> str:
    """The first drawer of a bundle, else its first object with a joint."""
    objects = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["objects"]
    jointed = sorted((entry for entry in objects if entry["joint"]), key=lambda entry: entry["category"] != "drawer")
    return str(jointed[0]["name"])


def _opened(command: list[str], folder: str) -> float | str:
    ran = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder, timeout=600)
    shares = [float(reached) / float(upper) for _, reached, upper in _ROW.findall(ran.stdout)]
    return round(min(shares, key=lambda share: -abs(share - 1)), 3) if shares else last_line(ran)


def _parsed(folder: Path) -> dict[str, Any]:
    """Result of check_urdf on the scene's and all objects' URDF files."""
    files = [folder / "scene.urdf", folder / "ros" / "scene.urdf", *sorted(folder.glob("assets/*/*.urdf"))]
    for file in files:
        ran = subprocess.run(["check_urdf", str(file)], capture_output=True, text=True, check=False)
        if ran.returncode:
            return {"state": "failed", "detail": f"{file.relative_to(folder)}: {last_line(ran)}", "steps_per_s": {}}
    return {"state": "passed", "detail": f"{len(files)} files parsed", "steps_per_s": {}}


def _words(row: dict[str, Any]) -> list[str]:
    return [f"{name} {said['state']}" for name, said in row["loaders"].items()] + [f"alone {row['alone']}"]


if __name__ == "__main__":
    sys.exit(main())
