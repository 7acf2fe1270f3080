"""Recordings as people have them: partial sources, data sets as published, depth in other files, our own advice followed."""

import json
import re
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import PurePath

import cv2
import numpy as np
import OpenEXR
import pytest
from scipy.spatial.transform import Rotation

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.foreign import foreign
from r2c2r_core.ingest.readers.protocol import UnreadableFrame
from r2c2r_core.ingest.readers.stored_depth import are_depth16
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.readers.video import Video

from .tiny import TinyRoom, integer_centred, write_r3d, write_tum, zip_folder
from .tiny_formats import (
    millimetres,
    told,
    write_arkitscenes,
    write_nerfstudio,
    write_polycam,
    write_redwood,
    write_rtabmap,
    write_scanner_app,
    write_scannet,
    write_stray,
)

SMALL = replace(TinyRoom(), count=4)
HALF_STEP_M = 0.0011  # of HALF between 2 and 4 m


def changed(path, change):
    """The JSON file with `change` applied to its document."""
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


def exact(recording, frame):
    return SMALL.depth(SMALL.poses()[frame.index], frame.depth_camera)


# A preferred source that covers only a part


def test_polycam_frames_without_a_corrected_image_are_read_as_recorded(tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL) / "keyframes"  # here the cameras of uncorrected images are longer by a fifth
    for path in sorted((folder / "corrected_cameras").iterdir())[1:]:
        path.unlink()
    recording = open_recording(tmp_path / "p")
    assert [round(f.rgb_camera.fx / SMALL.focal, 3) for f in recording.frames] == [1.0, 1.2, 1.2, 1.2]
    assert ["corrected" in f.rgb_name for f in recording.frames] == [True, False, False, False]
    assert told(recording, "1 of 4 colour images were corrected")


def test_an_unusable_corrected_camera_gives_way_to_the_recorded_one(tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL) / "keyframes"
    changed(sorted((folder / "corrected_cameras").iterdir())[2], lambda camera: camera.update(t_00=None))
    recording = open_recording(tmp_path / "p")
    assert [round(f.rgb_camera.fx / SMALL.focal, 3) for f in recording.frames] == [1.0, 1.0, 1.2, 1.0]


def test_an_empty_corrected_image_gives_way_to_the_recorded_one(tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL) / "keyframes"
    sorted((folder / "corrected_images").iterdir())[1].write_bytes(b"")
    recording = open_recording(tmp_path / "p")
    assert ["corrected" in f.rgb_name for f in recording.frames] == [True, False, True, True]
    assert [round(f.rgb_camera.fx / SMALL.focal, 3) for f in recording.frames] == [1.0, 1.2, 1.0, 1.0]


@pytest.mark.parametrize("own", [[[200.0, 200.0, 24.0, 32.0]], [None, [200.0, 200.0, 24.0, 32.0]]])
def test_record3d_cameras_of_some_frames_are_used_for_those(own, tmp_path):
    recording = open_recording(write_r3d(tmp_path / "a.r3d", SMALL, perFrameIntrinsicCoeffs=own))
    of_its_own = [frame.rgb_camera.fx == 200.0 for frame in recording.frames]
    assert of_its_own == [k < len(own) and own[k] is not None for k in range(4)]


def test_record3d_without_a_usable_pose_is_opened_to_be_tracked(tmp_path):
    recording = open_recording(write_r3d(tmp_path / "a.r3d", SMALL, poses=[[0.0] * 7] * 4))
    assert [frame.capture_from_camera for frame in recording.frames] == [None] * 4


def test_nerfstudio_depth_under_either_key_is_read_frame_by_frame(tmp_path):
    folder = write_nerfstudio(tmp_path / "n", SMALL)

    def half(document):
        for entry in document["frames"][::2]:
            entry["depth_path"] = entry.pop("depth_file_path")
            entry["fl_x"] = None  # the file's own counts
        document["fl_x"] = SMALL.focal

    changed(folder / "transforms.json", half)
    recording = open_recording(folder)
    assert [frame.rgb_camera.fx for frame in recording.frames] == [SMALL.focal] * 4


