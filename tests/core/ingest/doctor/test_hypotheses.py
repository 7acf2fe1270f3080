"""Each usual mistake in interpreting a recording is identified; a correct recording is not flagged."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL
from r2c2r_core.ingest.doctor.hypotheses import find_convention, find_scale
from r2c2r_core.ingest.doctor.pairs import Views, compare, far_pairs, neighbours
from tests.core.ingest.doctor.corner import views_of

Damage = Callable[[Views], Views]


def inverted(views: Views) -> Views:
    rotation = np.swapaxes(views.rotation, 1, 2)
    return views.posed(rotation, -np.einsum("vij,vj->vi", rotation, views.translation))


def transposed(views: Views) -> Views:
    return views.posed(np.swapaxes(views.rotation, 1, 2), views.translation)


def flipped(views: Views) -> Views:
    return views.posed(views.rotation @ CAMERA_CV_FROM_GL, views.translation)


def quaternions_reordered(views: Views) -> Views:
    quat_xyzw = Rotation.from_matrix(views.rotation).as_quat()
    return views.posed(Rotation.from_quat(quat_xyzw[:, [3, 0, 1, 2]]).as_matrix(), views.translation)


def mirrored(views: Views) -> Views:
    mirror = np.diag([-1.0, 1.0, 1.0])
    return views.posed(mirror @ views.rotation @ mirror, views.translation @ mirror)


@pytest.mark.parametrize(
    ("damage", "cause"),
    [
        (inverted, "poses_inverted"),
        (transposed, "rotation_transposed"),
        (flipped, "camera_axes"),
        (quaternions_reordered, "quaternion_order"),
        (mirrored, "poses_mirrored"),
    ],
)
def test_a_wrong_pose_convention_is_identified_and_corrected(damage: Damage, cause: str) -> None:
    views = views_of(16)
    finding, mended = find_convention(damage(views), neighbours(views), ())
    assert finding is not None
    assert finding.cause == cause
    assert finding.agreement_so > finding.agreement_given + 0.1
    np.testing.assert_allclose(mended.rotation, views.rotation, atol=1e-9)
    np.testing.assert_allclose(mended.translation, views.translation, atol=1e-9)


@pytest.mark.parametrize(
    ("first", "then", "causes"),
    [
        (inverted, mirrored, {"inverted", "mirrored"}),
        (mirrored, quaternions_reordered, {"mirrored", "wrong order"}),
        (quaternions_reordered, inverted, {"wrong order", "inverted"}),
        (flipped, transposed, {"flipped", "transposed"}),
        (flipped, mirrored, {"flipped", "mirrored"}),
    ],
)
def test_two_wrong_pose_conventions_at_once_are_both_named(first: Damage, then: Damage, causes: set[str]) -> None:
    views = views_of(16)
    finding, mended = find_convention(then(first(views)), neighbours(views), ())
    assert finding is not None
    assert {cause for cause in causes if cause in finding.text} == causes
    assert compare(mended, neighbours(views)).agreement == pytest.approx(compare(views, neighbours(views)).agreement)


def test_poses_shifted_by_frames_are_reported_with_the_shift() -> None:
    views = views_of(16)
    late = views.posed(np.roll(views.rotation, 3, axis=0), np.roll(views.translation, 3, axis=0))
    finding, _ = find_convention(late, neighbours(views), [(3, (views.rotation, views.translation))])
    assert finding is not None
    assert finding.cause == "frames_shifted"
    assert "3 later" in finding.text


def test_a_cause_that_leaves_the_frames_apart_is_not_named() -> None:
    views = inverted(transposed(quaternions_reordered(views_of(16))))  # no two of them explain it
    assert find_convention(views, neighbours(views), ()) == (None, views)
    assert find_scale(views, far_pairs(views, 12)) is None


def test_a_correctly_interpreted_recording_has_no_finding() -> None:
    views = views_of(16)
    finding, same = find_convention(views, neighbours(views), ())
    assert finding is None
    assert same is views
    assert find_scale(views, far_pairs(views, 12)) is None


@pytest.mark.parametrize("factor", [0.1, 0.85, 1.18, 5.0])
def test_a_wrong_depth_scale_is_reported_with_its_factor(factor: float) -> None:
    views = views_of(16)
    pairs = far_pairs(views, 12)
    wrong = replace(views, depth_m=views.depth_m / factor, point_z=views.point_z / factor)
    finding = find_scale(wrong, pairs)
    assert finding is not None
    assert finding.cause == "depth_scale"
    assert finding.factor == pytest.approx(factor, rel=0.03)  # three hundredths: the step between tried scales, and noise
    assert finding.error_so_mm is not None
    assert finding.error_so_mm < 20


def test_no_wrong_scale_is_reported_without_a_wide_baseline() -> None:
    views = views_of(16)
    wrong = replace(views, depth_m=views.depth_m / 1.2, point_z=views.point_z / 1.2)
    assert find_scale(wrong, far_pairs(views, 12)[:3]) is None
