import numpy as np

from r2c2r_core.geometry.raster import sample_texture
from r2c2r_core.geometry.texels import texture_colours


def test_texels_are_read_at_their_centre_with_v_upwards() -> None:
    texture = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
    uv = np.array([[0.5 / 3, 0.75], [2.5 / 3, 0.25]])
    np.testing.assert_allclose(texture_colours(texture, uv), [texture[0, 0], texture[1, 2]], atol=1e-9)


def test_texture_colours_agree_with_the_image_sampler() -> None:
    rng = np.random.default_rng(0)
    texture = rng.integers(0, 256, (16, 16, 3)).astype(np.uint8)
    uv = rng.uniform(-0.1, 1.1, (16, 16, 2))
    expected = sample_texture(texture, uv).reshape(-1, 3)
    np.testing.assert_allclose(texture_colours(texture, uv.reshape(-1, 2)), expected, atol=5)  # OpenCV rounds weights to 1/32