def test_rtabmap_nodes_with_a_pose_in_either_file_are_read(tmp_path):
    expected = open_recording(write_rtabmap(tmp_path / "e", SMALL))
    of_device = (write_rtabmap(tmp_path / "d", SMALL, of_camera=False) / "kitchen_poses.txt").read_text()
    folder = write_rtabmap(tmp_path / "f", SMALL)
    (folder / "kitchen_poses.txt").write_text(of_device)
    rows = (folder / "kitchen_camera_poses.txt").read_text().splitlines()
    (folder / "kitchen_camera_poses.txt").write_text("\n".join(rows[:2]))
    for one, same in zip(open_recording(folder).frames, expected.frames, strict=True):
        assert np.allclose(one.capture_from_camera.matrix, same.capture_from_camera.matrix)


def test_frames_without_usable_poses_are_opened_to_be_tracked_although_another_pose_is_usable(tmp_path):
    folder = write_redwood(tmp_path / "r", replace(SMALL, count=6))
    lines = (folder / "trajectory.log").read_text().splitlines()
    lost = [line if k % 5 == 0 or k > 19 else "nan nan nan nan" for k, line in enumerate(lines)]
    (folder / "trajectory.log").write_text("\n".join(lost))
    for number in (4, 5):
        (folder / "depth" / f"{number:05d}.png").unlink()
    recording = open_recording(folder)
    assert [frame.capture_from_camera for frame in recording.frames] == [None] * 4


@pytest.mark.parametrize(
    ("write", "cameras", "left"),
    [
        (partial(write_polycam, corrected=False), "keyframes/cameras", 3),
        (write_arkitscenes, "lowres_wide_intrinsics", 3),
        (write_rtabmap, "kitchen_calib", 4),
        (write_scanner_app, "frame_*.json", 3),
    ],
)
def test_a_damaged_camera_file_costs_at_most_its_frame(write, cameras, left, tmp_path):
    folder = write(tmp_path / "r", SMALL)
    found = sorted((folder / cameras).iterdir()) if (folder / cameras).is_dir() else sorted(folder.glob(cameras))
    found[0].write_bytes(b"")
    assert len(open_recording(folder).frames) == left


def test_an_impossible_camera_of_one_frame_costs_that_frame(tmp_path):
    own = [[SMALL.focal, SMALL.focal, 48.0, 64.0] if k != 2 else [5.0, 5.0, 48.0, 64.0] for k in range(4)]
    recording = open_recording(write_r3d(tmp_path / "a.r3d", SMALL, perFrameIntrinsicCoeffs=own))
    assert [frame.index for frame in recording.frames] == [0, 1, 3]
    assert told(recording, "1 frames have a camera that does not fit")


@pytest.mark.parametrize(
    "change", [lambda rows: [*rows[:2], "x y z", *rows[3:]], lambda rows: rows[:-1]], ids=["damaged", "short"]
)
def test_a_damaged_or_missing_line_of_rtabmaps_poses_costs_its_frame(change, tmp_path):
    folder = write_rtabmap(tmp_path / "r", SMALL)
    poses = folder / "kitchen_camera_poses.txt"
    poses.write_text("\n".join(change(poses.read_text().splitlines())))
    recording = open_recording(folder)
    assert len(recording.frames) == 3
    assert told(recording, "1 colour images belong to no node of kitchen_camera_poses.txt")


def test_a_pose_file_damaged_in_its_zip_costs_its_frame(tmp_path):
    packed = zip_folder(write_scannet(tmp_path / "s", SMALL), tmp_path / "s.zip")
    content, pose = bytearray(packed.read_bytes()), (tmp_path / "s" / "pose" / "1.txt").read_bytes()
    content[content.index(pose)] ^= 1
    packed.write_bytes(content)
    recording = open_recording(packed)
    assert [frame.index for frame in recording.frames] == [0, 2, 3]
    assert told(recording, "1 frames have no usable pose")


