"""Round-trip test of the bundle in every supported loader: does it load, with the values of scene.urdf?

Each loader's probe returns the same document, compared value by value (`readback.py`). A loader that is not installed is
`not tried`.
"""

import importlib.util
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from r2c2r_core.export.omniverse import validated
from r2c2r_core.export.readback import Readback, differences, expected_readback, readback_of
from r2c2r_core.export.reading import Urdf
from r2c2r_core.limits import free_memory
from r2c2r_core.model.report import LoaderResult
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.threads import in_threads

_PROBES = Path(__file__).parent / "probes"
_SECONDS = 180
_MEMORY_SHARE = 0.8  # of the free memory, for one loader


@dataclass(frozen=True, slots=True, kw_only=True)
class Apart:
    """A loader installed in a separate Python environment."""

    variable: str  # environment variable with the path of that Python
    module: str  # that it must be able to import
    reads: str
    probe: str
    seconds: int = _SECONDS  # time limit


APART = {
    "SAPIEN": Apart(variable="R2C2R_SAPIEN_PYTHON", module="sapien", reads="scene.urdf", probe="sapien_probe.py"),
    "Drake": Apart(variable="R2C2R_DRAKE_PYTHON", module="pydrake", reads="scene.sdf", probe="drake_probe.py"),
    "MJX": Apart(  # JAX compiles the step for each scene: 80 s of processor for one of 50 shapes
        variable="R2C2R_MJX_PYTHON", module="mujoco.mjx", reads="scene.xml", probe="mjx_probe.py", seconds=900
    ),
    "MuJoCo Warp": Apart(  # its first run compiles a hundred kernels: 70 s of processor
        variable="R2C2R_WARP_PYTHON", module="mujoco_warp", reads="scene.xml", probe="warp_probe.py", seconds=900
    ),
    "Newton": Apart(variable="R2C2R_NEWTON_PYTHON", module="newton", reads="scene.usda", probe="newton_probe.py", seconds=900),
    "Genesis": Apart(  # its first run compiles its kernels: 240 s of processor
        variable="R2C2R_GENESIS_PYTHON", module="genesis", reads="scene.xml", probe="genesis_probe.py", seconds=900
    ),
    "NVIDIA asset validator": Apart(
        variable="R2C2R_ASSET_VALIDATOR_PYTHON", module="omni.asset_validator", reads="scene.usda", probe="omniverse_probe.py"
    ),
}
EVERY_LOADER = ("yourdfpy", "MuJoCo (URDF)", "MuJoCo (MJCF)", "PyBullet", "USD", *APART)


class _NotThereError(Exception):
    """The loader is not installed; the message explains how to get it."""


def try_loaders(
    folder: Path, urdf: Urdf, sapien_python: str | None = None, *, progress: Progress = SILENT
) -> tuple[LoaderResult, ...]:
    """One result per loader."""
    expected = expected_readback(urdf)
    scene = folder / "scene.urdf"
    pythons = {name: os.environ.get(own.variable) for name, own in APART.items()}
    if sapien_python:
        pythons["SAPIEN"] = sapien_python
    attempts: tuple[tuple[str, Callable[[], dict[str, Any]]], ...] = (
        ("yourdfpy", lambda: _yourdfpy(scene)),
        ("MuJoCo (URDF)", lambda: _mujoco(scene)),
        ("MuJoCo (MJCF)", lambda: _mujoco(folder / "scene.xml")),
        ("PyBullet", lambda: _pybullet(scene)),
        ("USD", lambda: _usd(folder / "scene.usda")),
        *((name, partial(_apart, folder, APART[name], python)) for name, python in pythons.items()),
    )

    def verdict(loader: tuple[str, Callable[[], dict[str, Any]]]) -> LoaderResult:
        return _verdict(*loader, expected)

    return tuple(progress.each(in_threads(verdict, attempts), "loaders", count=len(attempts)))


def _verdict(name: str, attempt: Callable[[], dict[str, Any]], expected: Readback) -> LoaderResult:
    try:
        document = attempt()
        if "issues" in document:
            return validated(name, document)
        found = readback_of(document)
    except _NotThereError as error:
        return LoaderResult(loader=name, state="not tried", detail=str(error))
    except Exception as error:  # a loader may raise anything on a bundle it rejects: that is its result
        return LoaderResult(loader=name, state="failed", detail=_one_line(_said(error)))
    lines = differences(expected, found)
    if lines:
        more = f" (and {len(lines) - 3} more)" if len(lines) > 3 else ""
        return LoaderResult(loader=name, state="failed", detail=_one_line(f"{found.version}: {'; '.join(lines[:3])}{more}"))
    return LoaderResult(loader=name, state="passed", detail=_agreed(found), steps_per_s=found.steps_per_s)


