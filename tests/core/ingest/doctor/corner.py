"""Exact ray-cast views of a corner of a room: a floor, two walls and a box before them."""

import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.camera import Intrinsics, pixel_centres, pixel_rays
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.doctor.pairs import Views

CAMERA = Intrinsics(fx=140.0, fy=140.0, cx=80.0, cy=60.0, width=160, height=120)
_BOX = np.array([[0.4, 1.2, 0.0], [1.0, 1.8, 0.9]])  # low and high corner, metres
_UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def poses(count: int) -> list[Rigid3]:
    """Poses of a camera carried 1.6 m along the corner while it turns and nods a little."""
    share = np.linspace(0, 1, count)
    turns = Rotation.from_euler("zx", np.column_stack([25 - 55 * share, -12 + 8 * np.sin(9 * share)]), degrees=True)
    places = np.column_stack([-0.2 + 1.6 * share, -0.6 + 0.5 * share**2, 1.3 + 0.2 * np.sin(5 * share)])
    return [Rigid3(turn @ _UPRIGHT, place) for turn, place in zip(turns.as_matrix(), places, strict=True)]


def depth_at(pose: Rigid3) -> np.ndarray:
    """Depth (h, w) of the corner y = 3, x = 2.5, z = 0 and the box in it."""
    rays = pixel_rays(pixel_centres(CAMERA), CAMERA) @ pose.rotation.T
    eye = pose.translation
    with np.errstate(divide="ignore", invalid="ignore"):
        walls = [(3.0 - eye[1]) / rays[..., 1], (2.5 - eye[0]) / rays[..., 0], -eye[2] / rays[..., 2]]
        slabs = np.sort((_BOX[:, None, None] - eye) / rays, axis=0)
    near, far = slabs[0].max(axis=-1), slabs[1].min(axis=-1)
    box = np.where((near < far) & (near > 0), near, np.inf)
    depth = np.min([np.where(wall > 0, wall, np.inf) for wall in walls] + [box], axis=0)
    return np.asarray(depth, dtype=np.float64)


def views_of(count: int = 12, seed: int = 0) -> Views:
    """The views as stacked from a recording, with exact depth."""
    rng, placed = np.random.default_rng(seed), poses(count)
    depth = np.stack([depth_at(pose) for pose in placed])
    row, column = rng.integers(0, CAMERA.height, (count, 700)), rng.integers(0, CAMERA.width, (count, 700))
    return Views(
        position=np.arange(count),
        depth_m=depth,
        focal=np.tile([CAMERA.fx, CAMERA.fy], (count, 1)),
        centre=np.tile([CAMERA.cx, CAMERA.cy], (count, 1)),
        rotation=np.stack([pose.rotation for pose in placed]),
        translation=np.stack([pose.translation for pose in placed]),
        point_uv=np.stack([column, row], axis=2) + 0.5,
        point_z=depth[np.arange(count)[:, None], row, column],
    )
