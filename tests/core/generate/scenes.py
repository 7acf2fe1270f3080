"""Small rendered scans with ground truth: coloured solids before a wall, recorded by a simulated phone LiDAR."""

from dataclasses import dataclass

import cv2
import numpy as np

from r2c2r_core.generate.boxed import front_hypotheses
from r2c2r_core.generate.lathe import lathe_mesh
from r2c2r_core.generate.symmetry import Revolution
from r2c2r_core.generate.things import thing_hypotheses
from r2c2r_core.generate.variation import whole_pool
from r2c2r_core.generate.vessel import VesselHandle, vessel_mesh
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import pack_mask
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.geometry.raster import rasterize, subdivide_long_edges
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.model.capture import Capture, Depth, Frame, Room, SceneSurface, Wall
from r2c2r_core.model.track import FrontHandle, FrontPanel, MaskTrack, ThingBox

RGB = Intrinsics(fx=360.0, fy=360.0, cx=240.0, cy=180.0, width=480, height=360)
DEPTH = RGB.resized(256, 192)
WALL_Y = 0.60
HANDLE = FrontHandle(left_m=-0.08, right_m=0.08, bottom_m=0.20, top_m=0.215, protrusion_m=0.035, confidence=0.9)


@dataclass
class Solid:
    """A coloured mesh; the track's mask covers meshes with `part` 1."""

    vertices: np.ndarray
    faces: np.ndarray
    colour: tuple[int, int, int]
    part: int


class RenderedImages:
    """Pixels kept in memory."""

    def __init__(self, rgb, depth):
        self._rgb, self._depth = rgb, depth

    def rgb(self, frame_index):
        return self._rgb[frame_index]

    def depth(self, frame_index):
        metres = self._depth[frame_index]
        return Depth(metres, metres > 0)


def box(low, high, colour, part):
    return Solid(*box_mesh(np.array(low, float), np.array(high, float)), colour, part)


def front_scene(seed=0, noise_m=0.004):
    """A door 0.5 x 0.6 m with a horizontal bar handle and a red mark, its neighbours flush, a wall 0.6 m behind its face."""
    door = box((-0.25, 0, 0.2), (0.25, 0.02, 0.8), (210, 190, 150), 1)
    bar = box((-0.08, -0.035, 0.70), (0.08, -0.025, 0.715), (60, 60, 65), 1)
    posts = [box((x, -0.035, 0.702), (x + 0.012, 0.005, 0.713), (60, 60, 65), 1) for x in (-0.07, 0.058)]
    mark = box((0.08, -0.0005, 0.30), (0.18, 0.001, 0.40), (200, 20, 20), 1)
    beside = [
        box((-0.8, 0, 0.2), (-0.254, 0.5, 0.8), (150, 150, 160), 0),
        box((0.254, 0, 0.2), (0.8, 0.5, 0.8), (150, 150, 160), 0),
        box((-0.8, 0.05, 0.0), (0.8, 0.5, 0.196), (90, 90, 90), 0),
        box((-0.85, -0.02, 0.804), (0.85, WALL_Y, 0.84), (120, 90, 60), 0),
    ]
    capture, masks = scan([door, bar, *posts, mark, *beside], target=(0, 0, 0.5), distance=1.3, seed=seed, noise_m=noise_m)
    panel = FrontPanel(
        world_from_front=Rigid3(np.eye(3), np.array([0.0, 0.0, 0.5])), width_m=0.5, height_m=0.6, handle=HANDLE, confidence=0.9
    )
    return capture, track("door_1", "cabinet", "front", masks, front=panel)