def test_a_recording_without_any_camera_is_refused_in_one_line(tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL)
    for path in (folder / "keyframes").glob("*cameras/*.json"):
        changed(path, lambda camera: camera.update(fx=0, t_00=None))
    with pytest.raises(CaptureError, match="none of 4 frames has a usable camera"):
        open_recording(folder)


# Data sets as published


@pytest.mark.parametrize("folder", ["scene", "living_room_traj1_frei_png"])
def test_icl_nuim_is_read_with_its_camera_and_its_reflection_undone(folder, tmp_path):
    room = replace(SMALL, rgb_size=(640, 480), depth_size=(640, 480), focal=480.0)
    expected = open_recording(write_tum(tmp_path / "right", room))
    folder = write_tum(tmp_path / folder, room)
    (folder / "settings.yaml").unlink()
    mirror = np.diag([1.0, -1.0, 1.0])
    lines = []
    for line in (folder / "groundtruth.txt").read_text().splitlines()[1:]:
        time_s, *numbers = map(float, line.split())
        turned = Rotation.from_matrix(mirror @ Rotation.from_quat(numbers[3:]).as_matrix() @ mirror).as_quat()
        lines.append(" ".join(f"{n:.9f}" for n in (time_s, *(mirror @ numbers[:3]), *turned)))
    name = "groundtruth.txt" if "traj1" in folder.name else "livingRoom1.gt.freiburg"
    (folder / "groundtruth.txt").unlink()
    (folder / name).write_text("\n".join(lines))
    recording = open_recording(folder)
    camera = recording.frames[0].rgb_camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (481.2, 480.0, 320.0, 240.0)
    for found, same in zip(recording.frames, expected.frames, strict=True):
        assert np.allclose(found.capture_from_camera.matrix, same.capture_from_camera.matrix, atol=1e-6)
    assert told(recording, "left-handed")


def test_blender_and_instant_ngp_cameras_follow_from_the_angle_of_view(tmp_path):
    folder = write_nerfstudio(tmp_path / "n", SMALL)
    width, height = SMALL.rgb_size

    def viewed(document):
        for entry in document["frames"]:
            for key in ("fl_x", "fl_y", "cx", "cy", "w", "h"):
                del entry[key]
        document["camera_angle_x"] = 2 * np.arctan(width / 2 / 80.0)

    changed(folder / "transforms.json", viewed)
    camera = open_recording(folder).frames[0].rgb_camera
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == pytest.approx((80.0, 80.0, width / 2, height / 2))
    changed(folder / "transforms.json", lambda document: document.update(camera_angle_y=2 * np.arctan(height / 2 / 90.0)))
    assert open_recording(folder).frames[0].rgb_camera.fy == pytest.approx(90.0)
    changed(folder / "transforms.json", lambda document: document.update(camera_angle_x="wide", camera_angle_y=None))
    with pytest.raises(CaptureError, match="neither fl_x nor camera_angle_x"):
        open_recording(folder)
    changed(folder / "transforms.json", lambda document: document.update(is_fisheye=True))
    with pytest.raises(CaptureError, match="OPENCV_FISHEYE"):
        open_recording(folder)


def test_a_split_transforms_file_is_read_whole(tmp_path):
    folder = write_nerfstudio(tmp_path / "n", SMALL)
    document = json.loads((folder / "transforms.json").read_text())
    for k, part in enumerate(("train", "val", "test")):
        (folder / f"transforms_{part}.json").write_text(json.dumps({**document, "frames": document["frames"][k::3]}))
    (folder / "transforms.json").unlink()
    assert [frame.index for frame in open_recording(folder).frames] == [0, 1, 2, 3]


