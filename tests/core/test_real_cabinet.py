"""Size of a real cabinet (TUM fr3 cabinet) from two clicks, compared with the box in its recording."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.align.stage import AlignConfig
from r2c2r_core.config import ReconstructConfig
from r2c2r_core.generate.stage import GenerateConfig
from r2c2r_core.geometry.boxes import upright_box
from r2c2r_core.geometry.meshes import sample_surface, volume
from r2c2r_core.ingest.stage import IngestConfig
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint, Prompts
from r2c2r_core.pipeline import Request, reconstruct
from r2c2r_core.workspace import Workspace

CABINET = Path(__file__).resolve().parents[2] / "../shared/data/cabinet-tum-fr3-58"
TRUE_M = np.array([0.445, 0.554, 0.793])  # sorted: its sides in truth_objects.txt, its top above the floor
CLICKS = (PromptPoint(frame=16, x=370.0, y=222.0, label=1), PromptPoint(frame=8, x=339.0, y=233.0, label=1))
# All frames, one candidate and a small search: what benchmarks/cabinet.py measures at full size, in some 20 s. Of half the
# frames the fused sides bulge, and its depth comes out 3 cm too large.
QUICK = ReconstructConfig(
    ingest=IngestConfig(finest_voxel_m=0.012, fused_frames=20),
    generate=GenerateConfig(count=1),
    align=AlignConfig(views=6, match_photos=2, match_views=8, settled=24, refined=4),
)


pytestmark = pytest.mark.skipif(not CABINET.exists(), reason="the TUM cabinet is not beside the checkout")
# A "cabinet" would be treated as one of a row, whose depth no frame shows; this one is free-standing.
PROMPTS = Prompts(objects=(ObjectPrompt(name="cabinet", category="bench", points=CLICKS),))


@pytest.mark.slow
def test_two_clicks_give_the_true_box_of_a_real_cabinet(tmp_path: Path) -> None:
    """Checks the box of the segment stage, before a mesh is generated."""
    work = Workspace(tmp_path)
    config = replace(QUICK, ingest=replace(QUICK.ingest, most_frames=29))  # every other frame
    reconstruct(Request(source=CABINET, prompts=PROMPTS, config=config), work, until="segment", workers=1)
    box = work.load_latest("segment", "cabinet").box
    np.testing.assert_allclose(np.sort(box.dimensions_m), TRUE_M, atol=0.02)


@pytest.mark.slow
def test_a_real_cabinet_is_reconstructed_to_within_two_centimetres(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    reconstruct(Request(source=CABINET, prompts=PROMPTS, config=QUICK), work, until="synthesize")
    placement, scene = work.load_latest("align", "cabinet"), work.load_latest("synthesize", "scene")
    mesh = work.load_latest("generate", "cabinet").candidates[0].mesh
    vertices = placement.world_from_mesh.apply(mesh.vertices)
    surface, _ = sample_surface(vertices, mesh.faces, 6000, np.random.default_rng(0))
    np.testing.assert_allclose(np.sort(upright_box(surface, trim=0.003).size_m), TRUE_M, atol=0.02)
    assert volume(vertices, mesh.faces) > 0.85 * np.prod(TRUE_M)  # closed all round: neither a slab on legs nor a shell
    np.testing.assert_allclose(np.sort(scene.objects[0].dimensions_m), TRUE_M, atol=0.02)
