"""Documentation page and reliability diagram of the confidence calibration."""

from collections.abc import Mapping
from typing import Any

RIGHT = {
    "mask": "IoU with the true mask",
    "edge": "the front's true edge is within 10 mm",
    "seam": "the front includes part of its neighbour",
    "hinge": "the door is hinged on that side",
}


def generator_of(name: str) -> str:
    """The generator that drew a recording: own or second."""
    return name.split()[0]


def page(document: Mapping[str, Any], fronts: Mapping[str, Any]) -> str:
    """The page of the documentation; `fronts` are the figures of front_certainty.py."""
    own = [name for name in document["recordings"] if generator_of(name) == "own"]
    lines = [
        "# Calibration of confidences",
        "",
        "A confidence of 0.9 should be right nine times in ten. `benchmarks/calibration.py` compares the claims with",
        f"the ground truth of {len(own)} kitchens of the project's sample generator and",
        f"{len(document['recordings']) - len(own)} of a second, independent one. It fits a logistic map with two parameters",
        "to each confidence (`r2c2r_core/calibration.py`), both generators with equal weight. Figures after calibration are",
        "held out: no kitchen is evaluated with a map that was fitted on it. *Others* are",
        f"{len(document['checked'])} more kitchens, including other styles of fronts, that were not used for the fit at all.",
        "",
        "![Claimed and right, before and after](calibration.svg)",
        "",
        "| confidence | right means | claims | off before | off after | slope | offset | others | off before | off after |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|",
        *(
            f"| {name} | {RIGHT[name]} | {m['claims']} | {m['before']['off']:.3f} | {m['after']['off']:.3f} "
            f"| {m['slope']:g} | {m['offset']:g} |{_others(m['checked'])}"
            for name, m in document["maps"].items()
        ),
        "",
        "*Off* is the expected calibration error: the mean difference between confidence and accuracy, over tenths of the",
        "claims.",
        "",
        "Both generators hinge every door opposite its handle, so a detected handle shows the side. Sides derived from a",
        "neighbour, a default or an open door were too rare to be measured, and keep their assumed confidence. Masks are those",
        "of the weight-free segmenter. A mask that merges a front with its neighbour has equally sharp borders: only its size",
        "reveals it, which lowers the confidence after the map (`unlikely_left`).",
        "",
        "| confidence | generator | claims | claimed before | right |",
        "|---|---|---:|---:|---:|",
        *(
            f"| {name} | {generator} | {g['claims']} | {g['claimed']:.3f} | {g['right']:.3f} |"
            for name, m in document["maps"].items()
            for generator, g in m["by_generator"].items()
        ),
        "",
        *_fronts(fronts),
        "## Claims that need no map",
        "",
        "The probability that network and lines give for an edge, or for a seam that was not cut, needs no calibration: a map",
        "fitted on some kitchens did not improve it on others. It does not recognise face frames mistaken for fronts: such an",
        "edge has the same confidence, but is off by the width of the frame. The row of seams was measured",
        "before the partition: a seam's claim now compares the front with its best division.",
        "",
        "| claim | right means | claims | claimed | right | off | others | claimed | right | off |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|",
        *(
            f"| {name} | {RIGHT[name]} |{_row(found['fitted'])}{_row(found['checked'])}"
            for name, found in document["as_claimed"].items()
        ),
        "",
        "## Categorical claims",
        "",
        "A placement is labelled sure or unsure; it is right if, in the finished scene, it is within 1.5 degrees and, along",
        "the axes that the scan shows from end to end, within 15 mm of the ground truth. A size is labelled with its source;",
        "it is right if it is within 15 mm.",
        "",
        "| claim | generator | claims | right |",
        "|---|---|---:|---:|",
        *(f"| {w['of']}: {w['word']} | {w['generator']} | {w['claims']} | {w['right']} |" for w in document["words"]),
        "",
    ]
    return "\n".join(lines)


def _fronts(figures: Mapping[str, Any]) -> list[str]:
    """Section on the certainty of fronts and of the faces of appliances."""
    count, wrong, makers = sum(figures["faces"].values()), figures["wrong"], len(figures["faces"])
    return [
        "## Fronts and faces of appliances",
        "",
        'The number that proposals and doubts state ("edges 44 %") is the probability that each edge is within',
        "10 mm, or 2.5 % of that side, of its true place: a logistic model of the faintest edge and of a seam",
        "that was not cut. Edges are not multiplied: their errors have common causes; sizes do not count.",
        f"`benchmarks/front_certainty.py` fits it on {count} faces of {figures['kitchens']} kitchens by {makers} makers.",
        f"With each kitchen held out it is off by {figures['off']:.3f}; {figures['wrong_unsure']} of {wrong} wrong faces and",
        f"{figures['right_unsure']} of {count - wrong} right ones are below 60 %, where a doubt is raised.",
        "",
        "| claimed | faces | claimed, mean | right |",
        "|---|---:|---:|---:|",
        *(
            f"| {row['from']:.0%} to {row['to']:.0%} | {row['faces']} | {row['claimed']:.3f} | {row['right']:.3f} |"
            for row in figures["held_out"]
        ),
        "",
    ]


def _row(found: Mapping[str, Any]) -> str:
    if not found["claims"]:
        return " 0 | | | |"
    return f" {found['claims']} | {found['claimed']:.3f} | {found['right']:.3f} | {found['off']:.3f} |"


def _others(checked: Mapping[str, Any]) -> str:
    before, after = checked["before"], checked["after"]
    return f" {before['claims']} | {before['off']:.3f} | {after['off']:.3f} |" if before["claims"] else " 0 | | |"


def picture(document: Mapping[str, Any]) -> str:
    """The reliability diagram from 0.5 to 1 as SVG: accuracy over confidence; a circle's area is its number of claims."""
    side, gap = 220, 50
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{(side + gap) * len(document["maps"]) + gap}" height="{side + 90}" '
        'font-family="sans-serif" font-size="11">',
        '<rect width="100%" height="100%" fill="white"/>',
        '<text x="50" y="16">right over claimed: before (orange) and after calibration (blue, held out)</text>',
    ]
    for number, (name, found) in enumerate(document["maps"].items()):
        left, bottom = gap + number * (side + gap), side + 40
        lines += [
            f'<rect x="{left}" y="40" width="{side}" height="{side}" fill="none" stroke="black" stroke-width="0.5"/>',
            f'<line x1="{left}" y1="{bottom}" x2="{left + side}" y2="40" stroke="grey" stroke-dasharray="4"/>',
            f'<text x="{left + side / 2:.0f}" y="{bottom + 32}" text-anchor="middle">{name}</text>',
        ]
        for tick in (0.5, 0.75, 1.0):
            lines += [
                f'<text x="{left + (2 * tick - 1) * side:.0f}" y="{bottom + 14}" text-anchor="middle">{tick:g}</text>',
                f'<text x="{left - 5}" y="{bottom - (2 * tick - 1) * side + 4:.0f}" text-anchor="end">{tick:g}</text>',
            ]
        for when, colour in (("before", "#ef7820"), ("after", "#2166d6")):
            for part in found[when]["bins"]:
                x, y = left + side * (2 * part["claimed"] - 1), bottom - side * (2 * part["right"] - 1)
                radius = 2 + 10 * (part["claims"] / found["claims"]) ** 0.5
                lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{colour}" fill-opacity="0.55"/>')
    return "\n".join([*lines, "</svg>", ""])
