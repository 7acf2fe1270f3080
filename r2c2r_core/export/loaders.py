"""Every loader a reader of the bundle may use: does it load, and does it hold the same joints, limits, masses and colliders?

Each loader answers with the same `Readback`, compared with what scene.urdf says. One that is not installed is `not tried`.
"""

import importlib.util
import json
import logging
import os
import signal
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from r2c2r_core.export.plan import WORLD
from r2c2r_core.export.reading import Urdf
from r2c2r_core.model.report import LoaderResult
from r2c2r_core.progress import SILENT, Progress

EVERY_LOADER = ("yourdfpy", "MuJoCo (URDF)", "MuJoCo (MJCF)", "PyBullet", "SAPIEN", "USD")
SAPIEN_VARIABLE = "R2C2R_SAPIEN_PYTHON"

_PROBES = Path(__file__).parent / "probes"
_SECONDS = 180


@dataclass(frozen=True, slots=True, kw_only=True)
class Readback:
    """What a loader holds after loading."""

    version: str
    joints: dict[str, tuple[str, float, float]]  # moving joints: type, lower, upper
    masses: dict[str, float]  # kg by link
    colliders: dict[str, int] | None  # by link, links with colliders only; None where the loader does not say
    problem: str = ""


class _NotThereError(Exception):
    """The loader is not installed; the message says how to get it."""


def try_loaders(
    folder: Path, urdf: Urdf, sapien_python: str | None = None, *, progress: Progress = SILENT
) -> tuple[LoaderResult, ...]:
    """One verdict a loader."""
    expected = expected_readback(urdf)
    scene = folder / "scene.urdf"
    python = sapien_python or os.environ.get(SAPIEN_VARIABLE)
    attempts: tuple[tuple[str, Callable[[], Readback]], ...] = (
        ("yourdfpy", lambda: _yourdfpy(scene)),
        ("MuJoCo (URDF)", lambda: _mujoco(scene)),
        ("MuJoCo (MJCF)", lambda: _mujoco(folder / "scene.xml")),
        ("PyBullet", lambda: _pybullet(scene)),
        ("SAPIEN", lambda: _sapien(scene, python)),
        ("USD", lambda: _usd(folder / "scene.usda")),
    )
    return tuple(_verdict(name, attempt, expected) for name, attempt in progress.each(attempts, "loaders"))


def expected_readback(urdf: Urdf) -> Readback:
    """What scene.urdf says a loader must hold."""
    return Readback(
        version="",
        joints={
            j.name: (j.type, (j.limit or {}).get("lower", 0.0), (j.limit or {}).get("upper", 0.0))
            for j in urdf.joints
            if j.type in ("revolute", "prismatic")
        },
        masses={x.name: x.inertial.mass_kg for x in urdf.links if x.inertial is not None and x.name != WORLD},
        colliders={x.name: n for x in urdf.links if (n := sum(shape.kind == "collision" for shape in x.shapes))},
    )


def differences(expected: Readback, found: Readback) -> list[str]:
    """What a loader holds otherwise than scene.urdf, a phrase each."""
    lines = [found.problem] if found.problem else []
    lines += _set_differences("joint", set(expected.joints), set(found.joints))
    for name in sorted(set(expected.joints) & set(found.joints)):
        kind, lower, upper = expected.joints[name]
        kind_found, lower_found, upper_found = found.joints[name]
        if kind != kind_found:
            lines.append(f"{name} is {kind_found}, not {kind}")
        elif max(abs(lower - lower_found), abs(upper - upper_found)) > 1e-4:
            lines.append(f"{name} has limits {lower_found:.4g} .. {upper_found:.4g}, not {lower:.4g} .. {upper:.4g}")
    lines += _set_differences("link", set(expected.masses), set(found.masses))
    for name in sorted(set(expected.masses) & set(found.masses)):
        if abs(expected.masses[name] - found.masses[name]) > 1e-4 * max(abs(expected.masses[name]), 0.01):
            lines.append(f"{name} weighs {found.masses[name]:.4g} kg, not {expected.masses[name]:.4g}")
    if found.colliders is not None and expected.colliders is not None:
        for name, count in sorted(expected.colliders.items()):
            if found.colliders.get(name, 0) < count:
                lines.append(f"{name} has {found.colliders.get(name, 0)} of {count} colliders")
    return lines


def _verdict(name: str, attempt: Callable[[], Readback], expected: Readback) -> LoaderResult:
    try:
        found = attempt()
    except _NotThereError as error:
        return LoaderResult(loader=name, state="not tried", detail=str(error))
    except Exception as error:  # a loader may raise anything on a bundle it dislikes: that is its verdict
        return LoaderResult(loader=name, state="failed", detail=_one_line(f"{type(error).__name__}: {error}"))
    lines = differences(expected, found)
    if lines:
        more = f" (and {len(lines) - 3} more)" if len(lines) > 3 else ""
        return LoaderResult(loader=name, state="failed", detail=_one_line(f"{found.version}: {'; '.join(lines[:3])}{more}"))
    total = sum(found.masses.values())
    agreed = f"{found.version}: {len(found.joints)} joints, {len(found.masses)} links, {total:.2f} kg read back and equal"
    return LoaderResult(loader=name, state="passed", detail=agreed)


