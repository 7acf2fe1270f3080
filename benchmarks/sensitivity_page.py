"""Plot and documentation page of the sensitivity to each tuned parameter."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from r2c2r_core.tuning import modules_with_numbers, params_of

MOVES = {"-25": 0.75, "+25": 1.25}
SHOWN = 40

BETTER = {
    "segment.appliances.faces.patch_m": "the correlation length of the recording's depth noise",
    "segment.appliances.box.front_m": "the recording's depth noise",
    "segment.things.visual_hull.inside": "fit both a hull and a cylinder, and keep the one with the better silhouette IoU",
    "segment.things.visual_hull.pose_share": "the same: a hull just below the threshold is replaced by a cylinder",
    "segment.things.pixel_cut.smooth": "the contrast across the certain borders of the same recording",
    "segment.planes.cell_m": "the vertex spacing of the fused surface",
    "generate.lathe.bitten": "the likelihood of a profile given depth and masks, separately for neck and body",
    "generate.boxed.looked_at": "all frames that show the front, weighted by their information",
    "generate.consistency.judges": "all frames that show the object, weighted by their information",
}
"""By number: the estimator that would stand in its place."""

WHY = (
    "`segment.appliances.faces.gap_m` and `patch_m` used to define the same limit (effects of 12.5 and 9.5 on the loss): if a",
    "patch was longer than the gap, every patch counted as the last one. The gap is now added to the patch length; it has",
    "no effect any more, and the patch length changes the loss by 0.1.",
    "`generate.lathe.bitten` above 1 classified every mask as cut off; its upper bound is now 1.",
    "`segment.things.visual_hull.inside` and `pose_share` choose between a hull and a cylinder for one bottle, and",
    "`generate.consistency.judges` below 8 selects another candidate; the current values make the right choice in both cases.",
)
"""Of those with the largest effects: what they decide."""


def effects(document: Mapping[str, Any]) -> list[tuple[str, float, float]]:
    """Loss change down and up of existing parameters, averaged over the runs that moved them; the largest first."""
    found: dict[str, list[list[float]]] = {}
    for run in document["runs"]:
        for name, moves in run["numbers"].items():
            if "error" not in moves and _stands(name):
                found.setdefault(name, []).append(
                    [moves[at]["loss"] - moves[at]["before"] if at in moves else 0.0 for at in MOVES]
                )
    means = {name: np.mean(changes, axis=0).round(4).tolist() for name, changes in found.items()}
    rows = [(name, down, up) for name, (down, up) in means.items()]
    return sorted(rows, key=lambda row: (-max(abs(row[1]), abs(row[2])), row[0]))


def same_everywhere(document: Mapping[str, Any]) -> set[str]:
    """Parameters whose moves changed no byte of any step in any run."""
    moved = [(name, moves) for run in document["runs"] for name, moves in run["numbers"].items()]
    other = {name for name, moves in moved if "error" in moves or any(move["changed"] for move in moves.values())}
    return set(filter(_stands, {name for name, _ in moved} - other))


def tornado(document: Mapping[str, Any]) -> str:
    """SVG tornado plot: the largest effects as bars to either side of the usual loss."""
    rows = [row for row in effects(document)[:SHOWN] if max(map(abs, row[1:])) > 0]
    most = max((abs(v) for row in rows for v in row[1:]), default=1.0) or 1.0
    height, middle, reach = 18, 560, 220
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="820" height="{height * (len(rows) + 3)}" '
        'font-family="sans-serif" font-size="11">',
        '<rect width="100%" height="100%" fill="white"/>',
        '<text x="10" y="14">change of the loss when a number moves by -25 % (blue) and +25 % (orange)</text>',
    ]
    for position, (name, down, up) in enumerate(rows):
        y = height * (position + 1.6)
        lines.append(f'<text x="{middle - reach - 10}" y="{y + 10:.0f}" text-anchor="end">{name}</text>')
        for value, colour, offset in ((down, "#2166d6", 0), (up, "#ef7820", 6)):
            width = abs(value) / most * reach
            x = middle if value >= 0 else middle - width
            lines.append(f'<rect x="{x:.1f}" y="{y + offset:.0f}" width="{max(width, 0.5):.1f}" height="6" fill="{colour}"/>')
    foot = height * (len(rows) + 2.2)
    lines.append(f'<line x1="{middle}" y1="24" x2="{middle}" y2="{foot - 8:.0f}" stroke="black" stroke-width="0.5"/>')
    for share in (-1.0, 0.0, 1.0):
        lines.append(
            f'<text x="{middle + share * reach:.0f}" y="{foot + 6:.0f}" text-anchor="middle">{share * most:+.2f}</text>'
        )
    return "\n".join([*lines, "</svg>", ""])


def table(document: Mapping[str, Any]) -> str:
    """The documentation page."""
    rows, same = effects(document), same_everywhere(document)
    still = sorted(name for name, down, up in rows if max(abs(down), abs(up)) == 0.0 and name not in same)
    untouched = sorted(filter(_stands, set.intersection(*(set(run["untouched"]) for run in document["runs"]))))
    broken = sorted(
        {name for run in document["runs"] for name, moves in run["numbers"].items() if "error" in moves and _stands(name)}
    )
    return "\n".join(
        [
            "# Sensitivity to tuned numbers",
            "",
            "`benchmarks/sensitivity.py` changes each tuned number alone by -25 % and +25 %, on one object of each kind whose",
            "stages read it, and compares the result with the ground truth of the recordings below. The loss is the sum of the",
            "mean size error in percent, 100 (1 - mask IoU) and 100 (1 - share of correct joints). The table shows the change",
            "of the loss; negative values are better.",
            "",
            *(_run_line(run) for run in document["runs"]),
            "",
            "![Change of the loss by number](sensitivity.svg)",
            "",
            "| number | -25 % | +25 % | possible estimator |",
            "|---|---:|---:|---|",
            *(
                f"| `{name}` | {down:+.3f} | {up:+.3f} | {BETTER.get(name.partition('[')[0], '')} |"
                for name, down, up in rows[:SHOWN]
                if max(abs(down), abs(up)) > 0.0
            ),
            "",
            "## Largest effects",
            "",
            *WHY,
            "",
            f"## No effect on the output of any stage ({len(same)})",
            "",
            _listed(sorted(same)),
            "",
            f"## No effect on sizes, masks and joints ({len(still)})",
            "",
            "Gaps between boards and fronts affect contacts, and mesh and texture resolution affect images; neither is scored",
            "here.",
            "",
            _listed(still),
            "",
            *([f"## Errors ({len(broken)})", "", _listed(broken), ""] if broken else []),
            f"## Not read by the stages that were run ({len(untouched)})",
            "",
            "Other kitchens, recordings and backends read them.",
            "",
            _listed(untouched),
            "",
        ]
    )


def _stands(name: str) -> bool:
    """Whether the code still has the parameter; a run also lists parameters that have been removed since."""
    path, _, number = name.partition("[")[0].rpartition(".")
    return path in modules_with_numbers(path.partition(".")[0]) and number in {f.name for f in fields(params_of(path))}


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names) or "none"


def _run_line(run: Mapping[str, Any]) -> str:
    (source, frames, recording, objects), usual = run["key"], run["usual"]
    return (
        f"- `{recording}` ({', '.join(objects)}), {frames} frames, code {source[:8]}: {len(run['numbers'])} of the "
        f"{run['read']} numbers that are read were moved. With the usual ones the loss is {usual['loss']:.2f}: sizes "
        f"{usual['extents_percent']:.2f} %, mask IoU {usual['mask_iou']:.3f}, joints {usual['joints']:.3f}."
    )
