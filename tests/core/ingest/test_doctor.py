"""The capture doctor accepts good recordings and names the defect of bad ones."""

import functools
import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.ingest.doctor import CaptureReport, draw_scan, examine, refusal_to_json
from r2c2r_core.ingest.doctor.hypotheses import Finding
from r2c2r_core.ingest.doctor.recorded import measure_timing
from r2c2r_core.ingest.doctor.verdict import judge
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.stage import IngestConfig, read_capture
from r2c2r_core.model.capture import Capture, Depth, Frame

from .corruptions import CORRUPTIONS, Corruption, corrupt_r3d
from .tiny import TinyRoom, write_r3d

# Large enough to align edges in depth with edges in colour
ROOM = TinyRoom(count=24, rgb_size=(240, 320), depth_size=(120, 160), focal=230.0)
CONFIG = IngestConfig(finest_voxel_m=0.03, coarsest_voxel_m=0.03)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("doctor")


@pytest.fixture(scope="module")
def scan(folder):
    return write_r3d(folder / "scan.r3d", ROOM)


@pytest.fixture(scope="module")
def capture(scan, folder) -> Capture:
    return read_capture(scan, folder / "store", CONFIG)


def named(name: str) -> Corruption:
    return next(c for c in CORRUPTIONS if c.name == name)


@pytest.fixture(scope="module")
def report(capture, scan) -> CaptureReport:
    """Report of the good recording."""
    return examine(capture, open_recording(scan))


@pytest.fixture(scope="module")
def corrupted(scan, tmp_path_factory) -> Callable[[str], CaptureReport]:
    """Report of the recording with a defect; each is read once."""

    @functools.cache
    def report_of(name: str) -> CaptureReport:
        folder = tmp_path_factory.mktemp("corrupted")
        bad = corrupt_r3d(named(name), scan, folder / f"{name.replace('/', '')}.r3d")
        return examine(read_capture(bad, folder / "store", CONFIG), open_recording(bad))

    return report_of


def with_frames(capture: Capture, change) -> Capture:
    return replace(capture, frames=tuple(change(k, f) for k, f in enumerate(capture.frames)))


def posed(frame: Frame, pose: Rigid3) -> Frame:
    return replace(frame, world_from_camera=pose)


class Darker:
    """Images with a quarter of the light in alternate groups of six frames."""

    def __init__(self, images) -> None:
        self.images = images

    def rgb(self, index: int) -> np.ndarray:
        image = self.images.rgb(index)
        return (image // 2).astype(np.uint8) if index // 6 % 2 else image

    def depth(self, index: int) -> Depth:
        return self.images.depth(index)


def test_a_good_recording_gets_the_verdict_good(report):
    assert report.verdict == "good", report.reasons
    assert report.reasons == ()
    assert report.convention is None
    assert report.scale is None
    figures = report.figures
    assert figures.frames == 24
    assert figures.pair_error_mm < 8  # a depth pixel is 1.5 cm wide, and the nearest one of the neighbour is used
    assert figures.drift_mm < 8
    assert figures.depth_coverage > 0.9
    assert figures.confidence_shares == (0.0, 0.0, 1.0)
    assert figures.missing_share == figures.without_pose_share == figures.unreadable_share == 0
    assert figures.fps == pytest.approx(60)
    assert figures.camera_height_m == pytest.approx(1.4, abs=0.04)  # the walk rises from 1.35 to 1.45 m
    assert figures.level_heights_m == pytest.approx((0.8,), abs=0.02)  # the box
    assert len(report.moments) == 24
    assert all(0.9 < m.depth_share <= 1 for m in report.moments)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("poses inverted", marks=pytest.mark.slow),
        "OpenGL taken for OpenCV",
        pytest.param("quaternions w first", marks=pytest.mark.slow),
        "depth x0.9",
        "depth in mm",
        "focal length x1.1",
        "dropped frames",
        "some NaN poses",
        "some truncated LZFSE",
        "zero confidence",
    ],
)
def test_a_corrupted_recording_is_reported_with_its_cause(name, corrupted):
    report = corrupted(name)
    assert report.verdict != "good"
    assert report.remarks[0].cause in named(name).causes, report.reasons


@pytest.mark.parametrize(
    "factor", [pytest.param(1000.0, marks=pytest.mark.slow), pytest.param(10.0, marks=pytest.mark.slow), 0.1]
)
def test_depth_in_a_wrong_unit_is_reported_with_the_correcting_option(factor, scan, tmp_path):
    other = Corruption(name="unit", depth=lambda depth, _: depth * np.float32(factor))
    bad = corrupt_r3d(other, scan, tmp_path / "unit.r3d")
    report = examine(read_capture(bad, tmp_path / "store", CONFIG), open_recording(bad))
    assert report.verdict == "unusable"
    assert any(f"--depth-scale {1 / factor:g}" in reason for reason in report.reasons), report.reasons
    mended = read_capture(bad, tmp_path / "mended", replace(CONFIG, depth_scale=1 / factor))
    assert examine(mended).figures.median_depth_m == pytest.approx(1.9, abs=0.3)