# Depth in other files


def _saved(path, metres, kind):
    if kind == "exr":
        OpenEXR.File({"type": OpenEXR.scanlineimage}, {"Z": metres, "A": np.ones_like(metres)}).write(str(path))
    elif kind in ("npy", "npz"):
        np.save(path, metres) if kind == "npy" else np.savez_compressed(path, depth=metres, mask=metres > 0)
    else:
        cv2.imwrite(str(path), millimetres(metres) if kind in ("tif", "pgm") else metres)


@pytest.mark.parametrize("kind", ["tiff", "tif", "pgm", "pfm", "exr", "npy", "npz"])
def test_depth_in_another_file_is_read_in_its_own_unit(kind, tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    for k, path in enumerate(sorted((folder / "depth").iterdir())):
        _saved(path.with_suffix(f".{kind}"), SMALL.depth(SMALL.poses()[k], SMALL.camera), kind)
        path.unlink()
    recording = open_recording(folder)
    assert len(recording.frames) == 4
    for frame in recording.frames:
        assert np.abs(recording.depth_of(frame).metres - exact(recording, frame)).max() < HALF_STEP_M


def test_grey_depth_saved_as_colour_is_read(tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    opaque = np.zeros(SMALL.rgb_size[::-1], np.uint16)
    for path in (folder / "depth").iterdir():
        cv2.imwrite(str(path), cv2.merge([*[cv2.imread(str(path), cv2.IMREAD_UNCHANGED)] * 3, np.full_like(opaque, 65535)]))
    recording = open_recording(folder)
    assert np.abs(recording.depth_of(recording.frames[1]).metres - exact(recording, recording.frames[1])).max() < HALF_STEP_M


def test_android_depth16_is_unpacked_with_its_confidence(tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    expected = open_recording(folder)
    plain = [expected.depth_of(frame).metres for frame in expected.frames]
    for path in (folder / "depth").iterdir():
        stored = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        codes = np.linspace(0, 7.99, stored.shape[0]).astype(np.uint16)[:, None]
        cv2.imwrite(str(path), stored | codes << 13)
    recording = open_recording(folder)
    assert told(recording, "DEPTH16")
    for frame, metres in zip(recording.frames, plain, strict=True):
        depth = recording.depth_of(frame)
        assert np.allclose(depth.metres, metres)
        rows = [int(depth.confidence[round((code + 0.5) / 8 * len(metres)), 0]) for code in range(8)]
        assert rows == [2, 0, 0, 1, 1, 2, 2, 2]  # certain; then 0 to 100 %


@pytest.mark.parametrize(("code", "confidence"), [(7, 2), (4, 1)])
def test_android_depth16_of_one_confidence_is_unpacked(code, confidence, tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    expected = open_recording(folder)
    plain = [expected.depth_of(frame).metres for frame in expected.frames]
    for path in (folder / "depth").iterdir():
        stored = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        stored[:3] = 0
        stored[3:6] = 1 << 13  # nothing was measured: depth 0 of confidence 0
        cv2.imwrite(str(path), np.where(stored & 0x1FFF, stored | code << 13, stored).astype(np.uint16))
    recording = open_recording(folder)
    assert told(recording, "DEPTH16")
    for frame, metres in zip(recording.frames, plain, strict=True):
        depth = recording.depth_of(frame)
        assert np.allclose(depth.metres[6:], metres[6:])
        assert not depth.metres[:6].any()
        assert set(depth.confidence[6:].ravel().tolist()) == {confidence}


def test_far_walls_and_unknown_pixels_are_not_taken_for_depth16():
    room = np.full((48, 64), 1500, np.uint16)
    room[:, 20:40] = 9700  # 8.2 m behind: the step of one code
    room[30:, 50:] = 65535
    assert not are_depth16([room])
    assert not are_depth16([np.full((48, 64), 12_000, np.uint16)])  # 1.2 m in steps of 0.1 mm
    assert not are_depth16([np.random.default_rng(0).integers(0, 65535, (48, 64)).astype(np.uint16)])


@pytest.mark.parametrize(
    ("ending", "content", "found"),
    [
        ("png", cv2.imencode(".png", np.arange(36, dtype=np.uint8).reshape(3, 4, 3))[1].tobytes(), "3 x uint8 a pixel"),
        ("tiff", b"II*\0 no more", "no PNG, TIFF, PPM of a kind that is read"),
        ("raw", b"\0" * 24, r"depth/00000\.raw is not read"),
        ("jpg", b"\xff\xd8\xff", r"depth/00000\.jpg is not read"),
        ("npz", b"PK\x03\x04", "not a readable depth array"),
    ],
    ids=["colours", "damaged", "raw", "jpeg", "npz"],
)
def test_depth_that_is_not_read_is_named_with_what_to_write(ending, content, found, tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    for path in (folder / "depth").iterdir():
        path.with_suffix(f".{ending}").write_bytes(content)
        if ending != "png":
            path.unlink()
    with pytest.raises(CaptureError, match=found) as caught:
        open_recording(folder)
    assert "16-bit PNG in millimetres" in caught.value.hint


# Our own advice, followed


@pytest.mark.parametrize("matrix", ["named", "rows", "ros"])
def test_a_camera_json_as_people_write_it_is_read(matrix, tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    expected = open_recording(folder).frames[0].rgb_camera
    k = integer_centred(SMALL.camera)
    said = {"named": {"fx": k[0, 0], "fy": k[1, 1], "cx": k[0, 2], "cy": k[1, 2]}, "rows": {"intrinsic_matrix": k.tolist()}}
    said["ros"] = {"k": k.ravel().tolist(), "width": SMALL.rgb_size[0], "height": SMALL.rgb_size[1]}
    (folder / "camera.json").write_text(json.dumps(said[matrix]))
    assert open_recording(folder).frames[0].rgb_camera == expected


@pytest.mark.parametrize("name", ["a.svo2", "a.mcap", "a.bag"])
def test_the_camera_json_of_a_hint_is_read(name, tmp_path):
    folder = write_redwood(tmp_path / "r", replace(SMALL, rgb_size=(320, 240)))
    said = re.search(r"camera\.json: (\{.*?\})", foreign(PurePath(name)).bring)
    (folder / "camera.json").write_text(said[1])
    recording = open_recording(folder)
    assert "camera.json" in recording.names
    assert (recording.frames[0].rgb_camera.fx, recording.frames[0].rgb_camera.width) == (262.5, 320)


def test_the_module_that_the_hint_for_an_azure_kinect_names_is_open3ds():
    assert find_spec(re.search(r"python -m (\S+)", foreign(PurePath("k4a.mkv")).bring)[1])


def test_a_refused_film_is_converted_by_the_command_that_its_refusal_names(tmp_path, monkeypatch):
    folder = write_stray(tmp_path / "s", SMALL)
    monkeypatch.setattr(Video, "frame", _unreadable)
    with pytest.raises(CaptureError) as caught:
        open_recording(folder)
    words = re.search(r"ffmpeg (.*?), then", caught.value.hint)[1].split()
    assert words[words.index("-i") + 1] == "rgb.mp4"
    assert words[-1] == "new.mp4"  # ffmpeg writes nothing without it


def _unreadable(*_):
    raise UnreadableFrame("no frame")


def test_the_names_that_zeds_export_writes_are_read_from_color_and_depth(tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    for path in (*(folder / "color").iterdir(), *(folder / "depth").iterdir()):
        path.rename(path.with_name(f"{'left' if path.parent.name == 'color' else 'depth'}{int(path.stem):06d}{path.suffix}"))
    assert [frame.index for frame in open_recording(folder).frames] == [0, 1, 2, 3]