def appliance_scene(seed=0, *beside):
    """A microwave 0.46 x 0.34 x 0.28 m on a counter, with a vertical bar handle, and what stands beside it."""
    body = box((-0.23, 0, 0.9), (0.23, 0.34, 1.18), (70, 72, 75), 1)
    bar = box((0.08, -0.04, 0.95), (0.095, 0.005, 1.13), (220, 220, 220), 1)
    counter = box((-0.8, -0.15, 0.86), (0.8, WALL_Y, 0.9), (150, 110, 70), 0)
    capture, masks = scan([body, bar, counter, *beside], target=(0, 0.1, 1.04), distance=1.1, seed=seed)
    handle = FrontHandle(left_m=0.08, right_m=0.095, bottom_m=-0.09, top_m=0.09, protrusion_m=0.04, confidence=0.9)
    panel = FrontPanel(
        world_from_front=Rigid3(np.eye(3), np.array([0.0, 0.0, 1.04])),
        width_m=0.46,
        height_m=0.28,
        handle=handle,
        confidence=0.9,
    )
    thing = ThingBox(
        world_from_object=Rigid3(np.eye(3), np.array([0.0, 0.17, 1.04])),
        dimensions_m=np.array([0.46, 0.34, 0.28]),
        support_z_m=0.9,
        depth_seen=True,
    )
    return capture, track("microwave_1", "microwave", "appliance", masks, front=panel, box=thing)


def bottle_scene(seed=0):
    """A bottle of radius 4 cm, 28 cm high, on a counter, with a label that ends at the neck's shoulder."""
    heights = np.array([0.9, 1.09, 1.13, 1.18])
    glass = Solid(*lathe_mesh(Revolution(np.zeros(2), heights, np.array([0.04, 0.04, 0.015, 0.015]))), (40, 120, 60), 1)
    counter = box((-0.8, -0.3, 0.86), (0.8, WALL_Y, 0.9), (150, 110, 70), 0)
    capture, masks = scan([glass, counter], target=(0, 0, 1.04), distance=0.9, seed=seed)
    thing = ThingBox(  # measured on visible points: the back half is missing
        world_from_object=Rigid3(np.eye(3), np.array([0.0, -0.012, 1.04])),
        dimensions_m=np.array([0.078, 0.055, 0.27]),
        support_z_m=0.9,
    )
    return capture, track("bottle_1", "bottle", "thing", masks, box=thing)


def mug_scene(azimuth_rad, seed=0):
    """A mug of radius 4 cm, 9 cm high, on a counter, with a handle; filmed all round from above."""
    body = Revolution(np.zeros(2), np.array([0.9, 0.99]), np.full(2, 0.04))
    handle = None if azimuth_rad is None else VesselHandle(azimuth_rad, 0.028)
    mug = Solid(*vessel_mesh(body, handle), (200, 200, 210), 1)
    counter = box((-0.8, -0.8, 0.86), (0.8, WALL_Y, 0.9), (150, 110, 70), 0)
    views = [(2 * np.pi * k / 10, np.radians(35)) for k in range(10)]
    capture, masks = scan([mug, counter], target=(0, 0, 0.94), distance=0.55, seed=seed, noise_m=0.003, views=views)
    thing = ThingBox(
        world_from_object=Rigid3(np.eye(3), np.array([0.0, 0.0, 0.945])), dimensions_m=np.full(3, 0.09), support_z_m=0.9
    )
    return capture, track("mug", "mug", "thing", masks, box=thing)


def chair_scene(seed=0):
    """A chair 0.42 x 0.42 x 0.9 m from boxes, on the floor."""
    parts = [
        box((-0.21, 0, 0.43), (0.21, 0.42, 0.48), (160, 60, 50), 1),
        box((-0.21, 0.38, 0.48), (0.21, 0.42, 0.9), (60, 90, 170), 1),
        *(box((x, y, 0), (x + 0.045, y + 0.045, 0.43), (90, 60, 40), 1) for x in (-0.21, 0.165) for y in (0.0, 0.375)),
    ]
    capture, masks = scan(parts, target=(0, 0.2, 0.45), distance=1.8, seed=seed, wall_y=1.6)
    thing = ThingBox(
        world_from_object=Rigid3(np.eye(3), np.array([0.0, 0.21, 0.45])),
        dimensions_m=np.array([0.42, 0.42, 0.9]),
        support_z_m=0.0,
    )
    return capture, track("chair_1", "chair", "thing", masks, box=thing)