def test_an_unusable_recording_is_rejected_with_an_error_report(corrupted):
    name = "all LZFSE truncated"
    with pytest.raises(CaptureError, match=named(name).refusal) as problem:
        corrupted(name)
    document = refusal_to_json(problem.value)
    assert document["verdict"] == "unusable"
    assert document["remarks"][0]["cause"] == "unreadable"
    assert document["figures"] is None


def test_depth_too_far_for_a_room_is_a_unit_and_not_bad_light(report):
    packed = replace(report.figures, depth_coverage=0.12, recorded_depth_m=31.0)  # such as confidence in the upper bits
    assert judge(packed, None, None, None)[0].cause == "depth_unit"


def test_a_wrong_scale_and_focal_length_are_measured(corrupted):
    report = corrupted("depth x0.9")
    assert report.verdict == "unusable"
    depth = report.scale
    assert depth.factor == pytest.approx(1 / 0.9, rel=0.02)
    assert depth.text == "the depth is 10 % too small"  # without a suggested alternative
    assert corrupted("focal length x1.1").scale.factor == pytest.approx(1 / 1.1, rel=0.03)


def test_images_rotated_against_their_poses_are_reported(capture):
    turned = examine(
        with_frames(capture, lambda _, f: posed(f, f.world_from_camera @ Rigid3(rotation_about_z(np.pi / 2), np.zeros(3))))
    )
    assert turned.remarks[0].cause == "image_rotated"


def test_images_with_the_pose_of_the_next_frame_are_reported(folder):
    quick = TinyRoom(count=9)  # with so few frames each step is large
    capture = read_capture(write_r3d(folder / "quick.r3d", quick), folder / "quick", CONFIG)
    poses = [f.world_from_camera for f in capture.frames]
    report = examine(with_frames(capture, lambda k, f: posed(f, poses[min(k + 1, 8)])))
    assert report.remarks[0].cause == "frames_shifted", report.reasons


def test_wrong_colour_focal_length_or_centre_is_reported(capture):
    camera = capture.frames[0].rgb_camera
    longer = replace(camera, fx=1.1 * camera.fx, fy=1.1 * camera.fy)
    report = examine(with_frames(capture, lambda _, f: replace(f, rgb_camera=longer)))
    assert report.remarks[0].cause == "colour_focal_length"
    assert report.registration.focal_factor == pytest.approx(1 / 1.1, rel=0.05)  # a depth pixel is 4 px of 640
    verdicts = {}
    for off_px in (3.0, 9.0):  # a depth pixel of a phone, and more than masks tolerate
        found = judge(report.figures, None, None, replace(report.registration, off_px=off_px, limit_px=2.5))
        verdicts[off_px] = next(remark.verdict for remark in found if remark.cause == "colour_focal_length")
    assert verdicts == {3.0: "usable with care", 9.0: "unusable"}
    beside = replace(camera, cx=camera.cx + 10.0)
    report = examine(with_frames(capture, lambda _, f: replace(f, rgb_camera=beside)))
    assert report.remarks[0].cause == "unregistered"
    assert report.registration.off_px == pytest.approx(20.0, abs=4.0)  # 10 of 320 px are 20 of 640
    assert report.verdict == "unusable"


def test_depth_misaligned_by_a_few_pixels_is_usable_with_care(report):
    slight = replace(report.registration, off_px=2.4, limit_px=2.0, edge_px=2.0, edge_best_px=1.5, focal_only=False)
    remarks = judge(report.figures, None, None, slight)
    assert ("usable with care", "unregistered") in {(r.verdict, r.cause) for r in remarks}


@pytest.mark.parametrize(
    ("numbers", "missing"),
    [
        (range(0, 120, 5), 0.0),  # every fifth frame was exported
        ([n for n in range(0, 120, 5) if n % 15 != 5], 1 / 3),  # a third of those is missing: steps of 5 and of 10
        ([1_000_003 * n + n * n for n in range(24)], 0.0),  # timestamps instead of numbers
    ],
)
def test_only_gaps_in_regular_frame_numbers_count_as_dropped_frames(capture, numbers, missing):
    numbered = replace(capture, frames=tuple(replace(f, index=n) for f, n in zip(capture.frames, numbers, strict=False)))
    assert measure_timing(None, numbered.frames).missing_share == pytest.approx(missing)


def test_a_tracking_jump_is_reported(capture):
    def jump(k, frame):
        pose = frame.world_from_camera
        return posed(frame, Rigid3(pose.rotation, pose.translation + np.array([0.5, 0, 0]) * (k >= 12)))

    report = examine(with_frames(capture, jump))
    assert report.figures.pose_jumps == 1
    assert report.verdict != "good"
    assert any(r.cause == "pose_jumps" for r in report.remarks)


def test_drift_is_measured_where_a_surface_is_observed_again(capture):
    def drift(k, frame):
        share, pose = k / 23, frame.world_from_camera
        turn = Rotation.from_rotvec([0, 0, np.radians(3.0) * share]).as_matrix()
        return posed(frame, Rigid3(turn @ pose.rotation, pose.translation + np.array([0.02, 0.0, 0.15]) * share))

    drifting = examine(with_frames(capture, drift))
    assert drifting.figures.drift_mm > 40
    assert any(r.cause == "drift" for r in drifting.remarks), drifting.reasons


