"""SuperGlue and LightGlue through the classes of transformers, with tiny random weights written to a folder."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="no torch: pip install --group learned")
transformers = pytest.importorskip("transformers")

import r2c2r_core.align.glue as glue  # noqa: E402  # after the skips
from r2c2r_core.align.lightglue import LightGlueMatcher  # noqa: E402
from r2c2r_core.align.observe import observe  # noqa: E402
from r2c2r_core.align.stage import AlignConfig, _match  # noqa: E402
from r2c2r_core.align.superglue import SuperGlueMatcher  # noqa: E402
from r2c2r_core.errors import BackendUnavailable  # noqa: E402
from r2c2r_core.geometry.meshes import distances_to_mesh  # noqa: E402
from r2c2r_core.tuning import tuning  # noqa: E402

pytestmark = pytest.mark.slow  # torch is large: `make test` does not install it

torch.set_num_threads(1)
DETECTOR = transformers.SuperPointConfig(
    encoder_hidden_sizes=[8, 8, 16, 16], decoder_hidden_size=16, descriptor_decoder_dim=16, keypoint_threshold=0.0
)
MATCHERS = {"superglue": SuperGlueMatcher, "lightglue": LightGlueMatcher}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Folders with weights of both kinds, as `from_pretrained` expects them."""
    torch.manual_seed(1)
    superglue = transformers.SuperGlueConfig(
        keypoint_detector_config=DETECTOR,
        hidden_size=16,
        keypoint_encoder_sizes=[8, 16],
        gnn_layers_types=["self", "cross"],
        num_attention_heads=2,
        sinkhorn_iterations=20,
    )
    lightglue = transformers.LightGlueConfig(
        keypoint_detector_config=DETECTOR,
        descriptor_dim=16,
        num_hidden_layers=2,
        num_attention_heads=2,
        filter_threshold=0.0,
        initializer_range=0.5,  # at 0.02 all keypoints have nearly the same descriptor
    )
    found = {}
    for name, model in {
        "superglue": transformers.SuperGlueForKeypointMatching(superglue),
        "lightglue": transformers.LightGlueForKeypointMatching(lightglue),
    }.items():
        found[name] = tmp_path_factory.mktemp(name)
        model.save_pretrained(found[name])
    return found


@pytest.fixture(autouse=True)
def lenient(monkeypatch):
    """Accept every mutual nearest match, as random weights give no confident ones."""
    monkeypatch.setattr(SuperGlueMatcher, "settings", {})


@pytest.fixture(scope="module")
def pictures():
    """Two photos of one textured patch, the second shifted by (24, 16) pixels."""
    rng = np.random.default_rng(0)
    patch = rng.integers(0, 255, (40, 40, 3)).astype(np.uint8).repeat(4, axis=0).repeat(4, axis=1)
    images, masks = [], []
    for left, top in ((20, 20), (44, 36)):
        image, mask = np.full((220, 240, 3), 128, np.uint8), np.zeros((220, 240), bool)
        image[top : top + 160, left : left + 160], mask[top : top + 160, left : left + 160] = patch, True
        images.append(image)
        masks.append(mask)
    return images, masks


@pytest.mark.parametrize("name", MATCHERS)
def test_keypoints_lie_in_the_mask_are_limited_and_follow_a_shift(folders, pictures, name):
    matcher = MATCHERS[name](weights=folders[name])
    (first, second), masks = pictures
    features = matcher.describe(first, masks[0])
    assert 100 < len(features.uv_px) <= glue.Params().keypoints
    column, row = features.uv_px.astype(int).T
    assert masks[0][row, column].all()
    # the same patch elsewhere in the picture gives the same keypoints, shifted: crop and scale are inverted exactly
    moved = matcher.describe(second, masks[1])
    assert np.allclose(moved.uv_px - features.uv_px, [24, 16], atol=1e-3)
    assert np.allclose(moved.descriptors, features.descriptors, atol=1e-4)


