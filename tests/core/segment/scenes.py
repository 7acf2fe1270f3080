"""A small kitchen of coloured boxes with known panels, filmed by a few exact cameras; each scene is made once per process."""

from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.fusion import DepthView, fuse_depth
from r2c2r_core.geometry.raster import rasterize, subdivide_long_edges
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.model.capture import Capture, Depth, Frame, Room, SceneSurface, Wall
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint

WIDTH, HEIGHT = 480, 360
GAP_M = 0.003
FRONT_Y = -0.60
TOP_M, BOTTOM_M = 0.86, 0.12
# left edge and width of each column of fronts
DOORS = {"door_a": (0.0, 0.50), "door_b": (0.503, 0.50), "door_c": (1.006, 0.40)}
DRAWERS = {
    "drawer_top": (1.409, 0.45, 0.66, 0.20),
    "drawer_mid": (1.409, 0.45, 0.36, 0.297),
    "drawer_low": (1.409, 0.45, 0.12, 0.237),
}
PARCEL_M = ((1.50, 0.04, 0.39), (1.66, 0.18, 0.63))
"""Corners of a parcel in the middle drawer, closed: y from the drawer's front."""
OUT_M = 0.25
"""Opening of the middle drawer."""
Corners = tuple[tuple[float, float, float], tuple[float, float, float]]
Named = tuple[tuple[float, ...], tuple[float, ...], tuple[int, int, int], str | None]
TABLE: Corners = ((-0.6, -0.35, 0.0), (0.6, 0.35, 0.73))
CHAIR: Corners = ((0.05, -0.80, 0.0), (0.47, -0.42, 0.90))
LEVEL = Rigid3()
POST = (0.62, 0.72)  # x range of a post in front of door_b


@dataclass(frozen=True)
class Pixels:
    """The recording's images, in memory."""

    colours: dict[int, np.ndarray]
    depths: dict[int, np.ndarray]

    def rgb(self, frame_index: int) -> np.ndarray:
        return self.colours[frame_index]

    def depth(self, frame_index: int) -> Depth:
        metres = self.depths[frame_index]
        return Depth(metres, metres > 0)


@dataclass(frozen=True)
class Shapes:
    """Triangles with a colour and an object id each."""

    vertices: np.ndarray
    faces: np.ndarray
    colours: np.ndarray
    ids: np.ndarray  # per vertex: 0 none


@cache
def kitchen(
    drawn_out_m: float = 0.0, from_step: int = 0, swung_rad: float = 0.0, raised_m: float = 0.0
) -> tuple[Capture, dict[str, dict[int, np.ndarray]]]:
    """The capture, and the true mask of each named object in each frame; from a step on, the middle drawer is pulled out.

    A parcel lies in that drawer, which cameras see into that are raised. Or door_c is swung open on its left edge; the carcass
    then begins further back.
    """
    poses = [look_at(np.array([x, y, z + raised_m]), np.array(target)) for x, y, z, target in _path()]
    before, after = (_shapes(*state, bool(swung_rad)) for state in ((0.0, 0.0), (drawn_out_m, swung_rad)))
    wall = Wall(normal=np.array([0.0, -1.0, 0.0]), offset_m=0.0, area_m2=4.0)
    return _filmed("boxes", poses, [after if step >= from_step else before for step in range(len(poses))], (wall,))


def parcel_top(drawn_out_m: float) -> tuple[float, float, float]:
    """Middle of the parcel's upper face with its drawer open so far."""
    (left, near, _), (right, far, top) = PARCEL_M
    return (left + right) / 2, FRONT_Y - drawn_out_m + (near + far) / 2, top


