"""Edge accuracy of fronts from one random click each, against the truth of synthetic kitchens.

    python benchmarks/segment_fronts.py KITCHEN… [--clicks 5] [--workdir DIR] [--pictures DIR] [--update NAME]

A KITCHEN is a folder with a truth.json and one recording (`*.r3d`), as `r2c2r sample` writes it. Clicks are random on the front
face, at least 1 cm from its edges, in a random frame that sees that point; categories are given. A front is right if all its
edges are within 10 mm of the truth's; one that is not found counts as wrong. --update writes this group of kitchens into
benchmarks/segment.json.
"""

import argparse
import json
import sys
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from r2c2r_core.errors import R2C2RError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import look_up
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.rectangle import Rectangle3
from r2c2r_core.segment.stage import open_session
from r2c2r_core.workspace import Workspace

RESULTS = Path(__file__).resolve().parent / "segment.json"
RIGHT_MM, INSET_M, AGREES_M, BORDER_PX = 10.0, 0.01, 0.03, 4


@dataclass(frozen=True, slots=True)
class TrueFront:
    """A front's face: x to the right, z up from its centre, outwards along -y."""

    name: str
    category: str
    world_from_face: Rigid3
    width_m: float
    height_m: float


@dataclass(frozen=True, slots=True)
class Trial:
    """One click, and the errors of the resulting edges."""

    front: TrueFront
    click: PromptPoint
    off_mm: np.ndarray | None  # left, right, bottom, top, outwards positive; None if no front was found

    @property
    def worst_mm(self) -> float:
        return float(np.abs(self.off_mm).max()) if self.off_mm is not None else float("inf")


def main(arguments: Sequence[str] | None = None) -> int:
    """Click every front, compare, print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kitchens", type=Path, nargs="+")
    parser.add_argument("--clicks", type=int, default=5)
    parser.add_argument("--workdir", type=Path, default=Path("fronts-work"))
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--update", metavar="NAME")
    options = parser.parse_args(arguments)
    rows = {}
    for kitchen in options.kitchens:
        trials = bench(kitchen, options.workdir / kitchen.name, options.clicks, options.pictures)
        rows[kitchen.name] = _figures(trials)
        print(f"{kitchen.name:36}", json.dumps(rows[kitchen.name]), flush=True)
    clicks, right = (sum(row[key] for row in rows.values()) for key in ("clicks", "right"))
    print(f"all: {right} of {clicks} clicks give a front right to {RIGHT_MM:g} mm on every edge ({right / max(clicks, 1):.3f})")
    if options.update:
        stored = json.loads(RESULTS.read_text(encoding="utf-8"))
        stored.setdefault("fronts", {})[options.update] = rows | {"all": {"clicks": clicks, "right": right}}
        RESULTS.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
    return 0


def bench(kitchen: Path, folder: Path, clicks: int, pictures: Path | None) -> list[Trial]:
    """Every front of a kitchen, clicked `clicks` times."""
    session, capture = opened(kitchen, folder)
    rng = np.random.default_rng(zlib.crc32(kitchen.name.encode()))
    trials = [
        try_click(session, front, click)
        for front in true_fronts(kitchen / "truth.json", capture.world_from_capture)
        for click in clicks_on(session.scene, front, clicks, rng)
    ]
    for trial in trials:
        if trial.worst_mm > RIGHT_MM:
            off = "not found" if trial.off_mm is None else trial.off_mm.round().astype(int).tolist()
            print(f"  {trial.front.name:18} frame {trial.click.frame} left, right, bottom, top: {off}", file=sys.stderr)
            if pictures is not None:
                _draw(session, trial, pictures / kitchen.name)
    return trials


def opened(kitchen: Path, folder: Path) -> tuple[Any, Capture]:
    """A session on the recording in a kitchen's folder, and the capture."""
    return opened_recording(next(kitchen.glob("*.r3d")), folder)


def opened_recording(recording: Path, folder: Path) -> tuple[Any, Capture]:
    """A session on a recording as `r2c2r run` reads it, and the capture; the capture is cached in `folder`."""
    work = Workspace(folder)
    if work.load_latest("ingest", "scene") is None:
        read = read_capture(recording, work.store(recording.stem), IngestConfig())
        work.save("ingest", "scene", read, {"key": "benchmark", "seconds": 0.0})
    capture = work.load_latest("ingest", "scene")
    return open_session(capture, work.cache), capture


