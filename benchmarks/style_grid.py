"""Accuracy of fronts of every style of `r2c2r sample` from one random click each, and whether wrong ones are flagged.

    python benchmarks/style_grid.py [--styles slab shaker …] [--seeds 20 21] [--clicks 3] [--workdir DIR] [--update]

Seeds 20 and 21 are for development, 120 and 121 are reported. Each style is drawn alone, in its seed's own colours (or in
--palette's), into DIR/<style>-<seed>; existing recordings are kept, and figures too while the recogniser's source is unchanged.
Clicks, edges and the criterion for a right front are those of segment_fronts.py. A wrong front is flagged if nothing was found,
if it carries a warning, if its mask in the clicked frame is doubtful (as the annotate page draws it), or if it contradicts the
other fronts' clicks of the same round. --update writes the rows into benchmarks/style_grid.json; DIR/grid.md always has all.
"""

import argparse
import json
import sys
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from segment_fronts import RIGHT_MM, Trial, clicks_on, opened, true_fronts, try_click

from r2c2r_core.errors import R2C2RError
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.segment.contradictions import find_contradictions
from r2c2r_core.sources import source_key
from r2c2r_core.synthetic.choices import PALETTES, STYLES, Choice
from r2c2r_core.synthetic.stage import write_sample

RESULTS = Path(__file__).resolve().parent / "style_grid.json"
FRAMES, SIZE = 60, (640, 480)
DOUBTFUL = 0.5  # static/js/lib/lanes.js
Row = dict[str, Any]


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the missing recordings, click, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--styles", nargs="+", choices=STYLES, default=list(STYLES))
    parser.add_argument("--palette", choices=PALETTES)
    parser.add_argument("--seeds", nargs="+", type=int, default=[20, 21])
    parser.add_argument("--clicks", type=int, default=3, help="clicks per front")
    parser.add_argument("--workdir", type=Path, default=Path("style-grid"))
    parser.add_argument("--update", action="store_true")
    options = parser.parse_args(arguments)
    rows: dict[str, Row] = {}
    for seed in options.seeds:
        for style in options.styles:
            name = "-".join(part for part in (style, options.palette, str(seed)) if part)
            kitchen = draw(options.workdir / name, seed, Choice(style=style, palette=options.palette))
            rows[name] = measured(kitchen, options.clicks)
            _write_table(options.workdir)
            print(line(name, rows[name]), flush=True)
    if options.update:
        before = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
        RESULTS.write_text(json.dumps(before | rows, indent=1) + "\n", encoding="utf-8")
    return 0


def draw(folder: Path, seed: int, choice: Choice) -> Path:
    """The recording's folder; drawn if missing."""
    if not (folder / "prompts.json").exists():  # written last
        write_sample(folder, seed=seed, frames=FRAMES, size=SIZE, choice=choice)
    return folder


def measured(kitchen: Path, clicks: int) -> Row:
    """The kitchen's figures, cached beside it while the code that finds fronts is unchanged."""
    key, kept = f"{source_key('segment')}-{clicks}", kitchen / "grid.json"
    if kept.exists():
        row: Row = json.loads(kept.read_text(encoding="utf-8"))
        if row["key"] == key:
            return row
    row = measure(kitchen, clicks) | {"key": key}
    kept.write_text(json.dumps(row, indent=1) + "\n", encoding="utf-8")
    return row


def measure(kitchen: Path, clicks: int) -> Row:
    """Figures of every front clicked `clicks` times."""
    session, capture = opened(kitchen, kitchen / "work")
    rng = np.random.default_rng(zlib.crc32(kitchen.name.encode()))
    by_front = [
        [try_click(session, front, click) for click in clicks_on(session.scene, front, clicks, rng)]
        for front in true_fronts(kitchen / "truth.json", capture.world_from_capture)
    ]
    rounds = [[trials[k] for trials in by_front if k < len(trials)] for k in range(clicks)]
    judged = [(trial, flag) for each in rounds for trial, flag in zip(each, flags(session, each), strict=True)]
    wrong = [(trial, flag) for trial, flag in judged if trial.worst_mm > RIGHT_MM]
    found = [trial.worst_mm for trial, _ in judged if trial.off_mm is not None]
    for trial, flag in wrong:
        off = "not found" if trial.off_mm is None else trial.off_mm.round().astype(int).tolist()
        where = f"frame {trial.click.frame} ({trial.click.x:.0f}, {trial.click.y:.0f})"
        print(f"  {trial.front.name:24} {where} left, right, bottom, top: {off} {flag or 'not flagged'}", file=sys.stderr)
    return {
        "fronts": len(by_front),
        "never_clicked": sum(not trials for trials in by_front),
        "clicks": len(judged),
        "right": len(judged) - len(wrong),
        "wrong": len(wrong),
        "wrong_flagged": sum(bool(flag) for _, flag in wrong),
        "right_flagged": sum(bool(flag) for trial, flag in judged if trial.worst_mm <= RIGHT_MM),
        "median_mm": round(float(np.median(found)), 1) if found else None,
    }


def flags(session: Any, trials: Sequence[Trial]) -> list[str]:
    """The reason why each of one round's fronts is flagged; empty if it is not."""
    prompts = [ObjectPrompt(name=t.front.name, category=t.front.category, points=(t.click,)) for t in trials]
    tracks = {}
    for prompt in prompts:
        try:
            tracks[prompt.name] = session.track(prompt)
        except R2C2RError:
            continue
    contradicted = find_contradictions(tracks, [p for p in prompts if p.name in tracks], session.scene.capture.room.walls)
    by_name = {name: each.rule for each in contradicted for name in each.objects}
    said = []
    for trial in trials:
        track = tracks.get(trial.front.name)
        if track is None:
            said.append("not found")
        elif trial.front.name in by_name:
            said.append(by_name[trial.front.name])
        elif track.warnings:
            said.append(track.warnings[0])
        else:
            said.append("doubtful" if track.confidence.get(trial.click.frame, 0.0) < DOUBTFUL else "")
    return said


HEADER = "| kitchen | fronts | clicks | right within 10 mm | wrong | of these flagged | right but flagged | median mm |"


def line(name: str, row: Row) -> str:
    """A row of the table, as Markdown."""
    share = 100 * row["right"] / max(row["clicks"], 1)
    figures = (row["fronts"], row["clicks"], f"{row['right']} ({share:.0f} %)", row["wrong"], row["wrong_flagged"])
    return f"| {name} | {' | '.join(str(each) for each in (*figures, row['right_flagged'], row['median_mm']))} |"


def _write_table(workdir: Path) -> None:
    rows = {path.parent.name: json.loads(path.read_text(encoding="utf-8")) for path in sorted(workdir.glob("*/grid.json"))}
    lines = [HEADER, "|---" * 8 + "|", *(line(name, row) for name, row in rows.items())]
    (workdir / "grid.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