def test_few_frames_missing_floor_and_assumed_up_are_reported(capture):
    poor = replace(capture, frames=capture.frames[:3], room=replace(capture.room, floor_found=False, up_source="assumed"))
    report = examine(poor)
    assert report.verdict == "unusable"
    assert report.remarks[0].cause == "few_frames"
    assert {"no_floor", "up_unknown"} <= {r.cause for r in report.remarks}
    assert examine(replace(capture, frames=capture.frames[:1])).verdict == "unusable"


@pytest.mark.parametrize(
    ("off", "corrected", "verdict"), [(1.1, True, "good"), (5.0, True, "usable with care"), (5.0, False, "usable with care")]
)
def test_a_gravity_error_is_reported_with_its_angle_behind_worse_faults(off, corrected, verdict, capture):
    room = replace(capture.room, up_file_off_deg=off, up_corrected=corrected, floor_found=False)
    few = examine(replace(capture, room=room, frames=capture.frames[:4]))
    assert (few.verdict, few.remarks[0].cause) == ("unusable", "few_frames")
    gravity = next(r for r in few.remarks if r.cause == "gravity_off")
    assert gravity.text.startswith(f"the recording's gravity is {off:.1f}° off its level and upright planes")
    assert gravity.verdict == verdict
    alike = [r.cause for r in few.remarks if r.verdict == verdict]
    assert alike[0] == "gravity_off"  # before the floor, which follows from it


def test_a_small_gravity_error_is_not_reported(capture):
    room = replace(capture.room, up_file_off_deg=0.9, up_corrected=False)
    assert "gravity_off" not in {r.cause for r in examine(replace(capture, room=room)).remarks}


def test_planes_of_wrongly_read_poses_say_nothing_about_gravity(report):
    figures = replace(report.figures, up_file_off_deg=20.0, up_corrected=True)
    inverted = Finding(
        cause="poses_inverted",
        text="the poses are world-to-camera",
        factor=None,
        agreement_given=0.1,
        agreement_so=0.9,
        error_given_mm=None,
        error_so_mm=None,
    )
    causes = {r.cause for r in judge(figures, inverted, None, None)}
    assert "poses_inverted" in causes
    assert "gravity_off" not in causes
    assert "gravity_off" in {r.cause for r in judge(figures, None, None, None)}


def test_an_ambiguous_up_is_reported_with_the_alternative_direction(capture):
    room = replace(capture.room, up_rival_capture=np.array([1.0, 0.0, 0.0]))
    reasons = examine(replace(capture, room=room)).reasons
    assert any("may lie on their side" in r and "[1, 0, 0]" in r for r in reasons)


@pytest.mark.parametrize(("factor", "told"), [(0.72, "28% too small"), (1.0, None), (1.4, "24% too large")])
def test_unusual_furniture_height_is_a_hint_of_a_wrong_scale(factor, told, report):
    figures = replace(report.figures, level_heights_m=(0.2, 0.9 * factor if factor < 1 else 0.8 * factor))
    hints = [r for r in judge(figures, None, None, None) if r.cause == "furniture_height"]
    assert [told in hint.line for hint in hints] == ([True] if told else [])
    assert all(hint.verdict == "good" for hint in hints)


def test_blur_and_flicker_are_reported(capture):
    blurred = examine(with_frames(capture, lambda k, f: replace(f, sharpness=1.0 if k % 3 == 0 else 100.0)))
    assert any(r.cause == "blur" for r in blurred.remarks)
    assert any(r.cause == "flicker" for r in examine(replace(capture, images=Darker(capture.images))).remarks)


def test_a_floor_at_the_wrong_height_is_reported(capture):
    high = with_frames(
        capture,
        lambda _, f: posed(f, Rigid3(f.world_from_camera.rotation, f.world_from_camera.translation + np.array([0, 0, 2]))),
    )
    assert any(r.cause == "camera_height" for r in examine(high).remarks)


def test_the_report_is_serialisable_as_json(report):
    document = json.loads(json.dumps(report.to_json()))
    assert document["version"] == 2
    assert document["verdict"] == "good"
    assert document["figures"]["frames"] == 24


def test_the_scan_images_show_the_surface_and_the_camera_path(capture):
    plan, view = draw_scan(capture, (240, 160))
    for picture in (plan, view):
        assert picture.shape == (160, 240, 4)
        assert 0.1 < (picture[..., 3] > 0).mean() < 0.95
        path = np.abs(picture[..., :3].astype(int) - (33, 102, 214)).sum(axis=2) < 30
        assert path.any()
    empty = replace(
        capture,
        surface=replace(
            capture.surface, vertices_world=np.zeros((0, 3)), faces=np.zeros((0, 3), int), colours=np.zeros((0, 3), np.uint8)
        ),
    )
    assert draw_scan(empty, (240, 160)).plan.shape == (160, 240, 4)