def _filmed(
    name: str, poses: list[Rigid3], scenes: list[tuple[Shapes, list[str]]], walls: tuple[Wall, ...]
) -> tuple[Capture, dict[str, dict[int, np.ndarray]]]:
    """Render the scenes, one per pose; the capture, and the true mask of each named object."""
    colours: dict[int, np.ndarray] = {}
    depths: dict[int, np.ndarray] = {}
    truth: dict[str, dict[int, np.ndarray]] = {named: {} for named in scenes[0][1]}
    frames = []
    rgb_camera = Intrinsics(fx=400.0, fy=400.0, cx=WIDTH / 2, cy=HEIGHT / 2, width=WIDTH, height=HEIGHT)
    depth_camera = rgb_camera.resized(WIDTH // 2, HEIGHT // 2)
    rng = np.random.default_rng(5)
    for index, (pose, (shapes, names)) in enumerate(zip(poses, scenes, strict=True)):
        fine = rgb_camera.resized(2 * WIDTH, 2 * HEIGHT)
        picture = rasterize(shapes.vertices, shapes.faces, shapes.colours, fine, pose.inverse)
        small = cv2.resize(picture.attributes, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
        colours[10 * index] = (small + rng.normal(0, 1.5, small.shape)).clip(0, 255).astype(np.uint8)
        seen = rasterize(shapes.vertices, shapes.faces, shapes.colours, depth_camera, pose.inverse).depth_m
        depths[10 * index] = np.where(seen > 0, seen + rng.normal(0, 0.002, seen.shape), 0).astype(np.float32)
        exact = rasterize(shapes.vertices, shapes.faces, np.repeat(shapes.ids[:, None], 3, 1), rgb_camera, pose.inverse)
        label = np.round(exact.attributes[..., 0]).astype(int)
        for number, named in enumerate(names, 1):
            truth[named][10 * index] = label == number
        frames.append(
            Frame(
                index=10 * index,
                timestamp_s=None,
                rgb_camera=rgb_camera,
                depth_camera=depth_camera,
                world_from_camera=pose,
                sharpness=100.0,
            )
        )
    views = [DepthView(depths[f.index], depth_camera, f.world_from_camera, _shrunk(colours[f.index])) for f in frames]
    fused = fuse_depth(views, 0.012, depth_max_m=5.0)
    capture = Capture(
        name=name,
        sha256="test",
        format="test",
        frames=tuple(frames),
        world_from_capture=Rigid3(),
        room=Room(up_source="file", floor_found=True, manhattan_yaw_rad=0.0, walls=walls),
        surface=SceneSurface(vertices_world=fused.vertices, faces=fused.faces, colours=fused.colours, voxel_m=0.012),
        images=Pixels(colours, depths),
        notices=(),
    )
    return capture, truth


@cache
def dining(world_from_scene: Rigid3 = LEVEL) -> tuple[Capture, dict[str, dict[int, np.ndarray]]]:
    """A table with a carton on it, a chair drawn up to it and a hanging box, seen from all around, and their true masks."""
    boxes: list[Named] = [((-2.5, -2.5, -0.02), (2.5, 2.5, 0.0), (120, 100, 80), None)]
    boxes += [((*TABLE[0][:2], TABLE[1][2] - 0.03), TABLE[1], (190, 150, 90), "table")]
    boxes += _legs(TABLE, 0.05, TABLE[1][2] - 0.03, (190, 150, 90), "table")
    boxes += [((-0.1, -0.05, TABLE[1][2]), (0.02, 0.05, TABLE[1][2] + 0.2), (60, 90, 170), "carton")]
    (left, near, _), (right, far, top) = CHAIR
    boxes += [((left, near, 0.42), (right, far, 0.45), (60, 60, 64), "chair")]
    boxes += [((left, near, 0.45), (right, near + 0.03, top), (60, 60, 64), "chair")]
    boxes += _legs(CHAIR, 0.04, 0.42, (60, 60, 64), "chair")
    boxes += [((0.35, 0.85, 0.9), (0.5, 1.0, 1.05), (150, 60, 150), "lamp")]
    ring = [(2.0 * np.cos(a), 2.0 * np.sin(a), 1.5 + 0.2 * np.cos(3 * a)) for a in np.arange(16) / 16 * 2 * np.pi]
    poses = [look_at(np.array(eye), np.array([0.0, -0.2, 0.45])) for eye in ring]
    shapes, names = _packed(boxes, ["table", "carton", "chair", "lamp"])
    shapes = replace(shapes, vertices=world_from_scene.apply(shapes.vertices))
    return _filmed("dining", [world_from_scene @ pose for pose in poses], [(shapes, names)] * len(poses), ())


HOOD_CHIMNEY, HOOD_CANOPY = (0.0, -0.13, 1.85), (0.0, -0.24, 1.65)
"""Points on the front of the chimney and of the canopy, which reaches 11 cm further into the room."""


@cache
def hood() -> tuple[Capture, dict[str, dict[int, np.ndarray]]]:
    """A chimney hood on a wall, seen from below, beside a wall cabinet of its colour, and its true masks."""
    steel = (150, 154, 158)
    boxes: list[Named] = [
        ((-1.2, 0.0, 0.9), (1.2, 0.02, 2.4), (214, 208, 190), None),  # wall
        ((-0.3, HOOD_CANOPY[1], 1.60), (0.3, 0.0, 1.70), steel, "hood"),
        ((-0.12, HOOD_CHIMNEY[1], 1.70), (0.12, 0.0, 2.10), steel, "hood"),
        ((-0.75, -0.35, 1.45), (-0.42, 0.0, 2.15), steel, "cabinet"),
    ]
    eyes = [np.array([x, -1.7, 1.45]) for x in np.linspace(-0.7, 0.8, 8)]
    poses = [look_at(eye, np.array([-0.1, 0.0, 1.8])) for eye in eyes]
    wall = Wall(normal=np.array([0.0, -1.0, 0.0]), offset_m=0.0, area_m2=2.0)
    return _filmed("hood", poses, [_packed(boxes, ["hood", "cabinet"])] * len(poses), (wall,))


GLAZED_M = (0.333, 0.33, 0.6, 1.0)
"""Left edge, width, bottom and height of a glazed door."""
GLAZED_Y = -0.35


@cache
def glazed() -> tuple[Capture, dict[str, dict[int, np.ndarray]]]:
    """Two wall-cabinet doors of two clear panes each between plain ones; no depth and no colour is the glass's own."""
    (left, wide, low, tall), y, white, wood = GLAZED_M, GLAZED_Y, (205, 204, 198), (140, 120, 95)
    high, rail = low + tall, 0.05
    boxes: list[Named] = [
        ((-1.5, 0.0, 0.0), (2.0, 0.02, 2.4), (150, 160, 170), None),  # wall
        ((-0.45, y + 0.02, low), (0.0, 0.0, high), (25, 24, 22), None),
        ((-0.448, y, low), (-0.003, y + 0.018, high), white, "plain"),
        ((0.664, y + 0.02, low), (1.1, 0.0, high), (25, 24, 22), None),
        ((0.667, y, low), (1.1, y + 0.018, high), white, None),
        ((0.0, -0.03, low), (0.664, 0.0, high), wood, None),  # rear board
        ((0.0, y + 0.02, low - 0.018), (0.664, 0.0, low), wood, None),
        ((0.0, y + 0.02, high), (0.664, 0.0, high + 0.018), wood, None),
        ((0.0, y + 0.06, 1.25), (0.664, 0.0, 1.268), (160, 140, 110), None),  # shelf
    ]
    for x in (0.0, left):
        sides = [(x, x + rail, low, high), (x + wide - rail, x + wide, low, high)]
        levels = [(z, z + height) for z, height in ((low, rail), (high - rail, rail), ((low + high) / 2 - 0.012, 0.024))]
        sides += [(x + rail, x + wide - rail, *ends) for ends in levels]
        boxes += [((a, y, c), (b, y + 0.018, d), white, "glazed" if x else None) for a, b, c, d in sides]
    eyes = [np.array([x, -1.9 + 0.2 * abs(x), 1.2 + 0.2 * np.cos(5 * x)]) for x in np.linspace(-0.7, 1.3, 14)]
    poses = [look_at(eye, np.array([0.3 + 0.2 * eye[0], y, 1.1])) for eye in eyes]
    wall = Wall(normal=np.array([0.0, -1.0, 0.0]), offset_m=0.0, area_m2=4.0)
    return _filmed("glazed", poses, [_packed(boxes, ["plain", "glazed"])] * len(poses), (wall,))


BOTTLE = (0.10, -0.35)
"""Plan of the bottle's axis."""
BOTTLE_PROFILE = ((0.04, 0.0), (0.04, 0.16), (0.014, 0.19), (0.014, 0.215))
"""Radius and height of the bottle's corners above the worktop; a cap of another colour goes on to the last height."""
CAP_M, WORKTOP_M = 0.24, 0.90


@cache
def bottle() -> tuple[Capture, dict[str, dict[int, np.ndarray]]]:
    """A bottle with a cap before a wall with a dark patch, beside another one, and their true masks.

    Its colours are those of the patch: only depth and views from several sides distinguish them.
    """
    boxes: list[Named] = [
        ((-1.5, 0.0, 0.0), (2.0, 0.02, 2.4), (200, 202, 198), None),  # wall
        ((-0.06, -0.002, 0.90), (0.06, 0.0, 1.12), (110, 118, 112), None),  # like a shadow on it
        ((-1.5, -0.62, 0.86), (2.0, 0.0, WORKTOP_M), (70, 74, 80), None),
        ((-1.5, -3.5, -0.02), (2.0, 0.0, 0.0), (120, 100, 80), None),
    ]
    shapes, _ = _packed(boxes, [])
    turned = [
        _lathe((*BOTTLE, WORKTOP_M), BOTTLE_PROFILE, (105, 115, 108), 1),
        _lathe((*BOTTLE, WORKTOP_M), (BOTTLE_PROFILE[-1], (0.014, CAP_M)), (60, 62, 150), 1),
        _lathe((0.28, -0.30, WORKTOP_M), BOTTLE_PROFILE, (170, 90, 60), 2),
    ]
    for part in turned:
        shapes = Shapes(
            np.concatenate([shapes.vertices, part.vertices]),
            np.concatenate([shapes.faces, part.faces + len(shapes.vertices)]),
            np.concatenate([shapes.colours, part.colours]),
            np.concatenate([shapes.ids, part.ids]),
        )
    eyes = [np.array([x, -1.25 + 0.2 * abs(x), 1.2 + 0.1 * np.cos(5 * x)]) for x in np.linspace(-0.7, 0.9, 14)]
    poses = [look_at(eye, np.array([*BOTTLE, 1.0])) for eye in eyes]
    wall = Wall(normal=np.array([0.0, -1.0, 0.0]), offset_m=0.0, area_m2=4.0)
    return _filmed("bottle", poses, [(shapes, ["bottle", "other"])] * len(poses), (wall,))


def _lathe(
    foot: tuple[float, float, float], profile: tuple[tuple[float, float], ...], colour: tuple[int, int, int], number: int
) -> Shapes:
    """A body of revolution with a lid, brighter on one side."""
    sides = 32
    angles = np.arange(sides) / sides * 2 * np.pi
    rings = [(radius, z) for radius, z in (*profile, (0.0, profile[-1][1]))]
    at = np.array([(r * np.cos(a), r * np.sin(a), z) for r, z in rings for a in angles]) + foot
    k, j = (grid.ravel() for grid in np.meshgrid(np.arange(len(rings) - 1), np.arange(sides), indexing="ij"))
    a, b = k * sides + j, k * sides + (j + 1) % sides
    faces = np.concatenate([np.column_stack([a, b, b + sides]), np.column_stack([a, b + sides, a + sides])])
    shade = np.tile(0.9 + 0.1 * np.cos(angles), len(rings))[:, None]
    return Shapes(at, faces, np.array(colour) * shade, np.full(len(at), float(number)))


def _legs(box: Corners, width: float, height: float, colour: tuple[int, int, int], name: str) -> list[Named]:
    """Four posts in the corners of a box."""
    (left, near, _), (right, far, _) = box
    return [
        ((x, y, 0.0), (x + width, y + width, height), colour, name) for x in (left, right - width) for y in (near, far - width)
    ]


def click_on(capture: Capture, point_world: tuple[float, float, float], frame_index: int, label: int = 1) -> PromptPoint:
    """The click on a world point's pixel in a frame."""
    frame = capture.frame(frame_index)
    x, y, z = frame.world_from_camera.inverse.apply(np.array([point_world]))[0]
    camera = frame.rgb_camera
    u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
    return PromptPoint(frame=frame_index, x=float(u), y=float(v), label=1 if label else 0)


def prompt(name: str, category: str, *points: PromptPoint) -> ObjectPrompt:
    return ObjectPrompt(name=name, category=category, points=points)


def look_at(eye: np.ndarray, target: np.ndarray) -> Rigid3:
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Rigid3(np.column_stack([right, np.cross(forward, right), forward]), eye)


def _path() -> list[tuple[float, float, float, tuple[float, float, float]]]:
    path = []
    for step in range(14):
        t = step / 13
        path.append((0.0 + 1.9 * t, -2.1 + 0.25 * np.sin(5 * t), 1.15 + 0.25 * np.cos(4 * t), (0.35 + 1.1 * t, FRONT_Y, 0.6)))
    return path


def _shapes(drawn_out_m: float, swung_rad: float, hollow: bool) -> tuple[Shapes, list[str]]:
    boxes: list[Named] = [
        ((-1.5, 0.0, 0.0), (3.5, 0.02, 2.4), (200, 202, 198), None),  # wall
        ((-1.5, -3.5, -0.02), (3.5, 0.0, 0.0), (120, 100, 80), None),  # floor
        ((0.0, FRONT_Y + (0.3 if hollow else 0.02), 0.12), (1.859, 0.0, 0.86), (25, 24, 22), None),  # carcass, dark in the gaps
        ((0.0, FRONT_Y + 0.07, 0.0), (1.859, 0.0, 0.12), (60, 60, 64), None),  # plinth
        ((-0.02, FRONT_Y - 0.02, 0.865), (1.88, 0.0, 0.90), (70, 74, 80), None),  # worktop
        ((POST[0], FRONT_Y - 0.25, 0.0), (POST[1], FRONT_Y - 0.20, 0.70), (40, 120, 60), None),
    ]
    names = list(DOORS) + list(DRAWERS) + ["carton", "parcel"]
    for name, (x, width) in DOORS.items():
        boxes.append(((x, FRONT_Y, BOTTOM_M), (x + width, FRONT_Y + 0.018, TOP_M), (176, 60, 52), name))
        at = x + width - 0.05 if name != "door_b" else x + 0.05
        boxes.append(((at - 0.006, FRONT_Y - 0.036, 0.62), (at + 0.006, FRONT_Y - 0.024, 0.80), (210, 210, 214), name))
    for name, (x, width, z, height) in DRAWERS.items():
        front = FRONT_Y - (drawn_out_m if name == "drawer_mid" else 0.0)
        boxes.append(((x, front, z), (x + width, front + 0.018, z + height), (176, 60, 52), name))
        middle, level = x + width / 2, z + height / 2
        boxes.append(
            (
                (middle - 0.08, front - 0.036, level - 0.006),
                (middle + 0.08, front - 0.024, level + 0.006),
                (210, 210, 214),
                name,
            )
        )
    x, width, z, _ = DRAWERS["drawer_mid"]
    front = FRONT_Y - drawn_out_m
    boxes.append(((x + 0.02, front + 0.018, z + 0.02), (x + width - 0.02, front + 0.24, z + 0.03), (200, 198, 190), None))
    low, high = PARCEL_M
    boxes.append(((low[0], front + low[1], low[2]), (high[0], front + high[1], high[2]), (60, 150, 90), "parcel"))
    boxes.append(((1.0, -0.36, 0.90), (1.12, -0.26, 1.10), (60, 90, 170), "carton"))
    return _packed(boxes, names, swung_rad)


def _packed(boxes: list[Named], names: list[str], swung_rad: float = 0.0) -> tuple[Shapes, list[str]]:
    """Coloured boxes as triangles, with each name's number in `names` as id."""
    vertices, faces, attributes = [], [], []
    count = 0
    for low, high, colour, name in boxes:
        v, f = _box(np.array(low), np.array(high))
        if name == "door_c" and swung_rad:
            v = _swung(v, swung_rad)
        shade = np.array(colour) * np.repeat([0.8, 0.9, 0.9, 0.95, 0.85, 1.0], 4)[:, None]
        number = names.index(name) + 1 if name else 0
        v, f, a = subdivide_long_edges(v, f, np.column_stack([shade, np.full(len(v), number)]), 0.3)
        vertices.append(v)
        faces.append(f + count)
        attributes.append(a)
        count += len(v)
    packed = np.concatenate(attributes)
    return Shapes(np.concatenate(vertices), np.concatenate(faces), packed[:, :3], packed[:, 3]), names


def _swung(vertices: np.ndarray, angle_rad: float) -> np.ndarray:
    """door_c's vertices, swung open about the left edge of its face."""
    hinge = np.array([DOORS["door_c"][0], FRONT_Y, 0.0])
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray((vertices - hinge) @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) + hinge)


def _box(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Six quads with separate vertices, so that each face has its own shade."""
    vertices, faces = [], []
    for axis in range(3):
        a, b = [k for k in range(3) if k != axis]
        for side in (low, high):
            start = len(vertices)
            for s, t in ((low[a], low[b]), (high[a], low[b]), (high[a], high[b]), (low[a], high[b])):
                corner = np.zeros(3)
                corner[axis], corner[a], corner[b] = side[axis], s, t
                vertices.append(corner)
            faces += [[start, start + 1, start + 2], [start, start + 2, start + 3]]
    return np.array(vertices), np.array(faces)


def _shrunk(image: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.resize(image, (WIDTH // 2, HEIGHT // 2), interpolation=cv2.INTER_AREA))
