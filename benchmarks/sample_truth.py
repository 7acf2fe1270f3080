"""Exact ground truth of a synthetic recording: poses, surfaces, depth at colour size."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.geometry.registration import umeyama
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Frame
from r2c2r_core.synthetic.atlas import LitScene, light_scene
from r2c2r_core.synthetic.build import build_kitchen
from r2c2r_core.synthetic.layout import plan_kitchen
from r2c2r_core.synthetic.path import walk
from r2c2r_core.synthetic.render import facing_faces
from r2c2r_core.synthetic.truth import capture_from_kitchen

_AHEAD_M = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 1.0], [0.5, 0.0, 1.5], [0.0, 0.5, 1.5]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampleTruth:
    """A sample's kitchen and camera path, regenerated from its seed."""

    scene: LitScene
    capture_from_kitchen: Rigid3
    poses: tuple[Rigid3, ...]  # capture_from_camera, by frame number
    surface: Any  # Open3D's ray-casting scene of it, in the kitchen's frame

    def depth(self, frame: int, camera: Intrinsics) -> np.ndarray:
        """Exact z-depth (h, w); 0 where there is no surface."""
        camera_from_kitchen = (self.capture_from_kitchen.inverse @ self.poses[frame]).inverse
        faces = facing_faces(self.scene, camera_from_kitchen)
        return rasterize(self.scene.vertices, faces, self.scene.attributes, camera, camera_from_kitchen).depth_m.astype(
            np.float32
        )

    def distance_m(self, points_capture: Points) -> np.ndarray:
        """Distance of points to the nearest true surface, in metres."""
        import open3d as o3d

        points = self.capture_from_kitchen.inverse.apply(points_capture).astype(np.float32)
        return self.surface.compute_distance(o3d.core.Tensor(np.ascontiguousarray(points)), nthreads=1).numpy()


def sample_truth(seed: int, frames: int) -> SampleTruth:
    """The truth of `r2c2r sample --seed SEED --frames FRAMES`."""
    kitchen = plan_kitchen(seed)
    shots = walk(kitchen, frames, np.random.default_rng([seed, 3]))
    placed = capture_from_kitchen(kitchen, shots[0].kitchen_from_camera.translation)
    scene = light_scene(build_kitchen(kitchen), np.random.default_rng([seed, 2]))
    return SampleTruth(
        scene=scene,
        capture_from_kitchen=placed,
        poses=tuple(placed @ shot.kitchen_from_camera for shot in shots),
        surface=_castable(scene),
    )


def pose_errors(frames: Sequence[Frame], truth: Mapping[int, Rigid3]) -> dict[str, float]:
    """RMS errors after the best rigid alignment: of the camera centres (mm), and of points 1 to 2 m ahead (mm)."""
    found = [f.world_from_camera for f in frames]
    wanted = [truth[f.index] for f in frames]
    centres = _rms(np.array([p.translation for p in found]), np.array([p.translation for p in wanted]))
    ahead = _rms(np.concatenate([p.apply(_AHEAD_M) for p in found]), np.concatenate([p.apply(_AHEAD_M) for p in wanted]))
    return {"centres_mm": round(1000 * centres, 2), "points_ahead_mm": round(1000 * ahead, 2)}


def _castable(scene: LitScene) -> Any:
    import open3d as o3d

    surface: Any = o3d.t.geometry.RaycastingScene()
    surface.add_triangles(
        o3d.core.Tensor(np.ascontiguousarray(scene.vertices, dtype=np.float32)),
        o3d.core.Tensor(np.ascontiguousarray(scene.faces, dtype=np.uint32)),
    )
    return surface


def _rms(found: Points, wanted: Points) -> float:
    placed = umeyama(found, wanted, scale=1.0).apply(found)
    return float(np.sqrt(np.mean(np.sum((placed - wanted) ** 2, axis=1))))