def storage_bench_scene(seed=0):
    """A closed bench 0.8 x 0.4 x 0.45 m with a back board 0.85 m high, on the floor."""
    parts = [box((-0.4, 0, 0), (0.4, 0.4, 0.45), (160, 60, 50), 1), box((-0.4, 0.36, 0.45), (0.4, 0.4, 0.85), (60, 90, 170), 1)]
    return _on_floor(parts, "storage_bench", np.array([0.8, 0.4, 0.85]), seed)


def desk_scene(seed=0):
    """A desk 1.2 x 0.6 x 0.74 m on a block of drawers and two legs."""
    parts = [
        box((-0.6, 0, 0.7), (0.6, 0.6, 0.74), (160, 60, 50), 1),
        box((0.2, 0.02, 0), (0.58, 0.58, 0.7), (60, 90, 170), 1),
        *(box((-0.6, y, 0), (-0.555, y + 0.045, 0.7), (90, 60, 40), 1) for y in (0.0, 0.555)),
    ]
    return _on_floor(parts, "desk", np.array([1.2, 0.6, 0.74]), seed)


def table_scene(seed=0):
    """A table 1.2 x 0.7 x 0.74 m on four legs 9 cm square."""
    legs = [(x, y) for x in (-0.58, 0.49) for y in (0.02, 0.59)]
    parts = [
        box((-0.6, 0, 0.7), (0.6, 0.7, 0.74), (160, 60, 50), 1),
        *(box((x, y, 0), (x + 0.09, y + 0.09, 0.7), (90, 60, 40), 1) for x, y in legs),
    ]
    return _on_floor(parts, "table", np.array([1.2, 0.7, 0.74]), seed)


def _on_floor(parts, category, size, seed):
    """An object whose front is at y = 0, filmed from the front at some two metres."""
    centre = np.array([0.0, size[1] / 2, size[2] / 2])
    capture, masks = scan(parts, target=centre, distance=2.0, seed=seed, wall_y=1.6)
    thing = ThingBox(world_from_object=Rigid3(np.eye(3), centre), dimensions_m=size, support_z_m=0.0)
    return capture, track(f"{category}_1", category, "thing", masks, box=thing)


def carton_scene(size, *, arc_deg, elevation_deg, yaw_rad, wall_gap_m=0.05, seed=0):
    """A carton on a counter before a wall, filmed along an arc; the segmenter's box is aligned with the room and too deep."""
    turn = rotation_about_z(yaw_rad)
    vertices, faces = box_mesh(-size / 2, size / 2)
    carton = Solid(vertices @ turn.T + [0.0, size[1] / 2, 0.9 + size[2] / 2], faces, (220, 150, 40), 1)
    wall_y = float(carton.vertices[:, 1].max()) + wall_gap_m
    counter = box((-0.8, -0.4, 0.86), (0.8, wall_y, 0.9), (150, 110, 70), 0)
    middle = np.array([0.0, size[1] / 2, 0.9 + size[2] / 2])
    views = [(np.radians(arc_deg) * (k / 9 - 0.5), np.radians(elevation_deg)) for k in range(10)]
    capture, masks = scan([carton, counter], target=middle, distance=1.2, seed=seed, wall_y=wall_y, views=views)
    thing = ThingBox(
        world_from_object=Rigid3(np.eye(3), middle + np.array([0.0, 0.07, 0.0])),
        dimensions_m=np.array([1.05 * size[0], size[1] + 0.14, size[2]]),
        support_z_m=0.9,
    )
    return capture, track("carton_1", "box", "thing", masks, box=thing)


def box_shape(evidence, variation):
    """The shape of the likeliest hypothesis about a front or an appliance."""
    return front_hypotheses(evidence, evidence.track.front)[0].shape(variation)


def best_thing(evidence, variation=None):
    """Shape of an object's likeliest hypothesis, from all frames or from those of a variation."""
    everything = whole_pool(evidence)
    return thing_hypotheses(evidence, everything)[0].shape(variation or everything)


