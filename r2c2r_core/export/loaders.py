"""Every loader a reader of the bundle may use: does it load, and does it hold what scene.urdf says?

Each loader's probe answers with the same document, compared value by value (`readback.py`). One that is not installed is
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
from pathlib import Path
from typing import Any

from r2c2r_core.export.readback import Readback, differences, expected_readback, readback_of
from r2c2r_core.export.reading import Urdf
from r2c2r_core.model.report import LoaderResult
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.threads import in_threads

EVERY_LOADER = ("yourdfpy", "MuJoCo (URDF)", "MuJoCo (MJCF)", "PyBullet", "SAPIEN", "USD")
SAPIEN_VARIABLE = "R2C2R_SAPIEN_PYTHON"

_PROBES = Path(__file__).parent / "probes"
_SECONDS = 180


class _NotThereError(Exception):
    """The loader is not installed; the message says how to get it."""


def try_loaders(
    folder: Path, urdf: Urdf, sapien_python: str | None = None, *, progress: Progress = SILENT
) -> tuple[LoaderResult, ...]:
    """One verdict a loader."""
    expected = expected_readback(urdf)
    scene = folder / "scene.urdf"
    python = sapien_python or os.environ.get(SAPIEN_VARIABLE)
    attempts: tuple[tuple[str, Callable[[], dict[str, Any]]], ...] = (
        ("yourdfpy", lambda: _yourdfpy(scene)),
        ("MuJoCo (URDF)", lambda: _mujoco(scene)),
        ("MuJoCo (MJCF)", lambda: _mujoco(folder / "scene.xml")),
        ("PyBullet", lambda: _pybullet(scene)),
        ("SAPIEN", lambda: _sapien(scene, python)),
        ("USD", lambda: _usd(folder / "scene.usda")),
    )

    def verdict(loader: tuple[str, Callable[[], dict[str, Any]]]) -> LoaderResult:
        return _verdict(*loader, expected)

    return tuple(progress.each(in_threads(verdict, attempts), "loaders", count=len(attempts)))


def _verdict(name: str, attempt: Callable[[], dict[str, Any]], expected: Readback) -> LoaderResult:
    try:
        found = readback_of(attempt())
    except _NotThereError as error:
        return LoaderResult(loader=name, state="not tried", detail=str(error))
    except Exception as error:  # a loader may raise anything on a bundle it dislikes: that is its verdict
        return LoaderResult(loader=name, state="failed", detail=_one_line(_said(error)))
    lines = differences(expected, found)
    if lines:
        more = f" (and {len(lines) - 3} more)" if len(lines) > 3 else ""
        return LoaderResult(loader=name, state="failed", detail=_one_line(f"{found.version}: {'; '.join(lines[:3])}{more}"))
    return LoaderResult(loader=name, state="passed", detail=_agreed(found))


def _agreed(found: Readback) -> str:
    """What was compared, and what this loader has no place for."""
    total = sum(body.mass_kg for body in found.bodies.values())
    held = f"{found.version}: {len(found.joints)} joints, {len(found.bodies)} links, {total:.2f} kg read back and equal"
    lost = found.not_kept
    words = " or ".join(filter(None, (", ".join(lost[:-1]), *lost[-1:])))
    return f"{held}; it keeps no joint {words}" if lost else held


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


def _sapien(scene: Path, python: str | None) -> dict[str, Any]:
    if not python:
        raise _NotThereError(f"no environment of its own given: set {SAPIEN_VARIABLE} to its python")
    if not Path(python).is_file():
        raise _NotThereError(f"{SAPIEN_VARIABLE} names {python}, which is not there")
    present = subprocess.run([python, "-c", "import sapien"], capture_output=True, timeout=_SECONDS, check=False)
    if present.returncode != 0:
        raise _NotThereError(f"{python} cannot import sapien")
    return _probe([python, str(_PROBES / "sapien_probe.py")], scene)


def _usd(scene: Path) -> dict[str, Any]:
    if importlib.util.find_spec("pxr") is None:
        raise _NotThereError("not installed: pip install usd-core")
    if not scene.is_file():
        raise FileNotFoundError(f"{scene.name} is not in the bundle")
    # Not in this process: its libraries ask for the GIL while they are loaded, and another thread that loads one holds it.
    return _probe([sys.executable, str(_PROBES / "usd.py")], scene)


def _probe(command: list[str], scene: Path) -> dict[str, Any]:
    """Run a loader in a process and a folder of its own: it may crash, print, and write logs where it stands."""
    with tempfile.TemporaryDirectory() as scratch:
        answer = Path(scratch) / "answer.json"
        words = [*command, str(scene.resolve()), str(answer)]
        run = subprocess.run(words, capture_output=True, timeout=_SECONDS, check=False, cwd=scratch)
        if run.returncode != 0 or not answer.is_file():
            said = run.stderr.decode(errors="replace").strip().splitlines()
            died = f"died of {signal.Signals(-run.returncode).name}" if run.returncode < 0 else "gave up"
            raise RuntimeError(f"{died}: {said[-1] if said else 'without a word'}")
        document: dict[str, Any] = json.loads(answer.read_text())
    return document


def _said(error: Exception) -> str:
    try:
        return f"{type(error).__name__}: {error}"
    except UnicodeDecodeError:  # USD quotes the file it dislikes, whatever its bytes
        return type(error).__name__


def _one_line(text: str) -> str:
    return " ".join(text.split())[:400]
