"""Export an object's candidate meshes, best first: python examples/candidates.py SCAN.r3d PROMPTS.json NAME OUT_DIR"""

import sys
import tempfile
from pathlib import Path

import trimesh

from r2c2r_core.generate.stage import GENERATORS, GenerateConfig, generate_candidates
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.segment.stage import open_session


def main(scan: str, prompts: str, name: str, out: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        capture = read_capture(Path(scan), Path(folder) / "frames", IngestConfig())
        prompt = next(found for found in read_prompts(Path(prompts)).objects if found.name == name)
        track = open_session(capture, Path(folder) / "cache").track(prompt)
        found = generate_candidates(capture, track, GENERATORS.default, GenerateConfig(count=2))
    print(f"{name}: {found.chosen_id} is chosen: {found.reason}")
    Path(out).mkdir(parents=True, exist_ok=True)
    for asset in sorted(found.candidates, key=lambda asset: found.ranking.index(asset.candidate_id)):
        file = Path(out) / f"{asset.candidate_id}.ply"
        trimesh.Trimesh(asset.mesh.vertices, asset.mesh.faces, process=False).export(file)
        print(f"{file}: {len(asset.mesh.faces)} triangles, assumes {asset.assumes or 'nothing'}")


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
