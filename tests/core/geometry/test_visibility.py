import numpy as np

from r2c2r_core.geometry.camera import Intrinsics, pixel_centres, pixel_rays, project, ray_slopes, sample_through, unproject
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.geometry.visibility import DepthNoise, look_up

CAMERA = Intrinsics(fx=50.0, fy=55.0, cx=31.0, cy=23.5, width=64, height=48)


def test_projection_inverts_unprojection_for_any_array_shape() -> None:
    rng = np.random.default_rng(0)
    for shape in ((), (5,), (4, 3)):
        uv, depth = rng.uniform(0, 40, (*shape, 2)), rng.uniform(0.5, 4.0, shape)
        np.testing.assert_allclose(project(unproject(uv, np.asarray(depth), CAMERA), CAMERA), uv, atol=1e-9)


def test_ray_slopes_match_the_rays_through_pixel_centres() -> None:
    x, y = ray_slopes(np.arange(64), np.arange(48), CAMERA)
    rays = pixel_rays(pixel_centres(CAMERA), CAMERA)
    np.testing.assert_allclose(rays[..., 0], np.broadcast_to(x, (48, 64)))
    np.testing.assert_allclose(rays[..., 1], np.broadcast_to(y[:, None], (48, 64)))


def test_depth_is_looked_up_in_the_pixel_that_contains_the_point() -> None:
    depth = np.arange(48 * 64, dtype=np.float32).reshape(48, 64) + 1.0
    pose = Rigid3(rotation_about_z(0.3), np.array([0.2, -0.1, 0.4]))
    uv = pixel_centres(CAMERA).reshape(-1, 2)[::37] + 0.3
    world = pose.apply(unproject(uv, np.full(len(uv), 2.0), CAMERA))
    z, seen, inside = look_up(world, pose, CAMERA, depth)
    assert inside.all()
    np.testing.assert_allclose(z, 2.0)
    np.testing.assert_array_equal(seen, depth[uv[:, 1].astype(int), uv[:, 0].astype(int)])


def test_points_behind_or_outside_the_camera_are_not_seen() -> None:
    depth = np.ones((48, 64), np.float32)
    points = np.array([[0.0, 0.0, -2.0], [9.0, 0.0, 1.0], [0.0, 0.0, 0.05], [0.0, 0.0, 1.0]])
    _, seen, inside = look_up(points, Rigid3(), CAMERA, depth)
    assert inside.tolist() == [False, False, False, True]
    assert seen.tolist() == [0.0, 0.0, 0.0, 1.0]


def test_an_image_is_sampled_for_a_camera_of_another_resolution() -> None:
    image = np.arange(48 * 63).reshape(48, 63)
    camera = Intrinsics(fx=50.0, fy=55.0, cx=31.0, cy=23.5, width=63, height=48)
    values, inside = sample_through(image, camera, camera.resized(21, 16))  # a third: pixel centres coincide
    assert inside.all()
    np.testing.assert_array_equal(values, image[1::3, 1::3])


def test_depth_is_exactly_one_of_occluded_agreeing_or_seen_through() -> None:
    noise = DepthNoise(floor_m=0.004, per_m=0.003)
    seen = np.linspace(0.5, 3.5, 602)
    z = np.full(602, 2.0)
    verdicts = [noise.occluded(seen, z, 0.03), noise.agrees(seen, z, 0.03), noise.seen_through(seen, z, 0.03)]
    assert (np.sum(verdicts, axis=0) == 1).all()
    reach = 0.03 + 3 * (0.004 + 0.003 * 2.0)
    assert noise.agrees(np.array([2.0 - reach + 1e-6, 2.0 + reach - 1e-6]), np.array([2.0, 2.0]), 0.03).all()
    assert not noise.agrees(np.array([2.0 - reach - 1e-6, 2.0 + reach + 1e-6]), np.array([2.0, 2.0]), 0.03).any()


def test_unknown_depth_is_neither_occluded_agreeing_nor_seen_through() -> None:
    noise, nothing, z = DepthNoise(), np.zeros(4), np.array([-1.0, 0.5, 1.0, 2.0])  # the first one is behind the camera
    assert not (noise.occluded(nothing, z, 0.0) | noise.agrees(nothing, z, 0.0) | noise.seen_through(nothing, z, 0.0)).any()