def _agreed(found: Readback) -> str:
    """Summary of the compared values, and of the joint values that this loader does not store."""
    total = sum(body.mass_kg for body in found.bodies.values())
    held = f"{found.version}: {len(found.joints)} joints, {len(found.bodies)} links, {total:.2f} kg read back and equal"
    lost = found.not_kept
    words = " or ".join(filter(None, (", ".join(lost[:-1]), *lost[-1:])))
    return f"{held}; it does not keep joint {words}" if lost else held


def _yourdfpy(scene: Path) -> dict[str, Any]:
    if importlib.util.find_spec("yourdfpy") is None:
        raise _NotThereError("not installed: pip install yourdfpy")
    from r2c2r_core.export.probes.yourdf import read_back

    return read_back(scene)


def _mujoco(scene: Path) -> dict[str, Any]:
    if importlib.util.find_spec("mujoco") is None:
        raise _NotThereError("not installed: pip install mujoco")
    from r2c2r_core.export.probes.mujoco_model import read_back

    return read_back(scene)


def _pybullet(scene: Path) -> dict[str, Any]:
    if importlib.util.find_spec("pybullet") is None:
        raise _NotThereError("not installed: pip install 'r2c2r[bullet]'")
    return _probe([sys.executable, str(_PROBES / "bullet.py")], scene)


def _apart(folder: Path, own: Apart, python: str | None) -> dict[str, Any]:
    """Output of the loader's probe, run in its own environment."""
    if not python:
        raise _NotThereError(f"no Python environment configured: set {own.variable} to its python")
    if not Path(python).is_file():
        raise _NotThereError(f"{own.variable} is {python}, which does not exist")
    present = subprocess.run([python, "-c", f"import {own.module}"], capture_output=True, timeout=_SECONDS, check=False)
    if present.returncode != 0:
        raise _NotThereError(f"{python} cannot import {own.module}")
    scene = folder / own.reads
    if not scene.is_file():
        raise _NotThereError(f"{scene.name} is not in the bundle: an older version wrote it")
    return _probe([python, str(_PROBES / own.probe)], scene, own.seconds)


def _usd(scene: Path) -> dict[str, Any]:
    if importlib.util.find_spec("pxr") is None:
        raise _NotThereError("not installed: pip install usd-core")
    if not scene.is_file():
        raise FileNotFoundError(f"{scene.name} is not in the bundle")
    # Not in this process: its libraries take the GIL while loading, which another loading thread holds.
    return _probe([sys.executable, str(_PROBES / "usd.py")], scene)


def _probe(command: list[str], scene: Path, seconds: int = _SECONDS) -> dict[str, Any]:
    """Run a loader in a separate process and folder, as it may crash, print, write logs, and fill the memory."""
    memory = free_memory(_MEMORY_SHARE)
    with tempfile.TemporaryDirectory() as scratch:
        answer = Path(scratch) / "answer.json"
        words = [*_limited(memory), *command, str(scene.resolve()), str(answer)]
        run = subprocess.run(words, capture_output=True, timeout=seconds, check=False, cwd=scratch)
        if run.returncode != 0 or not answer.is_file():
            said = run.stderr.decode(errors="replace").strip().splitlines()
            died = f"killed by {signal.Signals(-run.returncode).name}" if run.returncode < 0 else "failed"
            raise RuntimeError(f"{died} (limited to {memory / 1e9:.1f} GB): {said[-1] if said else 'no output'}")
        document: dict[str, Any] = json.loads(answer.read_text())
    return document


def _limited(memory_bytes: int) -> list[str]:
    """Words before a command that limit its memory, unless a lower one is set: MJX takes over 24 GB for 55 collider meshes."""
    return ["sh", "-c", f'ulimit -d {memory_bytes // 1024} 2>/dev/null; exec "$0" "$@"']


def _said(error: Exception) -> str:
    try:
        return f"{type(error).__name__}: {error}"
    except UnicodeDecodeError:  # USD quotes the rejected file, including undecodable bytes
        return type(error).__name__


def _one_line(text: str) -> str:
    return " ".join(text.split())[:400]
