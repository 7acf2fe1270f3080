"""manifest.json: the provenance of every number of the bundle (schema 1)."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from typing import Any, get_args

import numpy as np

from r2c2r_core.export import randomize
from r2c2r_core.export.labels import Labels, labels_of, labels_of_handle
from r2c2r_core.export.plan import WORLD, Body, Plan
from r2c2r_core.export.randomize import Range
from r2c2r_core.export.scan_fit import ScanFit
from r2c2r_core.export.seen import Seen
from r2c2r_core.export.states import states_of
from r2c2r_core.model.handle import Handle
from r2c2r_core.model.mesh import CandidateSet
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.reconstruction import Reconstruction
from r2c2r_core.model.report import JointResult
from r2c2r_core.model.scene import GripPart, SceneObject
from r2c2r_core.model.track import MaskTrack

SCHEMA = 1


def manifest_of(
    reconstruction: Reconstruction,
    plan: Plan,
    created: str | None,
    fits: Mapping[str, ScanFit] | None = None,
    seen: Mapping[str, Seen] | None = None,
) -> dict[str, Any]:
    """The manifest as a JSON document; `created` is an ISO 8601 time, or None if not given."""
    capture = reconstruction.capture
    return {
        "schema": SCHEMA,
        "tool_version": tool_version(),
        "created": created,
        "capture": {
            "name": capture.name,
            "sha256": capture.sha256,
            "format": capture.format,
            "frames": len(capture.frames),
        },
        "world_from_capture": _plain(capture.world_from_capture.matrix),
        "objects": [
            _object_entry(reconstruction, plan, item, (fits or {}).get(item.name), (seen or {}).get(item.name))
            for item in reconstruction.scene.objects
        ],
        "states": {
            name: {body.joint_name: _plain(state.position(body)) for body in plan.bodies if body.joint is not None}
            for name, state in states_of(plan).items()
        },
        "contradictions": [
            {"rule": found.rule, "objects": list(found.objects), "message": found.message, "mend": found.mend}
            for found in reconstruction.contradictions
        ],
        "stages": [{"name": run.name, "backend": run.backend, "config": _plain(run.config)} for run in reconstruction.stages],
    }


def with_blockers(manifest: dict[str, Any], plan: Plan, joints: tuple[JointResult, ...]) -> dict[str, Any]:
    """The manifest with the obstacles that the sweeps found for each joint; free objects by name."""
    owners = {body.name: body.object_name for body in plan.bodies}
    found = {
        result.joint: [
            {"name": owners.get(b.name, b.name), "kind": b.kind, "position": _plain(b.position)} for b in result.blocked_by
        ]
        for result in joints
    }

    def entry(item: dict[str, Any]) -> dict[str, Any]:
        listed = [joint | {"blocked_by": found.get(joint["name"], [])} for joint in item["joints"]]
        return item | {"joints": listed, "joint": listed[0] if listed else None}

    return manifest | {"objects": [entry(item) for item in manifest["objects"]]}


def tool_version() -> str:
    """The installed version of r2c2r, or "unknown" when it runs without being installed."""
    try:
        return version("r2c2r")
    except PackageNotFoundError:
        return "unknown"


def _object_entry(
    reconstruction: Reconstruction, plan: Plan, item: SceneObject, fit: ScanFit | None, seen: Seen | None
) -> dict[str, Any]:
    bodies = plan.of(item.name)
    mass_kg = float(sum(body.link.inertial.mass_kg for body in bodies))
    joints = [_joint_entry(item, body, plan) for body in bodies if body.joint is not None]
    track = next((t for t in reconstruction.tracks if t.name == item.name), None)
    candidates = next((c for c in reconstruction.candidates if c.object_name == item.name), None)
    placement = next((p for p in reconstruction.placements if p.object_name == item.name), None)
    return {
        "name": item.name,
        "category": item.category,
        "fixture": item.fixture,
        "dimensions_m": _plain(item.dimensions_m),
        "world_from_object": _plain((bodies[0].world_from_body @ bodies[0].link.object_from_link.inverse).matrix),
        "joint": joints[0] if joints else None,
        "joints": joints,  # a double door has two
        "labels": {body.name: _labels_entry(labels_of(body)) for body in bodies},
        "movable": item.movable,
        "carried_by": None if bodies[0].parent == WORLD else bodies[0].parent,
        "dimension_source": list(item.dimension_sources),
        "inside_source": dict(item.inside_sources),
        "layout_move_m": _plain(reconstruction.scene.layout_moves_m.get(item.name)),
        "mask": None if track is None else _mask_entry(reconstruction, track),
        "candidates": [] if candidates is None else _candidate_entries(candidates),
        "chosen": None if candidates is None else {"candidate": candidates.chosen_id, "by": candidates.chosen_by, "at": None},
        "placement": None if placement is None else _placement_entry(placement),
        "warp": {"residual_m": _plain(item.warp_residual_m), "paper_residual_m": _plain(item.warp_residual_paper_m)},
        "scan_fit": None if fit is None else _plain(asdict(fit)),
        "seen": None if seen is None else _plain({"share": seen.share, "sides": seen.sides, "unseen": list(seen.unseen)}),
        "meshes": {
            "visual": [body.visual_file for body in bodies if body.visual_file is not None],
            "collision": [name for body in bodies for name in body.collision_files],
        },
        "mass_kg": _plain(mass_kg),
        "randomize": _ranges_entry(randomize.of_object(item, mass_kg, placement)),
        "warnings": [*_warnings(item, track, placement, candidates), *plan.notes(item.name)],
    }


def _joint_entry(item: SceneObject, body: Body, plan: Plan) -> dict[str, Any]:
    joint = body.joint
    assert joint is not None
    return {
        "name": body.joint_name,
        "type": joint.type,
        "axis": _plain(item.world_from_object.turn(joint.axis_object)),
        "origin": _plain(item.world_from_object.apply(joint.origin_object)),
        "lower": _plain(joint.lower),
        "upper": _plain(joint.upper),
        "uncut": _plain(joint.uncut),
        "source": {"axis": "default", "origin": "default", "lower": None, "limits": "default"} | joint.sources,
        "confidence": _plain(joint.confidence),
        "motion": None if joint.motion is None else _motion_entry(joint.motion),
        "randomize": _ranges_entry(randomize.of_joint(joint)),
        "handles": [_handle_entry(handle, labels_of_handle(handle, body)) for handle in plan.handles_of(body.name)],
    }


def _ranges_entry(ranges: Mapping[str, Range | list[Range]]) -> dict[str, Any]:
    return {
        name: [_plain(asdict(one)) for one in found] if isinstance(found, list) else _plain(asdict(found))
        for name, found in ranges.items()
    }


def _labels_entry(labels: Labels) -> dict[str, Any]:
    return {"category": labels.category, "part": labels.part, "disposition": list(labels.disposition)}


def _handle_entry(handle: Handle, labels: Labels) -> dict[str, Any]:
    pose = handle.world_from_handle
    return {
        "name": handle.name,
        "kind": handle.kind,
        "link": handle.link,
        "labels": _labels_entry(labels),
        "centre": _plain(pose.translation),
        "axis": _plain(pose.rotation[:, 0]),
        "closing": _plain(pose.rotation[:, 1]),
        "approach": _plain(pose.rotation[:, 2]),
        "opening": _plain(handle.opening_world),
        "size_m": _plain(handle.size_m),
        "protrusion_m": _plain(handle.protrusion_m),
        "gap_m": _plain(handle.gap_m),
        "room": _plain(asdict(handle.room)),
        "source": {key: handle.sources.get(key, "default") for key in get_args(GripPart)},
        "confidence": _plain(handle.confidence),
    }


def _motion_entry(motion: JointMotion) -> dict[str, Any]:
    return {
        "source": motion.source,
        "covariance": _plain(motion.covariance),
        "largest": _plain(motion.largest),
        "states": [
            {"frame": frame, "value": _plain(state.value), "sigma": _plain(state.sigma)}
            for frame, state in sorted(motion.states.items())
        ],
        "inside": None if motion.inside is None else _plain(asdict(motion.inside)),
    }


def _mask_entry(reconstruction: Reconstruction, track: MaskTrack) -> dict[str, Any]:
    areas = [mask.area_px for mask in track.masks.values()]
    return {
        "frames": len(areas),
        "mean_area_px": round(float(np.mean(areas)), 1) if areas else 0.0,
        "prompts": [
            {"frame": point.frame, "x": point.x, "y": point.y, "label": point.label}
            for prompt in reconstruction.prompts.objects
            if prompt.name == track.name
            for point in prompt.points
        ],
    }


def _candidate_entries(candidates: CandidateSet) -> list[dict[str, Any]]:
    return [
        {
            "id": c.candidate_id,
            "generator": c.generator,
            "seed": c.seed,
            "assumes": c.assumes,
            "metrics": _plain(c.metrics),
        }
        for c in candidates.candidates
    ]


def _placement_entry(placement: Placement) -> dict[str, Any]:
    pose, spread = placement.world_from_mesh, placement.spread
    return {
        "scale": _plain(pose.scale),
        "rotation": _plain(pose.rotation),
        "translation": _plain(pose.translation),
        "inliers": placement.inliers,
        "rms_m": _plain(placement.rms_m),
        "mask_iou": _plain(placement.mask_iou),
        "unsure": placement.unsure,
        "runner_up_turn_deg": _plain(placement.runner_up_turn_deg),
        "spread": spread and {key: _plain(getattr(spread, key)) for key in ("turn_deg", "shift_m", "scale")},
    }


def _warnings(
    item: SceneObject, track: MaskTrack | None, placement: Placement | None, candidates: CandidateSet | None
) -> tuple[str, ...]:
    """Warnings of all stages about the object, without duplicates, in stage order."""
    chosen = candidates.chosen.warnings if candidates is not None else ()
    lines = [
        *(track.warnings if track else ()),
        *chosen,
        *(placement.warnings if placement else ()),
        *item.warnings,
    ]
    return tuple(dict.fromkeys(lines))


def _plain(value: Any) -> Any:
    """JSON values; numbers rounded to nine decimals, non-finite ones as null."""
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return round(value, 9) + 0.0 if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if value is None or isinstance(value, bool | int | str):
        return value
    return str(value)
