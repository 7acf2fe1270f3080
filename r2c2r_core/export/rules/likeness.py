"""Whether the scene can be what was filmed: contradictions the segmenter found, joints that an obstacle all but locks."""

from collections.abc import Iterator
from typing import Any

from r2c2r_core.documents import parse_json
from r2c2r_core.errors import BundleError
from r2c2r_core.export.handles import out_of_reach
from r2c2r_core.export.rules.files import BundleFiles
from r2c2r_core.export.rules.table import LIKENESS_RULES, finding
from r2c2r_core.model.handle import Room
from r2c2r_core.model.report import Finding

_LEAST_TRAVEL = 0.5  # of what its kind opens: less, and its unit or its neighbour is in the wrong place


def check_likeness(files: BundleFiles) -> Iterator[Finding]:
    """What manifest.json says against itself; one that cannot be read is named by check_agreement."""
    path = files.folder / "manifest.json"
    if not path.is_file():
        return
    try:
        manifest = parse_json(path.read_bytes(), "manifest.json", BundleError, hint="")
        present = {item["name"] for item in manifest["objects"]}
        yield from _contradictions(manifest.get("contradictions", []), present)
        yield from (found for item in manifest["objects"] for joint in item.get("joints", []) for found in _of_joint(joint))
    except (BundleError, KeyError, IndexError, TypeError, AttributeError):
        return


def _contradictions(entries: list[dict[str, Any]], present: set[str]) -> Iterator[Finding]:
    """Those among objects of the bundle: what was left out of it contradicts nothing there."""
    for entry in entries:
        if entry["rule"] in LIKENESS_RULES and present.issuperset(entry["objects"]):
            yield finding(entry["rule"], ", ".join(entry["objects"]), f"{entry['message']}; {entry['mend']}")


def _of_joint(joint: dict[str, Any]) -> Iterator[Finding]:
    yield from _cut_short(joint)
    for handle in joint.get("handles", []):
        room = handle["room"]
        free = Room(before_m=room["before_m"], beside_m=tuple(room["beside_m"]), depth_m=tuple(room["depth_m"]))
        reason = out_of_reach(handle["kind"], handle["size_m"][1], free)
        if reason is not None:
            yield finding("handle-reach", handle["name"], f"a gripper 9 cm wide cannot take it: {reason}")


def _cut_short(joint: dict[str, Any]) -> Iterator[Finding]:
    uncut = joint.get("uncut")
    if uncut is not None and joint["upper"] < _LEAST_TRAVEL * uncut:
        share = 100 * joint["upper"] / uncut
        yield finding(
            "travel-cut", joint["name"], f"it opens {share:.0f} % of what its kind does before something is in its way"
        )
