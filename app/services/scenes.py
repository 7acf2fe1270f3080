"""The finished scene as a table."""

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sqlmodel import select

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.db.tables import SceneObject
from app.errors import NotReady
from app.file_cache import FileCache
from app.files import ProjectFiles
from app.jobs.plain import plain
from app.services import views
from app.services.candidates import changed_since, override_shape
from app.services.context import Context
from r2c2r_core.model.scene import ArticulatedScene, Link
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.workspace import Workspace

_MOST_MANIFEST = 1 << 20  # approximate bytes; the bundle's size does not matter
_MANIFESTS: FileCache[dict[str, Any]] = FileCache(32 << 20)


def summary(context: Context, project_id: str) -> schemas.SceneSummary:
    """Objects with their dimensions, joints, residuals and warnings."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        files = context.files(project)
        mine = select(SceneObject).where(SceneObject.project_id == project_id)
        mine_by_name = {item.result_name: item for item in session.exec(mine) if not item.deleted}
        bundle = queries.newest_bundle(session, project_id)
        said = queries.overrides_by_object(session, project_id)
    scene = fitted(files)
    if scene is None:
        raise NotReady("there is no finished scene yet", hint="run the project first")
    taken = Workspace(files.work).seconds()
    described = manifest(files.bundles / bundle.path) if bundle else {}
    failures = described.get("failures") if isinstance(described.get("failures"), dict) else {}
    corrected = [(item, entry) for item in mine_by_name.values() if (entry := _said(item, said))]
    there = {entry["name"] for entry in scene["objects"]}
    return schemas.SceneSummary(
        items=[_item(entry, item := mine_by_name.get(entry["name"]), files, _said(item, said)) for entry in scene["objects"]],
        left_out=[_left_out(item) for item, entry in corrected if entry.get("left_out")],
        unused=[
            _left_out(item)
            for item, entry in corrected
            if not entry.get("left_out") and not item.masks_key and item.result_name not in there
        ],
        failures={str(name): str(line) for name, line in (failures or {}).items()},
        warnings=scene["warnings"],
        stages=[_stage(entry, taken) for entry in described.get("stages", [])],
        glb=f"/media/{project_id}/scene.glb?v={bundle.version}" if bundle else None,
        preview=f"/media/{project_id}/preview.png?v={bundle.version}" if bundle else None,
    )


def fitted(files: ProjectFiles) -> dict[str, Any] | None:
    """The warped scene (or the unwarped one, if there was no warp) as JSON, without its meshes."""
    work = Workspace(files.work)
    for stage in ("warp", "synthesize"):
        if work.noun_path(stage, "scene").is_file():
            return views.facts(files, stage, "scene", _scene_facts)
    return None


def _scene_facts(scene: ArticulatedScene) -> dict[str, Any]:
    kept = (
        "name",
        "category",
        "fixture",
        "dimensions_m",
        "dimension_sources",
        "movable",
        "carried_by",
        "warp_residual_m",
        "warnings",
        "joints",
    )
    objects = [{key: plain(getattr(item, key)) for key in kept} for item in scene.objects]
    for told, item in zip(objects, scene.objects, strict=True):
        told["colour"] = list(item.links[0].colour)
        leaves = {link.name: link for link in item.links}
        for joint in told["joints"]:
            joint["handle"] = _handle_seen(leaves[joint["child"]])
    return {"objects": objects, "warnings": plain(scene.warnings), "scale": scene.scale}


def _handle_seen(leaf: Link) -> list[float] | None:
    """Centre of a leaf's handle in the object frame; None without one, or for one that was made up."""
    seen = [box for box in leaf.of_role("handle") if box.sources.get("place", "default") != "default"]
    return [float(x) for x in leaf.object_from_link.apply(seen[0].link_from_box.translation)] if seen else None


def _mask_count(track: MaskTrack) -> int:
    return len(track.masks)


def _left_out(item: SceneObject) -> schemas.LeftOut:
    return schemas.LeftOut(object=item.id or 0, name=item.name)


def _said(item: SceneObject | None, said: Mapping[int, dict[str, Any]]) -> dict[str, Any]:
    return said.get(item.id or 0, {}) if item is not None else {}


def _item(entry: dict[str, Any], item: SceneObject | None, files: ProjectFiles, override: dict[str, Any]) -> schemas.SceneItem:
    placement = views.facts(files, "align", entry["name"], plain)
    return schemas.SceneItem(
        object=item.id if item else None,
        name=item.name if item else entry["name"],
        run_name=entry["name"],
        category=entry["category"],
        fixture=entry["fixture"],
        dimensions_m=entry["dimensions_m"],
        dimension_sources=entry["dimension_sources"],
        joints=[_joint(joint) for joint in entry["joints"]],
        movable=entry["movable"],
        carried_by=entry["carried_by"],
        mask_frames=views.facts(files, "segment", entry["name"], _mask_count) or 0,
        placement_rms_m=placement["rms_m"] if placement else None,
        warp_residual_m=entry["warp_residual_m"],
        warnings=entry["warnings"],
        colour=entry["colour"],
        override=override_shape(override),
        changed=item is not None and changed_since(files, item),
    )


def sources_of(joint: dict[str, Any]) -> dict[str, str]:
    """Sources of a joint's numbers; the closed end has one only where a person moved it (older results say: default)."""
    return {key: source for key, source in joint["sources"].items() if (key, source) != ("lower", "default")}


def _joint(joint: dict[str, Any]) -> schemas.SceneJoint:
    return schemas.SceneJoint(
        name=joint["name"],
        type=joint["type"],
        axis=joint["axis_object"],
        origin=joint["origin_object"],
        lower=joint["lower"],
        upper=joint["upper"],
        sources=sources_of(joint),
        handle=joint["handle"],
    )


def _stage(entry: dict[str, Any], taken: Mapping[str, float]) -> schemas.StageInfo:
    name = str(entry["name"])
    return schemas.StageInfo(name=name, backend=str(entry.get("backend", "")), seconds=taken.get(name))


def manifest(bundle: Path) -> dict[str, Any]:
    """A bundle's manifest; empty when it has none."""
    return _MANIFESTS.get(bundle, lambda: _read_manifest(bundle), lambda _, size: min(size, _MOST_MANIFEST)) or {}


def _read_manifest(bundle: Path) -> dict[str, Any]:
    try:
        with zipfile.ZipFile(bundle) as archive:
            name = min((n for n in archive.namelist() if n.rsplit("/", 1)[-1] == "manifest.json"), key=len)
            found: dict[str, Any] = json.loads(archive.read(name))
            return found
    except (zipfile.BadZipFile, ValueError):
        return {}