def true_fronts(truth: Path, world_from_capture: Rigid3, kinds: Sequence[str] = ("front",)) -> Iterator[TrueFront]:
    """The fronts that a truth.json lists, or the faces of its objects of other kinds of category."""
    for entry in json.loads(truth.read_text(encoding="utf-8"))["objects"]:
        if category_of(entry["category"]).kind in kinds:
            width, depth, height = entry["dimensions_m"]
            world_from_object = world_from_capture @ Rigid3.from_matrix(np.array(entry["capture_from_object"]))
            face = world_from_object @ Rigid3(np.eye(3), np.array([0.0, -depth / 2, 0.0]))
            yield TrueFront(entry["name"], entry["category"], face, width, height)


def clicks_on(scene: Any, front: TrueFront, count: int, rng: np.random.Generator) -> Iterator[PromptPoint]:
    """Random points of the face, each in a random frame that sees it; fewer if few are visible."""
    made = 0
    for _ in range(20 * count):
        if made == count:
            return
        x, z = rng.uniform(-0.5, 0.5, 2) * [front.width_m - 2 * INSET_M, front.height_m - 2 * INSET_M]
        point = front.world_from_face.apply(np.array([[x, 0.0, z]]))
        frame = scene.frames[rng.integers(len(scene.frames))]
        if (front.world_from_face.inverse @ frame.world_from_camera).translation[1] > 0:
            continue
        expected, seen, _ = look_up(point, frame.world_from_camera, frame.depth_camera, scene.depth(frame.index))
        if not (seen[0] > 0 and abs(seen[0] - expected[0]) < AGREES_M):
            continue
        u, v, w = frame.rgb_camera.matrix @ frame.world_from_camera.inverse.apply(point)[0]
        u, v = u / w, v / w
        if BORDER_PX < u < frame.rgb_camera.width - BORDER_PX and BORDER_PX < v < frame.rgb_camera.height - BORDER_PX:
            made += 1
            yield PromptPoint(frame=frame.index, x=float(u), y=float(v), label=1)


def try_click(session: Any, front: TrueFront, click: PromptPoint) -> Trial:
    """Result of a click for that front."""
    try:
        panel = session.find(ObjectPrompt(name=front.name, category=front.category, points=(click,))).panel()
    except R2C2RError:
        panel = None
    return Trial(front, click, None if panel is None else off_mm(front, panel))


def off_mm(front: TrueFront, panel: Rectangle3) -> np.ndarray:
    """Edge errors of a panel against the truth: left, right, bottom, top, outwards positive."""
    local = front.world_from_face.inverse @ panel.world_from_front
    sides = np.array([[sign * panel.width_m / 2, 0, 0] for sign in (-1, 1)])
    ends = np.array([[0, 0, sign * panel.height_m / 2] for sign in (-1, 1)])
    (left, right), (bottom, top) = local.apply(sides)[:, 0], local.apply(ends)[:, 2]
    half = np.array([front.width_m, front.width_m, front.height_m, front.height_m]) / 2
    return np.asarray(1000 * (np.array([-left, right, -bottom, top]) - half))


def _figures(trials: list[Trial]) -> dict[str, Any]:
    worst = np.array([trial.worst_mm for trial in trials])
    found = worst[np.isfinite(worst)]
    return {
        "fronts": len({trial.front.name for trial in trials}),
        "clicks": len(trials),
        "right": int((worst <= RIGHT_MM).sum()),
        "not_found": int((~np.isfinite(worst)).sum()),
        "median_mm": round(float(np.median(found)), 1) if len(found) else None,
        "worst_mm": round(float(found.max()), 1) if len(found) else None,
    }


def _draw(session: Any, trial: Trial, folder: Path) -> None:
    """Draw the clicked frame, the click and the resulting mask."""
    folder.mkdir(parents=True, exist_ok=True)
    image = session.scene.rgb(trial.click.frame)[..., ::-1].copy()
    if trial.off_mm is not None:
        prompt = ObjectPrompt(name=trial.front.name, category=trial.front.category, points=(trial.click,))
        image[session.mask_at(prompt, trial.click.frame)] //= 2
    cv2.circle(image, (round(trial.click.x), round(trial.click.y)), 6, (0, 0, 255), -1)
    cv2.imwrite(str(folder / f"{trial.front.name}-{trial.click.frame}.jpg"), image)


if __name__ == "__main__":
    raise SystemExit(main())
