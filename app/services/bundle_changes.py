"""Readable differences between two bundles, from their manifests."""

import math
from typing import Any

from app import schemas

Manifest = dict[str, Any]


def changes(older: Manifest, newer: Manifest) -> list[schemas.BundleChange]:
    """Added, removed and changed objects, in the newer bundle's order."""
    before, after = _by_name(older), _by_name(newer)
    found = [schemas.BundleChange(object=name, text="taken out") for name in before if name not in after]
    for name, entry in after.items():
        if name not in before:
            found.append(schemas.BundleChange(object=name, text=f"new: {entry.get('category', 'object')}"))
        else:
            found += [schemas.BundleChange(object=name, text=text) for text in _differences(before[name], entry)]
    old_tool, new_tool = older.get("tool_version"), newer.get("tool_version")
    if old_tool != new_tool:
        found.append(schemas.BundleChange(object="", text=f"made by version {new_tool} instead of {old_tool}"))
    return found


def _differences(before: dict[str, Any], after: dict[str, Any]) -> list[str]:
    said = []
    if before.get("category") != after.get("category"):
        said.append(f"category {before.get('category')} → {after.get('category')}")
    old, new = ((entry.get("chosen") or {}).get("candidate") for entry in (before, after))
    if old != new:
        said.append(f"candidate {old} → {new}")
    if not _close(before.get("dimensions_m"), after.get("dimensions_m"), 5e-4):
        said.append(f"size {_centimetres(before)} → {_centimetres(after)} cm")
    moved = _moved(before.get("world_from_object"), after.get("world_from_object"))
    if moved > 5e-4:
        said.append(f"moved by {1000 * moved:.0f} mm")
    return said + _joint_differences(before.get("joints") or [], after.get("joints") or [])


def _joint_differences(before: list[dict[str, Any]], after: list[dict[str, Any]]) -> list[str]:
    old, new = ({joint["name"]: joint for joint in joints} for joints in (before, after))
    said = [f"joint {name} is gone" for name in old.keys() - new.keys()] + [
        f"new joint {name}" for name in new.keys() - old.keys()
    ]
    for name in sorted(old.keys() & new.keys()):
        if old[name]["type"] != new[name]["type"]:
            said.append(f"{name}: {old[name]['type']} → {new[name]['type']}")
        elif abs(old[name]["upper"] - new[name]["upper"]) > 1e-3:
            said.append(f"{name} opens {_travel(old[name])} → {_travel(new[name])}")
        if not _close(old[name]["axis"], new[name]["axis"], 1e-2):
            said.append(f"{name}: another axis")
        elif not _close(old[name]["origin"], new[name]["origin"], 1e-3):
            said.append(f"{name}: hinge moved")
    return said


def _by_name(manifest: Manifest) -> dict[str, dict[str, Any]]:
    return {entry["name"]: entry for entry in manifest.get("objects", [])}


def _close(a: list[float] | None, b: list[float] | None, tolerance: float) -> bool:
    return a == b or (a is not None and b is not None and all(abs(x - y) <= tolerance for x, y in zip(a, b, strict=True)))


def _moved(before: list[list[float]] | None, after: list[list[float]] | None) -> float:
    if not before or not after:
        return 0.0
    return math.dist([row[3] for row in before[:3]], [row[3] for row in after[:3]])


def _centimetres(entry: dict[str, Any]) -> str:
    return " × ".join(f"{100 * side:.1f}" for side in entry.get("dimensions_m", []))


def _travel(joint: dict[str, Any]) -> str:
    return f"{math.degrees(joint['upper']):.0f}°" if joint["type"] == "revolute" else f"{100 * joint['upper']:.0f} cm"
