import numpy as np
import pytest

from r2c2r_core.codec import decode_noun, encode_noun
from r2c2r_core.geometry.masks import pack_mask, unpack_mask
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.mesh import CandidateSet, MeshAsset, TexturedMesh
from r2c2r_core.model.track import FrontHandle, FrontPanel, MaskTrack


def test_a_track_survives_the_round_trip() -> None:
    mask = np.zeros((40, 60), dtype=bool)
    mask[7:21, 13:44] = True
    handle = FrontHandle(left_m=0.1, right_m=0.12, bottom_m=-0.1, top_m=0.1, protrusion_m=0.03, confidence=0.9)
    front = FrontPanel(
        world_from_front=Rigid3(np.eye(3), np.array([1.0, 2.0, 3.0])), width_m=0.6, height_m=0.7, handle=handle, confidence=0.8
    )
    track = MaskTrack(
        name="door",
        category="cabinet",
        masks={3: pack_mask(mask)},
        confidence={3: 0.5},
        front=front,
        box=None,
        kind="front",
        backend="geometric",
        prompt_count=1,
        warnings=("one",),
    )
    back, header = decode_noun(encode_noun(track, {"key": "k"}))
    assert header == {"key": "k"}
    assert np.array_equal(unpack_mask(back.masks[3]), mask)
    assert back.front.handle == handle or back.front.handle.left_m == handle.left_m
    assert np.array_equal(back.front.world_from_front.translation, [1.0, 2.0, 3.0])
    assert back.warnings == ("one",)
    assert back.box is None


def test_textures_are_lossless_and_in_rgb_order() -> None:
    texture = np.random.default_rng(0).integers(0, 255, (8, 5, 3), dtype=np.uint8)
    mesh = TexturedMesh(vertices=np.eye(3), faces=np.array([[0, 1, 2]]), uv=np.zeros((3, 2)), texture=texture)
    asset = MeshAsset(
        object_name="a",
        candidate_id="c0",
        mesh=mesh,
        generator="g",
        seed=0,
        watertight=False,
        frames=(1, 2),
        metrics={"faces": 1.0},
        parameters={},
        warnings=(),
    )
    kept = CandidateSet(
        object_name="a", candidates=(asset,), chosen_id="c0", chosen_by="consensus", reason="only one", ranking=("c0",)
    )
    back, _ = decode_noun(encode_noun(kept, {}))
    assert np.array_equal(back.chosen.mesh.texture, texture)
    assert back.chosen.frames == (1, 2)


def test_encoding_rejects_unknown_types() -> None:
    with pytest.raises(TypeError, match="not a noun"):
        encode_noun(object(), {})


def test_empty_and_full_masks_survive_packing() -> None:
    for value in (False, True):
        mask = np.full((5, 9), value)
        assert np.array_equal(unpack_mask(pack_mask(mask)), mask)
        assert pack_mask(mask).area_px == (45 if value else 0)
