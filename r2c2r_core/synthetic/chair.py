"""A wooden chair before a door, drawn into a recording."""

from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.raster import Raster, rasterize
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z

SIZE_M = (0.42, 0.46, 0.86)  # width, depth, height
_GAP_M = (0.12, 0.3)  # between it and the door
_BOXES_M = (  # low and high corners, from the floor below its middle; it faces -Y
    *(((x, y, 0.0), (x + 0.036, y + 0.036, top)) for x in (-0.21, 0.174) for y, top in ((-0.23, 0.43), (0.194, 0.86))),
    ((-0.21, -0.23, 0.43), (0.21, 0.23, 0.46)),
    *(((-0.174, 0.2, z), (0.174, 0.22, z + 0.07)) for z in (0.56, 0.67, 0.78)),
    ((-0.174, 0.2, 0.2), (0.174, 0.22, 0.24)),
)


class Chair(NamedTuple):
    """Triangles of a posed chair in the capture's frame, no vertex shared, and their colours."""

    vertices: np.ndarray  # (3 n, 3)
    colours: np.ndarray  # (3 n, 3) 0..255
    capture_from_chair: Rigid3  # of its box's middle

    def draw(self, camera: Intrinsics, capture_from_camera: Rigid3) -> Raster:
        """Its depth and colours as a camera sees it."""
        faces = np.arange(len(self.vertices)).reshape(-1, 3)
        return rasterize(self.vertices, faces, self.colours, camera, capture_from_camera.inverse)


def place_chair(furniture: list[dict[str, Any]], floor_m: float, rng: np.random.Generator) -> Chair:
    """A chair on the floor (y up) before one of the fronts that reach lowest; `furniture` are objects of a truth file."""
    fronts = [(np.array(each["capture_from_object"]), np.array(each["dimensions_m"])) for each in furniture if each["joints"]]
    bottoms = np.array([pose[1, 3] - size[2] / 2 for pose, size in fronts])
    pose, size = fronts[int(rng.choice(np.flatnonzero(bottoms < bottoms.min() + 0.2)))]
    away = size[1] / 2 + float(rng.uniform(*_GAP_M)) + float(np.hypot(*SIZE_M[:2])) / 2
    at = (pose @ [float(rng.uniform(-0.2, 0.2)) * size[0], -away, 0.0, 1.0])[:3]
    turned = pose[:3, :3] @ rotation_about_z(float(rng.uniform(-0.6, 0.6) + np.pi * rng.integers(2)))
    capture_from_chair = Rigid3(turned, np.array([at[0], floor_m + SIZE_M[2] / 2, at[2]]))
    return Chair(*_triangles(capture_from_chair, rng), capture_from_chair)


def _triangles(capture_from_chair: Rigid3, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    import trimesh

    boxes = [trimesh.creation.box(bounds=bounds) for bounds in _BOXES_M]
    mesh = trimesh.util.concatenate(boxes)
    mesh.apply_translation([0.0, 0.0, -SIZE_M[2] / 2])
    mesh.apply_transform(capture_from_chair.matrix)
    shade = 0.5 + 0.5 * np.clip(mesh.face_normals @ [0.4, 0.8, 0.45], 0.0, 1.0)
    shade *= np.repeat(rng.uniform(0.9, 1.1, len(boxes)), [len(box.faces) for box in boxes])
    wood = np.array([150.0, 105.0, 65.0]) * rng.uniform(0.5, 1.4)
    return mesh.triangles.reshape(-1, 3), np.repeat(np.clip(shade[:, None] * wood, 0, 255), 3, axis=0)
