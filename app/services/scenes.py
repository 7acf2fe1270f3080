"""The finished scene as a table."""

import json
import zipfile
from functools import lru_cache
from pathlib import Path
from typing import Any

from sqlmodel import select

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.db.tables import SceneObject
from app.errors import NotReady
from app.files import ProjectFiles
from app.jobs.plain import plain
from app.services.context import Context
from r2c2r_core.workspace import Workspace


def summary(context: Context, project_id: str) -> schemas.SceneSummary:
    """Objects with their dimensions, joints, residuals and warnings."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        files = context.files(project)
        mine = select(SceneObject).where(SceneObject.project_id == project_id)
        ids = {item.name: item.id for item in session.exec(mine) if not item.deleted}
        bundle = queries.newest_bundle(session, project_id)
    scene = fitted(files)
    if scene is None:
        raise NotReady("there is no finished scene yet", hint="run the project first")
    described = manifest(files.bundles / bundle.path) if bundle else {}
    failures = described.get("failures") if isinstance(described.get("failures"), dict) else {}
    return schemas.SceneSummary(
        items=[_item(entry, ids.get(entry["name"]), files) for entry in scene["objects"]],
        failures={str(name): str(line) for name, line in (failures or {}).items()},
        warnings=scene["warnings"],
        stages=[_stage(entry) for entry in described.get("stages", [])],
        glb=f"/media/{project_id}/scene.glb?v={bundle.version}" if bundle else None,
        preview=f"/media/{project_id}/preview.png?v={bundle.version}" if bundle else None,
    )


def fitted(files: ProjectFiles) -> dict[str, Any] | None:
    """The scene after the fit (or before it, when there was no fit) as JSON, without its meshes."""
    for stage in ("warp", "synthesize"):
        path = files.work / "nouns" / stage / "scene.noun"
        if path.is_file():
            return _scene_at(path, path.stat().st_mtime_ns, files.work, stage)
    return None


@lru_cache(maxsize=16)
def _scene_at(path: Path, _changed: int, work: Path, stage: str) -> dict[str, Any] | None:
    scene = Workspace(work).load_latest(stage, "scene")
    if scene is None:
        return None
    kept = (
        "name",
        "category",
        "fixture",
        "dimensions_m",
        "dimension_sources",
        "movable",
        "warp_residual_m",
        "warnings",
        "joints",
    )
    objects = [{key: plain(getattr(item, key)) for key in kept} for item in scene.objects]
    return {"objects": objects, "warnings": plain(scene.warnings)}


@lru_cache(maxsize=256)
def _noun_facts(path: Path, _changed: int, work: Path, stage: str, name: str) -> Any:
    noun = Workspace(work).load_latest(stage, name)
    if noun is None:
        return None
    return len(noun.masks) if stage == "segment" else plain(float(noun.rms_m))


def _facts(files: ProjectFiles, stage: str, name: str) -> Any:
    path = files.work / "nouns" / stage / f"{name}.noun"
    return _noun_facts(path, path.stat().st_mtime_ns, files.work, stage, name) if path.is_file() else None


def _item(entry: dict[str, Any], number: int | None, files: ProjectFiles) -> schemas.SceneItem:
    return schemas.SceneItem(
        object=number,
        name=entry["name"],
        category=entry["category"],
        fixture=entry["fixture"],
        dimensions_m=entry["dimensions_m"],
        dimension_sources=entry["dimension_sources"],
        joints=[_joint(joint) for joint in entry["joints"]],
        movable=entry["movable"],
        mask_frames=_facts(files, "segment", entry["name"]) or 0,
        placement_rms_m=_facts(files, "align", entry["name"]),
        warp_residual_m=entry["warp_residual_m"],
        warnings=entry["warnings"],
    )


def _joint(joint: dict[str, Any]) -> schemas.SceneJoint:
    return schemas.SceneJoint(
        name=joint["name"],
        type=joint["type"],
        axis=joint["axis_object"],
        origin=joint["origin_object"],
        lower=joint["lower"],
        upper=joint["upper"],
        sources=joint["sources"],
    )


def _stage(entry: dict[str, Any]) -> schemas.StageInfo:
    return schemas.StageInfo(
        name=str(entry["name"]), backend=str(entry.get("backend", "")), seconds=float(entry.get("seconds", 0.0))
    )


def manifest(bundle: Path) -> dict[str, Any]:
    """A bundle's manifest; empty when it has none."""
    try:
        return _manifest_at(bundle, bundle.stat().st_mtime_ns)
    except FileNotFoundError:
        return {}


@lru_cache(maxsize=32)
def _manifest_at(bundle: Path, _changed: int) -> dict[str, Any]:
    try:
        with zipfile.ZipFile(bundle) as archive:
            name = min((n for n in archive.namelist() if n.rsplit("/", 1)[-1] == "manifest.json"), key=len)
            found: dict[str, Any] = json.loads(archive.read(name))
            return found
    except (zipfile.BadZipFile, ValueError):
        return {}
