import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.geometry.visibility import DepthNoise
from r2c2r_core.ingest.noise import estimate_depth_noise
from r2c2r_core.model.capture import Depth, Frame

CAMERA = Intrinsics(fx=100.0, fy=100.0, cx=64.0, cy=48.0, width=128, height=96)
RAMP = np.array([[-4.0, -3.0, 1.0], [4.0, -3.0, 1.0], [4.0, 3.0, 4.0], [-4.0, 3.0, 4.0]])  # closer at the top of the image
FACES = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 2], [0, 2, 3]])


class _Noisy:
    """The ramp's depth with noise of known sigma, independent in every frame."""

    def __init__(self, noise: DepthNoise, wrong_share: float = 0.0) -> None:
        self.noise, self.wrong_share = noise, wrong_share

    def depth(self, frame_index: int) -> Depth:
        rng = np.random.default_rng(frame_index)
        v = (np.arange(96) + 0.5 - CAMERA.cy) / CAMERA.fy
        z = np.broadcast_to((2.5 / (1.0 - 0.5 * v))[:, None], (96, 128))  # the plane z = 2.5 + y / 2
        seen = z + rng.normal(size=z.shape) * self.noise.sigma(z)
        seen = np.where(rng.random(z.shape) < self.wrong_share, z - 0.5, seen)
        return Depth(seen.astype(np.float32), np.ones(z.shape, bool))

    def rgb(self, frame_index: int) -> np.ndarray:
        raise NotImplementedError


def _frames(count: int) -> list[Frame]:
    return [
        Frame(index=k, timestamp_s=None, rgb_camera=CAMERA, depth_camera=CAMERA, world_from_camera=Rigid3(), sharpness=1.0)
        for k in range(count)
    ]


@pytest.mark.parametrize(("floor_m", "per_m"), [(0.004, 0.003), (0.0, 0.006), (0.01, 0.0)])
def test_the_depth_noise_model_is_recovered_from_simulated_frames(floor_m: float, per_m: float) -> None:
    true = DepthNoise(floor_m=floor_m, per_m=per_m)
    found = estimate_depth_noise(_frames(6), _Noisy(true), RAMP, FACES)
    z = np.array([1.8, 2.5, 3.2])
    np.testing.assert_allclose(found.sigma(z), true.sigma(z), rtol=0.05)  # six frames of 12,000 pixels


def test_moving_objects_do_not_bias_the_depth_noise_estimate() -> None:
    true = DepthNoise()
    found = estimate_depth_noise(_frames(6), _Noisy(true, wrong_share=0.2), RAMP, FACES)
    np.testing.assert_allclose(found.sigma(2.5), true.sigma(2.5), rtol=0.05)


def test_a_scan_without_a_surface_keeps_the_default_depth_noise() -> None:
    assert estimate_depth_noise(_frames(2), _Noisy(DepthNoise()), np.zeros((0, 3)), np.zeros((0, 3), int)) == DepthNoise()