def track(name, category, kind, masks, *, front=None, box=None):
    packed = {index: pack_mask(mask) for index, mask in masks.items() if mask.any()}
    return MaskTrack(
        name=name,
        category=category,
        masks=packed,
        confidence=dict.fromkeys(packed, 0.9),
        front=front,
        box=box,
        kind=kind,
        backend="truth",
        prompt_count=1,
        warnings=(),
    )


def scan(solids, *, target, distance, seed, noise_m=0.004, count=10, wall_y=WALL_Y, views=None):
    """A capture of the solids before a wall and on a floor, and the masks of part 1 at RGB resolution."""
    rng = np.random.default_rng(seed)
    room = [
        box((-3, wall_y, 0), (3, wall_y + 0.02, 2.5), (225, 220, 210), 0),
        box((-3, -3, -0.02), (3, wall_y, 0), (120, 120, 125), 0),
    ]
    vertices, faces, attributes = _joined([*solids, *room])
    frames, rgb, depth, masks = [], {}, {}, {}
    for k in range(count):
        azimuth, elevation = np.radians(-45 + 90 * k / (count - 1)), np.radians(rng.uniform(8, 35))
        azimuth, elevation = (azimuth, elevation) if views is None else views[k]
        pose = looking_at(np.array(target, float), azimuth, elevation, distance * rng.uniform(0.9, 1.1))
        index = 3 * k
        picture = rasterize(vertices, faces, attributes[:, :3], RGB, pose.inverse)
        parts = rasterize(vertices, faces, np.repeat(attributes[:, 3:], 3, axis=1), RGB, pose.inverse)
        rgb[index] = picture.attributes.clip(0, 255).astype(np.uint8)
        masks[index] = parts.attributes[..., 0] > 0.5
        clean = rasterize(vertices, faces, attributes[:, :3], DEPTH, pose.inverse).depth_m
        blur = cv2.GaussianBlur(rng.normal(size=clean.shape).astype(np.float32), (0, 0), 1.0) * 3.0
        depth[index] = np.where(clean > 0, clean + noise_m * blur, 0).astype(np.float32)
        frames.append(
            Frame(
                index=index,
                timestamp_s=None,
                rgb_camera=RGB,
                depth_camera=DEPTH,
                world_from_camera=pose,
                sharpness=float(rng.uniform(50, 100)),
            )
        )
    wall = Wall(normal=np.array([0.0, -1.0, 0.0]), offset_m=-wall_y, area_m2=5.0)
    return (
        Capture(
            name="rendered",
            sha256="",
            format="test",
            frames=tuple(frames),
            world_from_capture=Rigid3(),
            room=Room(up_source="file", floor_found=True, manhattan_yaw_rad=0.0, walls=(wall,)),
            surface=SceneSurface(
                vertices_world=np.zeros((0, 3)),
                faces=np.zeros((0, 3), np.int64),
                colours=np.zeros((0, 3), np.uint8),
                voxel_m=0.01,
            ),
            images=RenderedImages(rgb, depth),
            notices=(),
        ),
        masks,
    )


def looking_at(target, azimuth, elevation, distance):
    """world_from_camera of a camera south of the target, turned by azimuth to the east."""
    out = np.array([np.sin(azimuth) * np.cos(elevation), -np.cos(azimuth) * np.cos(elevation), np.sin(elevation)])
    right = np.cross(-out, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Rigid3(np.column_stack([right, np.cross(-out, right), -out]), target + distance * out)


def _joined(solids):
    vertices, faces, attributes, start = [], [], [], 0
    for solid in solids:
        colour = np.tile([*solid.colour, solid.part], (len(solid.vertices), 1)).astype(float)
        v, f, a = subdivide_long_edges(solid.vertices, solid.faces, colour, 0.4)
        vertices.append(v)
        faces.append(f + start)
        attributes.append(a)
        start += len(v)
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(attributes)
