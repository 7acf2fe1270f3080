"""Size of a real cabinet (TUM fr3 cabinet, 58 key frames) reconstructed from clicks, compared with its recording's own size.

    python benchmarks/cabinet.py FOLDER [--workdir DIR]

FOLDER is shared/data/cabinet-tum-fr3-58. Writes cabinet.json beside this file: width, depth and height of the placed mesh and
of the scene's object against the recording's own box (0.793 x 0.445 m, top 0.554 m above the floor), whether each is within
2 cm, and which fraction of that box the mesh fills (the cabinet is closed all round). The category is one that is free-standing
and allows this length: a "cabinet" would be treated as one of a row, whose depth no frame shows.
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

from r2c2r_core.geometry.boxes import upright_box
from r2c2r_core.geometry.meshes import sample_surface, volume
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint, Prompts
from r2c2r_core.pipeline import Request, reconstruct
from r2c2r_core.workspace import Workspace

RESULT = Path(__file__).parent / "cabinet.json"
TRUE_M = np.array([0.445, 0.554, 0.793])  # sorted; depth across the drawers is the longest
CLICKS = ((16, 370.0, 222.0), (8, 339.0, 233.0))  # frame, x, y: a drawer's front and a side


def main() -> None:
    """Reconstruct the cabinet and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--workdir", type=Path, default=None)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        work = Workspace(options.workdir or Path(scratch))
        points = tuple(PromptPoint(frame=frame, x=x, y=y, label=1) for frame, x, y in CLICKS)
        prompts = Prompts(objects=(ObjectPrompt(name="cabinet", category="bench", points=points),))
        reconstruct(Request(source=options.folder, prompts=prompts), work, until="synthesize")
        RESULT.write_text(json.dumps(measured(work), indent=1) + "\n")
    print(RESULT.read_text())


def measured(work: Workspace) -> dict[str, object]:
    """Sizes in metres, sorted, and their errors."""
    placement, scene = work.load_latest("align", "cabinet"), work.load_latest("synthesize", "scene")
    found = work.load_latest("generate", "cabinet")
    if placement is None or scene is None or found is None:
        raise SystemExit("the cabinet was not placed")
    asset = next(c for c in found.candidates if c.candidate_id == placement.candidate_id)
    vertices = placement.world_from_mesh.apply(asset.mesh.vertices)
    surface, _ = sample_surface(vertices, asset.mesh.faces, 6000, np.random.default_rng(0))
    sizes = {"placed mesh": upright_box(surface, trim=0.003).size_m, "scene object": scene.objects[0].dimensions_m}
    off = {name: np.sort(size) - TRUE_M for name, size in sizes.items()}
    return {
        "true_m": TRUE_M.tolist(),
        **{f"{name}_m": np.sort(size).round(4).tolist() for name, size in sizes.items()},
        **{f"{name}_off_mm": (1000 * value).round(1).tolist() for name, value in off.items()},
        "within_2_cm": {name: bool((np.abs(value) < 0.02).all()) for name, value in off.items()},
        "filled_share": round(volume(vertices, asset.mesh.faces) / float(np.prod(TRUE_M)), 3),
        "mask_iou": round(placement.mask_iou, 4),
        "rms_mm": round(1000 * placement.rms_m, 2),
        "unsure": placement.unsure,
    }


if __name__ == "__main__":
    main()
