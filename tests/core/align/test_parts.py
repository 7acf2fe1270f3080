"""Single components of the alignment."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.align.hypotheses import signed_permutations
from r2c2r_core.align.lift import Lifted
from r2c2r_core.align.observe import choose_frames, observe
from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.align.render import fibonacci_sphere, render_views
from r2c2r_core.align.shape import manhattan_axes, prepare_shape
from r2c2r_core.align.sift import SiftMatcher
from r2c2r_core.align.voting import vote
from r2c2r_core.geometry.camera import project
from r2c2r_core.geometry.transforms import Similarity3
from tests.core.motions import motion


def test_signed_permutations_are_the_24_proper_rotations() -> None:
    turns = signed_permutations()
    assert len(turns) == 24
    assert len({t.tobytes() for t in turns}) == 24
    assert all(np.linalg.det(t) == pytest.approx(1.0) for t in turns)


@pytest.mark.parametrize("seed", range(5))
def test_manhattan_axes_follow_the_rotation_of_the_normals(seed: int) -> None:
    rng = np.random.default_rng(seed)
    normals = np.eye(3)[rng.integers(0, 3, 900)] * rng.choice([-1.0, 1.0], (900, 1))
    normals = normals + rng.normal(0, 0.1, normals.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rotation = Rotation.random(random_state=seed).as_matrix()
    axes, share = manhattan_axes(normals @ rotation.T, rng)
    agreement = np.abs(axes.T @ rotation).max(axis=1)
    assert np.degrees(np.arccos(np.minimum(agreement, 1.0))).max() < 0.7  # 5.7 degrees of noise over 900 normals
    assert share > 0.7


def test_the_size_of_a_mesh_does_not_depend_on_its_frame(bench: Any) -> None:
    thing = bench.free_box(textured=False)[0]
    sizes = []
    for seed in range(3):
        asset, truth = bench.as_candidate(thing, seed)
        shape = prepare_shape(asset.mesh, point_count=2000, face_limit=3000, rng=np.random.default_rng(0))
        sizes.append(shape.diameter * truth.scale)
    np.testing.assert_allclose(sizes, np.linalg.norm([0.4, 0.3, 0.25]), rtol=0.02)


def test_view_masks_and_points_match_the_true_object(bench: Any) -> None:
    thing, capture, track = bench.free_box(textured=True)
    observation = observe(capture, track, view_count=5, size_px=128, point_count=800)
    assert len(observation.views) == 5
    for view in observation.views:
        uv = project(view.world_from_camera.inverse.apply(thing.vertices), view.camera)
        rows, columns = np.nonzero(view.mask)
        # the mask's box is the box of the projected vertices, to a pixel of either picture
        np.testing.assert_allclose(uv.min(axis=0), [columns.min(), rows.min()], atol=2.0)
        np.testing.assert_allclose(uv.max(axis=0), [columns.max() + 1, rows.max() + 1], atol=2.0)
    local = (observation.points_world - [0.1, 0, 0]) @ np.array(
        [[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]]
    )
    inside = (np.abs(local[:, 0]) < 0.22) & (np.abs(local[:, 1]) < 0.17) & (local[:, 2] < 0.27)
    assert inside.mean() > 0.98


def test_chosen_frames_are_ordered_and_spread_over_directions(bench: Any) -> None:
    _, capture, track = bench.free_box(textured=False)
    chosen = choose_frames(capture, track, 3)
    assert [f.index for f in chosen] == sorted(f.index for f in chosen)
    assert chosen[-1].index - chosen[0].index >= 5


def test_frames_with_an_open_drawer_are_excluded_unless_all_show_it(bench: Any) -> None:
    _, capture, track = bench.free_box(textured=False)
    opened = dict.fromkeys(sorted(track.masks)[::2], 0.2)
    chosen = {f.index for f in choose_frames(capture, replace(track, motions=(motion(opened),)), 8)}
    assert chosen == set(track.masks) - set(opened)
    always = replace(track, motions=(motion(dict.fromkeys(track.masks, 0.2)),))
    assert {f.index for f in choose_frames(capture, always, 8)} == set(track.masks)


def test_rendered_views_surround_the_mesh_with_colour_and_depth(bench: Any) -> None:
    asset, _ = bench.as_candidate(bench.free_box(textured=True)[0], 0)
    views, _, _ = render_views(asset.mesh, count=100, size_px=64)
    assert len(views) == 100
    assert all((v.depth > 0).mean() > 0.1 for v in views)
    assert all(v.image[v.depth > 0].std() > 20 for v in views)
    assert np.linalg.norm(fibonacci_sphere(100).mean(axis=0)) < 0.01


def test_sift_matches_the_same_points_after_a_rotation(bench: Any) -> None:
    image = bench.blotches(np.random.default_rng(3), 200, 200)
    matcher = MATCHERS.load("sift")
    everything = np.ones((200, 200), dtype=bool)
    first, second = matcher.describe(image, everything), matcher.describe(np.rot90(image).copy(), everything)
    pairs = matcher.match(first, second)
    assert len(pairs.first) > 40
    u, v = first.uv_px[pairs.first].T
    turned = np.stack([v, 200 - u], axis=1)  # rot90 in coordinates with pixel centres at i + 0.5
    assert np.median(np.linalg.norm(turned - second.uv_px[pairs.second], axis=1)) < 0.7


def test_keypoints_outside_the_mask_do_not_use_up_the_limit(bench: Any) -> None:
    image = bench.blotches(np.random.default_rng(4), 200, 200)
    mask = np.zeros((200, 200), dtype=bool)
    mask[60:140, 60:140] = True
    image[mask] = 128 + (image[mask].astype(int) - 128) // 2  # fainter than its surroundings
    found = SiftMatcher(keypoints=20).describe(image, mask)
    assert len(found.uv_px) == 20
    assert mask[found.uv_px[:, 1].astype(int), found.uv_px[:, 0].astype(int)].all()


def test_matching_without_keypoints_is_empty() -> None:
    matcher = MATCHERS.load("sift")
    plain = matcher.describe(np.full((64, 64, 3), 128, np.uint8), np.ones((64, 64), dtype=bool))
    assert len(plain.uv_px) == 0
    assert len(matcher.match(plain, plain).first) == 0


def lifted_from(frame: int, mesh: np.ndarray, world: np.ndarray) -> Lifted:
    """Matches seen from the origin with 6 mm of depth noise and pixels of 2 mm."""
    rays = world / np.maximum(np.linalg.norm(world, axis=1, keepdims=True), 1e-9)
    return Lifted(frame, mesh, world, np.full(len(mesh), 0.006), rays, np.full(len(mesh), 0.002))


def make_lifted(truth: Similarity3, frame: int, good: int, bad: int, seed: int) -> Lifted:
    rng = np.random.default_rng(seed)
    mesh = rng.uniform(-0.5, 0.5, (good + bad, 3))
    world = truth.apply(mesh) + rng.normal(0, 0.003, mesh.shape)
    world[good:] = truth.apply(rng.uniform(-0.5, 0.5, (bad, 3)))
    return lifted_from(frame, mesh, world)


def test_a_frame_with_wrong_matches_is_outvoted() -> None:
    truth = Similarity3(0.7, Rotation.random(random_state=1).as_matrix(), np.array([1.0, 2.0, 0.5]))
    misled = Similarity3(0.7, Rotation.random(random_state=2).as_matrix(), np.array([1.0, 2.0, 0.5]))
    lifted = [make_lifted(truth, f, 15, 30, f) for f in (3, 8, 12)] + [make_lifted(misled, 20, 25, 5, 9)]
    votes = vote(lifted, 1.7, (0.3, 2.0), np.random.default_rng(0))
    best = votes.hypotheses[0]
    assert np.degrees(Rotation.from_matrix(best.rotation.T @ truth.rotation).magnitude()) < 1.5
    assert best.scale == pytest.approx(truth.scale, rel=0.02)
    assert max(votes.by_frame[f] for f in (3, 8, 12)) > votes.by_frame[20]


def test_frames_with_three_inliers_each_give_the_pose_together() -> None:
    truth = Similarity3(0.7, Rotation.random(random_state=3).as_matrix(), np.array([1.0, 2.0, 0.5]))
    lifted = [make_lifted(truth, f, 3, 12, f) for f in range(8)]
    best = vote(lifted, 1.7, (0.3, 2.0), np.random.default_rng(0)).hypotheses[0]
    assert np.degrees(Rotation.from_matrix(best.rotation.T @ truth.rotation).magnitude()) < 1.5
    assert best.scale == pytest.approx(truth.scale, rel=0.02)


def test_no_matches_give_no_hypothesis() -> None:
    empty = lifted_from(4, np.zeros((0, 3)), np.zeros((0, 3)))
    votes = vote([empty], 1.0, (0.1, 10.0), np.random.default_rng(0))
    assert votes.hypotheses == ()
    assert votes.by_frame == {4: 0}
