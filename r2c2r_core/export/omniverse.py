"""Evaluation of NVIDIA's asset validator on scene.usda, with known false alarms."""

from collections import Counter
from typing import Any

from r2c2r_core.model.report import LoaderResult

FALSE_ALARMS = {
    "HI.004": "floor, light and camera are beside the default prim, so that a stage that references it keeps its own",
    "RB.007": "fixed parts have a mass in case somebody frees them; engines ignore a mass without a rigid body",
    "UsdAsciiPerformanceChecker": "the files are text so that they can be read and compared; a binary one is quicker to open",
    "VG.009": "it would save space: texture coordinates repeat",
    "VG.016": "it would save space: points of one place are kept apart for their texture coordinates",
}
"""Rule ids, or names of rules without one, and why what they say is no fault of a bundle."""

_SERIOUS = ("error", "failure")


def validated(loader: str, document: dict[str, Any]) -> LoaderResult:
    """The verdict on the probe's issues: failed on a serious one that is not a known false alarm; it names every rule."""
    issues = document["issues"]
    serious = [issue for issue in issues if issue["severity"] in _SERIOUS and issue["rule"] not in FALSE_ALARMS]
    if serious:
        first = serious[0]
        said = f"{len(serious)} serious, first {first['rule']} at {first['where']}: {first['message']}"
        return LoaderResult(loader=loader, state="failed", detail=" ".join(f"{document['version']}: {said}".split())[:400])
    return LoaderResult(loader=loader, state="passed", detail=f"{document['version']}: {_alarms(issues)}")


def _alarms(issues: list[dict[str, Any]]) -> str:
    counted = sorted(Counter(issue["rule"] for issue in issues).items())
    lines = [f"{count} x {rule} ({FALSE_ALARMS.get(rule, 'a warning')})" for rule, count in counted]
    return "; ".join(lines) or "no issues"