def _yourdfpy(scene: Path) -> Readback:
    if importlib.util.find_spec("yourdfpy") is None:
        raise _NotThereError("not installed: pip install yourdfpy")
    from importlib.metadata import version

    import yourdfpy

    logger = logging.getLogger("yourdfpy.urdf")
    level = logger.level
    try:
        logger.setLevel(logging.CRITICAL)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            robot = yourdfpy.URDF.load(str(scene), load_meshes=True, build_scene_graph=True)
            valid = robot.validate()
            robot.update_cfg(robot.zero_cfg)
    finally:
        logger.setLevel(level)
    problem = "" if valid else f"validate() says {[str(e) for e in robot.errors][:2]}"
    visuals = sum(len(link.visuals) for link in robot.robot.links)
    if len(robot.scene.geometry) < visuals:
        problem = f"{len(robot.scene.geometry)} of {visuals} visuals loaded"
    moving = [j for j in robot.robot.joints if j.type in ("revolute", "prismatic")]
    return Readback(
        version=f"yourdfpy {version('yourdfpy')}",
        joints={j.name: (j.type, float(j.limit.lower), float(j.limit.upper)) for j in moving},
        masses={x.name: float(x.inertial.mass) for x in robot.robot.links if x.inertial is not None and x.name != WORLD},
        colliders={x.name: len(x.collisions) for x in robot.robot.links if x.collisions},
        problem=problem,
    )


def _mujoco(scene: Path) -> Readback:
    if importlib.util.find_spec("mujoco") is None:
        raise _NotThereError("not installed: pip install mujoco")
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(scene))
    kinds = {2: "prismatic", 3: "revolute"}
    joints = {}
    for j in range(model.njnt):
        if int(model.jnt_type[j]) in kinds:
            low, high = (float(v) for v in model.jnt_range[j])
            joints[model.joint(j).name] = (kinds[int(model.jnt_type[j])], low, high)
    colliders: dict[str, int] = {}
    for g in range(model.ngeom):
        if model.geom_contype[g] or model.geom_conaffinity[g]:
            body = model.body(int(model.geom_bodyid[g])).name
            colliders[body] = colliders.get(body, 0) + 1
    return Readback(
        version=f"MuJoCo {mujoco.__version__}",
        joints=joints,
        masses={model.body(b).name: float(model.body_mass[b]) for b in range(1, model.nbody)},
        colliders=colliders,
    )


def _pybullet(scene: Path) -> Readback:
    if importlib.util.find_spec("pybullet") is None:
        raise _NotThereError("not installed: pip install 'r2c2r[bullet]'")
    return _probe([sys.executable, str(_PROBES / "bullet.py")], scene)


def _sapien(scene: Path, python: str | None) -> Readback:
    if not python:
        raise _NotThereError(f"no environment of its own given: set {SAPIEN_VARIABLE} to its python")
    if not Path(python).is_file():
        raise _NotThereError(f"{SAPIEN_VARIABLE} names {python}, which is not there")
    present = subprocess.run([python, "-c", "import sapien"], capture_output=True, timeout=_SECONDS, check=False)
    if present.returncode != 0:
        raise _NotThereError(f"{python} cannot import sapien")
    return _probe([python, str(_PROBES / "sapien_probe.py")], scene)


def _usd(scene: Path) -> Readback:
    if importlib.util.find_spec("pxr") is None:
        raise _NotThereError("not installed: pip install usd-core")
    if not scene.is_file():
        raise FileNotFoundError(f"{scene.name} is not in the bundle")
    from r2c2r_core.export.probes.usd import read_usd

    return Readback(**read_usd(scene)._asdict())


def _probe(command: list[str], scene: Path) -> Readback:
    """Run a loader in a process of its own: it may crash, print and change the process as it likes."""
    with tempfile.TemporaryDirectory() as scratch:
        answer = Path(scratch) / "answer.json"
        run = subprocess.run([*command, str(scene.resolve()), str(answer)], capture_output=True, timeout=_SECONDS, check=False)
        if run.returncode != 0 or not answer.is_file():
            words = run.stderr.decode(errors="replace").strip().splitlines()
            died = f"died of {signal.Signals(-run.returncode).name}" if run.returncode < 0 else "gave up"
            raise RuntimeError(f"{died}: {words[-1] if words else 'without a word'}")
        document = json.loads(answer.read_text())
    return Readback(
        version=document["version"],
        joints={name: (kind, lower, upper) for name, (kind, lower, upper) in document["joints"].items()},
        masses=document["masses"],
        colliders=document["colliders"],
    )


def _set_differences(what: str, expected: set[str], found: set[str]) -> list[str]:
    lines = [f"{what} {name} is missing" for name in sorted(expected - found)]
    return lines + [f"{what} {name} is not in scene.urdf" for name in sorted(found - expected)]


def _one_line(text: str) -> str:
    return " ".join(text.split())[:400]