@pytest.mark.parametrize("name", MATCHERS)
def test_stored_keypoints_match_like_the_forward_call_of_the_model(folders, name):
    """On full-size images, `forward` with its own detection gives the same matches as stored keypoints."""
    matcher = MATCHERS[name](weights=folders[name])
    rng = np.random.default_rng(3)
    side = glue.CANVAS_PX
    image = rng.integers(0, 255, (side // 8, side // 8)).astype(np.uint8).repeat(8, 0).repeat(8, 1)
    images = [image, (image.astype(int) + rng.integers(-20, 20, image.shape)).clip(0, 255).astype(np.uint8)]
    whole = np.ones((side, side), bool)
    model = matcher._model
    model.keypoint_detector.keypoint_decoder.max_keypoints = 300  # below our limit: nothing is dropped on our side
    features = [matcher.describe(np.repeat(image[..., None], 3, axis=2), whole) for image in images]
    ours = matcher.match(*features)
    assert len(ours.first) > 0
    pixels = torch.from_numpy(np.stack(images)[None, :, None].astype(np.float32) / 255).repeat(1, 1, 3, 1, 1)
    with torch.inference_mode():
        out = model(pixels)
    theirs = {}
    for k, partner in enumerate(out.matches[0, 0].tolist()):
        if partner >= 0:
            theirs[place(out.keypoints[0, 0, k], side)] = place(out.keypoints[0, 1, partner], side)
    assert {tuple(features[0].uv_px[a]): tuple(features[1].uv_px[b]) for a, b in zip(*ours, strict=True)} == theirs


def place(share, side):
    return tuple((share.double() * side).round().numpy() + 0.5)


@pytest.mark.parametrize("name", MATCHERS)
def test_pairs_are_one_to_one_and_empty_features_have_no_matches(folders, pictures, name):
    matcher = MATCHERS[name](weights=folders[name])
    images, masks = pictures
    first, second = (matcher.describe(image, mask) for image, mask in zip(images, masks, strict=True))
    pairs = matcher.match(first, second)
    assert len(set(pairs.first)) == len(pairs.first) == len(pairs.second) == len(set(pairs.second)) > 0
    nothing = matcher.describe(images[0], np.zeros_like(masks[0]))
    assert len(nothing.uv_px) == 0
    assert len(matcher.match(first, nothing).first) == 0
    assert len(matcher.match(nothing, nothing).first) == 0


def test_superglue_drops_low_confidence_pairs(folders, pictures, monkeypatch):
    images, masks = pictures
    lenient = SuperGlueMatcher(weights=folders["superglue"])
    first, second = (lenient.describe(image, mask) for image, mask in zip(images, masks, strict=True))
    monkeypatch.undo()
    strict = SuperGlueMatcher(weights=folders["superglue"])
    assert len(lenient.match(first, second).first) > len(strict.match(first, second).first)


def test_only_the_most_similar_views_are_matched_by_the_network(folders, pictures, monkeypatch):
    matcher = SuperGlueMatcher(weights=folders["superglue"])
    images, masks = pictures
    first, same = (matcher.describe(image, mask) for image, mask in zip(images, masks, strict=True))
    rng = np.random.default_rng(1)
    other = matcher.describe(rng.integers(0, 255, images[0].shape).astype(np.uint8), masks[0])
    asked = []
    match = matcher.match
    monkeypatch.setattr(matcher, "match", lambda a, b: asked.append(b) or match(a, b))
    with tuning({glue.Params: glue.Params(shortlist=1)}):
        found = matcher.match_many(first, [other, same, other])
    assert len(asked) == 1
    assert asked[0] is same
    assert [len(pairs.first) > 0 for pairs in found] == [False, True, False]


@pytest.mark.parametrize("name", MATCHERS)
def test_a_folder_without_the_weights_raises_a_one_line_error(tmp_path, name):
    (tmp_path / "config.json").write_text("{}")
    with pytest.raises(BackendUnavailable, match=str(tmp_path)) as refusal:
        MATCHERS[name](weights=tmp_path)
    assert "\n" not in str(refusal.value)


def test_a_photo_is_matched_against_rendered_views_and_lifted_to_points(folders, bench):
    """The same path as in the stage: keypoints of photo and renders, pairs, points on the mesh and in the world."""
    mesh, capture, track = bench.free_box(textured=True)
    asset, _ = bench.as_candidate(mesh, 0)
    config = AlignConfig(match_views=8, match_photos=2)
    observation = observe(capture, track, view_count=3, size_px=96, point_count=300)
    lifted = _match(capture, track, asset.mesh, observation, SuperGlueMatcher(weights=folders["superglue"]), config)
    assert len(lifted) == 2
    points = np.concatenate([photo.points_mesh for photo in lifted])
    assert len(points) > 0
    assert distances_to_mesh(points, asset.mesh.vertices, asset.mesh.faces).max() < 0.02  # in units of the mesh
    world = np.concatenate([photo.points_world for photo in lifted])
    assert np.linalg.norm(world - observation.centre_world, axis=1).max() < 1.5 * observation.size_m
