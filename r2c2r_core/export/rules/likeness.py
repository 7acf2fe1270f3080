"""Rules on likeness to the recording: contradictions, uncertain placements and hinges, joints that hardly open."""

from collections.abc import Iterable, Iterator
from typing import Any

from r2c2r_core.documents import parse_json
from r2c2r_core.errors import BundleError
from r2c2r_core.export.handles import out_of_reach
from r2c2r_core.export.rules.files import BundleFiles
from r2c2r_core.export.rules.table import LIKENESS_RULES, finding
from r2c2r_core.model.handle import Room
from r2c2r_core.model.report import Finding, Likeness

_SURE_HINGE = 0.8  # certainty of a hinge side; without an informative handle it is 0.75 (a pair) or the category's frequency
_LEAST_TRAVEL = 0.5  # of the category's travel: below, the unit or its neighbour is misplaced


def judge_likeness(findings: Iterable[Finding]) -> Likeness:
    """The likeness verdict of the findings: failed with any error, doubtful with any finding.

    Findings of other rules, such as physics, are ignored. Each object is listed once, with its first finding.
    """
    about = sorted((found for found in findings if found.rule in LIKENESS_RULES), key=lambda found: found.severity)
    doubts = dict[str, str]()
    for found in about:
        for name in found.where.split(", "):
            doubts.setdefault(name, found.message)
    failed = any(found.severity == "error" for found in about)
    return Likeness(state="failed" if failed else "doubtful" if doubts else "passed", doubts=tuple(doubts.items()))


def check_likeness(files: BundleFiles) -> Iterator[Finding]:
    """Findings on contradictions in manifest.json; an unreadable one is reported by check_agreement."""
    path = files.folder / "manifest.json"
    if not path.is_file():
        return
    try:
        manifest = parse_json(path.read_bytes(), "manifest.json", BundleError, hint="")
        objects = manifest["objects"]
        yield from _contradictions(manifest.get("contradictions", []), {item["name"] for item in objects})
        for item in objects:
            yield from _unsure_place(item)
            for joint in item.get("joints", []):
                yield from _cut_short(item["name"], joint)
                yield from _handles(joint)
        yield from _unsure_hinges(objects)
    except (BundleError, KeyError, IndexError, TypeError, AttributeError):
        return


def _contradictions(entries: list[dict[str, Any]], present: set[str]) -> Iterator[Finding]:
    """Findings on contradictions between objects of the bundle; omitted objects are ignored."""
    for entry in entries:
        if entry["rule"] in LIKENESS_RULES and present.issuperset(entry["objects"]):
            where = ", ".join(entry["objects"])
            yield finding(entry["rule"], where, f"{entry['message'].removeprefix(f'{where} ')}; {entry['mend']}")


def _unsure_place(item: dict[str, Any]) -> Iterator[Finding]:
    placement = item.get("placement")
    if placement is not None and placement["unsure"] and item.get("fixture") != "counter":  # the level surface places a worktop
        turn = placement.get("runner_up_turn_deg")
        turned = f" turned by {turn:.0f}°" if turn else ""
        yield finding(
            "place-unsure", item["name"], f"another place{turned} fits about as well; click it in more frames, or move it"
        )


def _unsure_hinges(objects: list[dict[str, Any]]) -> Iterator[Finding]:
    """One finding for all doors with an uncertain hinge side, as they are set together."""
    unsure = {
        item["name"]
        for item in objects
        for joint in item.get("joints", [])
        if joint.get("motion") is None and joint.get("confidence") is not None and joint["confidence"] < _SURE_HINGE
    }
    if unsure:
        yield finding(
            "hinge-unsure", ", ".join(sorted(unsure)), "no handle shows its hinge side; set it, also for several doors at once"
        )


def _cut_short(name: str, joint: dict[str, Any]) -> Iterator[Finding]:
    uncut = joint.get("uncut")
    if uncut is not None and joint["upper"] < _LEAST_TRAVEL * uncut:
        share = 100 * joint["upper"] / uncut
        yield finding(
            "travel-cut", name, f"{joint['name']} opens {share:.0f} % of the usual range of its kind before something blocks it"
        )


def _handles(joint: dict[str, Any]) -> Iterator[Finding]:
    for handle in joint.get("handles", []):
        room = handle["room"]
        free = Room(before_m=room["before_m"], beside_m=tuple(room["beside_m"]), depth_m=tuple(room["depth_m"]))
        reason = out_of_reach(handle["kind"], handle["size_m"][1], free)
        if reason is not None:
            yield finding("handle-reach", handle["name"], f"a gripper 9 cm wide cannot grasp it: {reason}")
