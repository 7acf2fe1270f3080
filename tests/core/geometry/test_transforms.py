"""Group laws of the transforms, over random, tiny and identity samples of both groups and their mixtures."""

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest

from r2c2r_core.geometry.transforms import (
    CAMERA_CV_FROM_GL,
    Rigid3,
    Similarity3,
    front_rotation,
    nearest_rotation,
    rotation_about,
    rotation_about_z,
    rotation_between,
    rotation_of,
)

Transform = Rigid3 | Similarity3
ATOL = 1e-9  # of lengths up to about 30 after three products: rounding, with four digits of margin
NUMBERS = {"identity": 0.0, "tiny": 1e-9, "small": 1e-3, "random": 1.0}
"""How far samples are from the identity: rotation vector in rad, translation in metres, logarithm of the scale."""


def turned(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector, rad."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vector).as_matrix())


def rigid(size: float, rng: np.random.Generator) -> Transform:
    return Rigid3(turned(size * 2.0 * rng.normal(size=3)), size * rng.normal(size=3))


def similarity(size: float, rng: np.random.Generator) -> Transform:
    rotation, translation = turned(size * 2.0 * rng.normal(size=3)), size * rng.normal(size=3)
    return Similarity3(float(np.exp(size * rng.uniform(-1, 1))), rotation, translation)


GROUPS: dict[str, Callable[[float, np.random.Generator], Transform]] = {"Rigid3": rigid, "Similarity3": similarity}
PAIRS = list(product(GROUPS, GROUPS))
every_size = pytest.mark.parametrize("size", NUMBERS.values(), ids=NUMBERS)
every_group = pytest.mark.parametrize("group", GROUPS)
every_pair = pytest.mark.parametrize(("first", "second"), PAIRS)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


def product_of(a: Transform, b: Transform) -> Transform:
    return a @ b  # type: ignore[operator]


def is_member(transform: Transform) -> bool:
    """Whether it has a proper rotation and a positive scale."""
    rotation = transform.rotation
    proper = np.allclose(rotation @ rotation.T, np.eye(3), atol=ATOL) and np.linalg.det(rotation) > 0
    return bool(proper) and getattr(transform, "scale", 1.0) > 0


@every_size
@every_pair
def test_a_product_has_the_larger_group_and_the_product_matrix(
    first: str, second: str, size: float, rng: np.random.Generator
) -> None:
    for _ in range(10):
        a, b = GROUPS[first](size, rng), GROUPS[second](size, rng)
        found = product_of(a, b)
        assert isinstance(found, Similarity3 if "Similarity3" in (first, second) else Rigid3)
        assert is_member(found)
        np.testing.assert_allclose(found.matrix, a.matrix @ b.matrix, atol=ATOL)


@every_size
@every_pair
def test_applying_a_product_equals_applying_its_factors_in_turn(
    first: str, second: str, size: float, rng: np.random.Generator
) -> None:
    points = rng.normal(size=(7, 3))
    a, b = GROUPS[first](size, rng), GROUPS[second](size, rng)
    np.testing.assert_allclose(product_of(a, b).apply(points), a.apply(b.apply(points)), atol=ATOL)


@every_group
def test_applying_a_transform_keeps_the_array_shape(group: str, rng: np.random.Generator) -> None:
    a, points = GROUPS[group](1.0, rng), rng.normal(size=(4, 5, 3))
    np.testing.assert_allclose(a.apply(points), a.apply(points.reshape(-1, 3)).reshape(4, 5, 3), atol=ATOL)
    np.testing.assert_allclose(a.apply(points[1, 2]), a.apply(points)[1, 2], atol=ATOL)


@every_size
@pytest.mark.parametrize("groups", list(product(GROUPS, GROUPS, GROUPS)), ids="-".join)
def test_products_are_associative(groups: tuple[str, str, str], size: float, rng: np.random.Generator) -> None:
    a, b, c = (GROUPS[name](size, rng) for name in groups)
    left, right = product_of(product_of(a, b), c), product_of(a, product_of(b, c))
    assert type(left) is type(right)
    np.testing.assert_allclose(left.matrix, right.matrix, atol=ATOL)


@every_size
@every_group
def test_the_identity_leaves_transforms_and_points_unchanged(group: str, size: float, rng: np.random.Generator) -> None:
    a, points = GROUPS[group](size, rng), rng.normal(size=(5, 3))
    for neutral in (Rigid3(), Similarity3(1.0, np.eye(3), np.zeros(3))):
        np.testing.assert_array_equal(neutral.matrix, np.eye(4))
        np.testing.assert_array_equal(neutral.apply(points), points)
        np.testing.assert_allclose(product_of(neutral, a).matrix, a.matrix, atol=ATOL)
        np.testing.assert_allclose(product_of(a, neutral).matrix, a.matrix, atol=ATOL)


@every_size
@every_group
def test_an_inverse_cancels_from_either_side(group: str, size: float, rng: np.random.Generator) -> None:
    for _ in range(10):
        a, points = GROUPS[group](size, rng), rng.normal(size=(5, 3))
        assert type(a.inverse) is type(a)
        np.testing.assert_allclose(product_of(a, a.inverse).matrix, np.eye(4), atol=ATOL)
        np.testing.assert_allclose(product_of(a.inverse, a).matrix, np.eye(4), atol=ATOL)
        np.testing.assert_allclose(a.inverse.inverse.matrix, a.matrix, atol=ATOL)
        np.testing.assert_allclose(a.inverse.apply(a.apply(points)), points, atol=ATOL)


@every_size
@every_pair
def test_the_inverse_of_a_product_reverses_the_inverses(first: str, second: str, size: float, rng: np.random.Generator) -> None:
    a, b = GROUPS[first](size, rng), GROUPS[second](size, rng)
    np.testing.assert_allclose(product_of(a, b).inverse.matrix, product_of(b.inverse, a.inverse).matrix, atol=ATOL)


@every_group
@pytest.mark.parametrize("count", [0, 1, 4])
def test_points_move_like_their_homogeneous_coordinates(group: str, count: int, rng: np.random.Generator) -> None:
    a, points = GROUPS[group](1.0, rng), rng.normal(size=(count, 3))
    homogeneous = np.column_stack([points, np.ones(count)]) @ a.matrix.T
    moved = a.apply(points)
    assert moved.shape == (count, 3)
    np.testing.assert_allclose(moved, homogeneous[:, :3], atol=ATOL)
    np.testing.assert_allclose(moved, np.array([a.apply(p) for p in points]).reshape(count, 3), atol=ATOL)


@every_group
def test_distances_are_multiplied_by_the_scale(group: str, rng: np.random.Generator) -> None:
    a, points = GROUPS[group](1.0, rng), rng.normal(size=(6, 3))
    before = np.linalg.norm(points[:, None] - points[None], axis=-1)
    moved = a.apply(points)
    after = np.linalg.norm(moved[:, None] - moved[None], axis=-1)
    np.testing.assert_allclose(after, getattr(a, "scale", 1.0) * before, atol=ATOL)


def test_directions_are_rotated_without_translation(rng: np.random.Generator) -> None:
    a = Rigid3(turned(rng.normal(size=3)), rng.normal(size=3))
    ends = rng.normal(size=(2, 5, 3))
    np.testing.assert_allclose(a.turn(ends[1] - ends[0]), a.apply(ends[1]) - a.apply(ends[0]), atol=ATOL)


def test_from_matrix_restores_a_transform_and_removes_noise(rng: np.random.Generator) -> None:
    a = Rigid3(turned(rng.normal(size=3)), rng.normal(size=3))
    np.testing.assert_allclose(Rigid3.from_matrix(a.matrix).matrix, a.matrix, atol=ATOL)
    noisy = a.matrix
    noisy[:3, :3] += rng.normal(scale=1e-4, size=(3, 3))
    found = Rigid3.from_matrix(noisy)
    assert is_member(found)
    np.testing.assert_allclose(found.rotation, a.rotation, atol=5e-4)  # the noise, three entries of it at once


def test_the_nearest_rotation_is_proper_idempotent_and_optimal(rng: np.random.Generator) -> None:
    for _ in range(20):
        matrix = rng.normal(size=(3, 3))  # half of them contain a reflection
        found = nearest_rotation(matrix)
        assert is_member(Rigid3(found))
        np.testing.assert_allclose(nearest_rotation(found), found, atol=ATOL)
        others = [found @ turned(vector) for vector in rng.normal(scale=0.3, size=(20, 3))]
        assert np.linalg.norm(found - matrix) <= min(np.linalg.norm(other - matrix) for other in others) + ATOL


def test_rotations_about_z_add_up_and_are_right_handed() -> None:
    np.testing.assert_allclose(rotation_about_z(np.pi / 2) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=ATOL)
    for a, b in [(0.3, 0.4), (2.0, -3.0), (1e-9, 1e-9)]:
        np.testing.assert_allclose(rotation_about_z(a) @ rotation_about_z(b), rotation_about_z(a + b), atol=ATOL)


def test_rotations_about_an_axis_and_of_a_quaternion_are_those_of_scipy(rng: np.random.Generator) -> None:
    for vector in rng.normal(size=(10, 3)):
        angle = float(np.linalg.norm(vector))
        axis, half = vector / angle, angle / 2
        np.testing.assert_allclose(rotation_about(axis, angle), turned(vector), atol=ATOL)
        np.testing.assert_allclose(rotation_of(np.array([np.cos(half), *(np.sin(half) * axis)])), turned(vector), atol=ATOL)


@pytest.mark.parametrize("opening_rad", [0.0, 1e-7, 1e-3, 1.0, np.pi - 1e-3, np.pi - 1e-6, np.pi - 1e-9, np.pi])
def test_rotation_between_maps_one_direction_to_another_without_roll(opening_rad: float, rng: np.random.Generator) -> None:
    for _ in range(10):
        source, aside = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
        target = np.cos(opening_rad) * source + np.sin(opening_rad) * aside
        found = rotation_between(3.0 * source, 0.2 * target)
        assert is_member(Rigid3(found))
        np.testing.assert_allclose(found @ source, target, atol=ATOL)
        angle = np.arccos(np.clip((np.trace(found) - 1) / 2, -1, 1))
        assert angle == pytest.approx(opening_rad, abs=1e-7)  # no roll about the direction; arccos is flat at its ends


def test_front_rotation_faces_the_given_direction_and_stays_upright() -> None:
    for yaw in np.linspace(0, 2 * np.pi, 9):
        outward = np.array([np.cos(yaw), np.sin(yaw), 0.4])  # the vertical component is ignored
        rotation = front_rotation(outward)
        assert is_member(Rigid3(rotation))
        np.testing.assert_allclose(rotation @ [0, -1, 0], [np.cos(yaw), np.sin(yaw), 0], atol=ATOL)
        np.testing.assert_allclose(rotation @ [0, 0, 1], [0, 0, 1], atol=ATOL)


def test_opencv_and_opengl_camera_axes_convert_both_ways() -> None:
    np.testing.assert_array_equal(CAMERA_CV_FROM_GL @ CAMERA_CV_FROM_GL, np.eye(3))
    np.testing.assert_array_equal(CAMERA_CV_FROM_GL @ [0, 0, -1], [0, 0, 1])  # both look along the viewing direction
    np.testing.assert_array_equal(CAMERA_CV_FROM_GL @ [0, 1, 0], [0, -1, 0])  # up is -y in OpenCV
