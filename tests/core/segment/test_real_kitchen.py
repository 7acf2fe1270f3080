"""The real kitchen: an eighth of its frames and those with outlines drawn by eye, +-3 px."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.fusion import DepthView, fuse_depth
from r2c2r_core.geometry.masks import mask_iou
from r2c2r_core.geometry.transforms import Rigid3, rotation_between
from r2c2r_core.model.capture import Capture, Depth, Frame, Room, SceneSurface
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.prompts import read_prompts
from r2c2r_core.segment.stage import open_session

DATA = Path(__file__).resolve().parents[3] / "../shared/data/kitchen-7scenes-redkitchen-seq01"
PROMPTS = Path(__file__).resolve().parents[2] / "data/redkitchen-prompts.json"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"needs {DATA.name}")

OUTLINES = json.loads((Path(__file__).resolve().parents[2] / "data/redkitchen-outlines.json").read_text(encoding="utf-8"))[
    "objects"
]


class Images:
    def rgb(self, frame_index: int) -> np.ndarray:
        return np.ascontiguousarray(cv2.imread(str(DATA / f"color/{frame_index:06d}.jpg"))[:, :, ::-1])

    def depth(self, frame_index: int) -> Depth:
        depth = cv2.imread(str(DATA / f"depth/{frame_index:06d}.png"), cv2.IMREAD_UNCHANGED).astype(np.float32) / 1000
        near = cv2.erode(np.where(depth > 0, depth, 99), np.ones((3, 3)))
        valid = (depth > 0) & (depth < 6) & (cv2.dilate(depth, np.ones((3, 3))) - near < 0.02 + 0.06 * depth)
        return Depth(np.where(valid, depth, 0), valid)


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> GeometricSession:
    k = np.loadtxt(DATA / "intrinsics_color.txt")
    camera = Intrinsics(fx=k[0, 0], fy=k[1, 1], cx=k[0, 2] + 0.5, cy=k[1, 2] + 0.5, width=640, height=480)
    level = Rigid3(rotation_between(-np.loadtxt(DATA / "gravity-direction.txt"), np.array([0.0, 0.0, 1.0])), np.zeros(3))
    images = Images()
    clicked = {point.frame for prompt in read_prompts(PROMPTS).objects for point in prompt.points}
    numbers = [int(path.stem) for path in sorted((DATA / "color").glob("*.jpg"))]
    outlined = {int(frame) for drawn in OUTLINES for frame in drawn["frames"]}
    numbers = sorted({*numbers[::8], *clicked, *outlined} & set(numbers))
    frames = []
    for number in numbers:
        pose = level @ Rigid3.from_matrix(np.loadtxt(DATA / f"pose/{number:06d}.txt"))
        grey = cv2.cvtColor(cv2.resize(images.rgb(number), (320, 240), interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY)
        sharpness = float(cv2.Laplacian(grey, cv2.CV_32F).var())
        frames.append(
            Frame(
                index=number,
                timestamp_s=None,
                rgb_camera=camera,
                depth_camera=camera,
                world_from_camera=pose,
                sharpness=sharpness,
            )
        )
    views = (DepthView(images.depth(f.index).metres, camera, f.world_from_camera, images.rgb(f.index)) for f in frames)
    fused = fuse_depth(views, 0.015, depth_max_m=4.0)
    capture = Capture(
        name="kitchen",
        sha256="kitchen",
        format="7-scenes",
        frames=tuple(frames),
        world_from_capture=level,
        room=Room(up_source="file", floor_found=False, manhattan_yaw_rad=0.0, walls=()),
        surface=SceneSurface(vertices_world=fused.vertices, faces=fused.faces, colours=fused.colours, voxel_m=0.015),
        images=images,
        notices=(),
    )
    opened = open_session(capture, tmp_path_factory.mktemp("kitchen"))
    assert isinstance(opened, GeometricSession)
    return opened


QUICK = ("door_3", "controller")  # a front and the fastest thing; benchmarks/segment_outlines.py measures all


@pytest.mark.parametrize(
    "drawn",
    [pytest.param(d, id=d["name"], marks=() if d["name"] in QUICK else pytest.mark.slow) for d in OUTLINES],
)
def test_one_click_reproduces_hand_drawn_outlines(session: GeometricSession, drawn: dict[str, Any]) -> None:
    frame, x, y = drawn["click"]
    click = PromptPoint(frame=frame, x=float(x), y=float(y), label=1)
    prompt = ObjectPrompt(name=drawn["name"], category=drawn["category"], points=(click,))
    overlaps = []
    for number, polygons in drawn["frames"].items():
        truth = np.zeros((480, 640), np.uint8)
        for value, key in ((1, "on"), (0, "off")):
            for polygon in polygons.get(key, []):
                cv2.fillPoly(truth, [np.array(polygon, np.int32)], value)
        overlaps.append(mask_iou(session.mask_at(prompt, int(number)), truth > 0))
    assert np.mean(overlaps) > 0.78  # a third of the frames fused at 15 mm; benchmarks/segment_outlines.py uses all


@pytest.mark.parametrize(("name", "width_m"), [("door_4", 0.446), ("door_5", 0.446)])
def test_doors_have_catalogue_widths(session: GeometricSession, name: str, width_m: float) -> None:
    panel = session.find(next(p for p in read_prompts(PROMPTS).objects if p.name == name)).panel()
    assert panel is not None
    assert panel.width_m == pytest.approx(width_m, abs=0.015)  # poses are off by 13 mm
    assert panel.handle is not None
    assert not panel.handle.is_vertical
    assert panel.handle.centre[1] > 0.2


@pytest.mark.parametrize("names", [("door_4", "door_5"), pytest.param(None, marks=pytest.mark.slow, id="all")])
def test_no_motion_is_reported_where_everything_is_closed(session: GeometricSession, names: tuple[str, ...] | None) -> None:
    asked = [prompt for prompt in read_prompts(PROMPTS).objects if names is None or prompt.name in names]
    assert asked
    for prompt in asked:
        assert session.find(prompt).motions() == (), prompt.name
