"""Peculiarities of each data set's format."""

import json
import zipfile
from dataclasses import replace

import cv2
import numpy as np
import pytest

from r2c2r_core.errors import CaptureError
from r2c2r_core.ingest.readers.table import open_recording

from .tiny import TinyRoom, integer_centred, write_seven_scenes, write_tum, zip_folder
from .tiny_formats import (
    told,
    write_arkitscenes,
    write_arti4d,
    write_nerfstudio,
    write_polycam,
    write_redwood,
    write_rtabmap,
    write_scannet,
    write_scannetpp,
    write_threedmatch,
)

ROOM = TinyRoom()
SMALL = replace(ROOM, count=4)


# ARKitScenes


def test_arkitscenes_images_without_a_pose_are_skipped(tmp_path):
    recording = open_recording(write_arkitscenes(tmp_path / "a", ROOM))
    assert [f.index for f in recording.frames] == list(range(0, 24, 2))
    assert told(recording, "12 a pose missing")
    assert told(recording, "turned by 90°")


# Arti4D


def test_an_upside_down_arti4d_sequence_is_rotated_upright(tmp_path):
    recording = open_recording(write_arti4d(tmp_path / "a", SMALL, flipped=True))
    assert told(recording, "camera upside down")
    for frame, pose in zip(recording.frames, SMALL.poses(), strict=True):
        assert np.allclose(frame.capture_from_camera.matrix, pose.matrix, atol=1e-6)
    assert not open_recording(write_arti4d(tmp_path / "b", SMALL)).notices


def test_arti4d_without_calibration_reports_the_missing_file(tmp_path):
    with pytest.raises(CaptureError, match=r"tf\*\.json") as caught:
        open_recording(write_arti4d(tmp_path / "a", SMALL, tf=False))
    assert "azure_tf.json" in caught.value.hint


# ScanNet


def test_scannet_frames_with_lost_tracking_are_dropped(tmp_path):
    recording = open_recording(write_scannet(tmp_path / "s", ROOM, lost=(3, 4)))
    assert not {3, 4} & {f.index for f in recording.frames}
    assert told(recording, "2 frames have no usable pose")


def test_scannet_calibration_is_scaled_to_downsized_images(tmp_path):
    room = replace(SMALL, rgb_size=(324, 242), depth_size=(160, 120), focal=290.0)  # a quarter of the sensor's 1296x968
    folder = write_scannet(tmp_path / "s", room)
    full = np.eye(4)
    full[:3, :3] = integer_centred(room.camera.resized(1296, 968))
    np.savetxt(folder / "intrinsic" / "intrinsic_color.txt", full)
    recording = open_recording(folder)
    assert recording.frames[0].rgb_camera == room.camera
    assert told(recording, "calibration is for 1296x968")


# ScanNet++


def test_scannetpp_frames_not_extracted_are_not_reported_as_missing(tmp_path):
    recording = open_recording(write_scannetpp(tmp_path / "s", SMALL))
    assert [f.index for f in recording.frames] == [0, 10, 20, 30]
    assert not told(recording, "left out")


def test_unaligned_scannetpp_recordings_are_opened_without_poses(tmp_path):
    recording = open_recording(write_scannetpp(tmp_path / "s", SMALL, aligned=False))
    assert [frame.capture_from_camera for frame in recording.frames] == [None] * 4
    assert told(recording, "4 of 4 frames have no aligned_pose")


@pytest.mark.parametrize(
    ("lost", "said"), [(None, "2 of 4 frames have no aligned_pose"), (np.eye(4).tolist(), "2 poses are the identity")]
)
def test_half_aligned_scannetpp_recordings_lose_the_frames_without_a_pose(lost, said, tmp_path):
    folder = write_scannetpp(tmp_path / "s", SMALL)
    entries = json.loads((folder / "pose_intrinsic_imu.json").read_text())
    for number in (10, 30):
        entries[f"frame_{number:06d}"]["aligned_pose"] = lost
    (folder / "pose_intrinsic_imu.json").write_text(json.dumps(entries))
    recording = open_recording(folder)
    assert [frame.index for frame in recording.frames] == [0, 20]
    assert told(recording, said)
    assert told(recording, "left out")


def test_scannetpp_frames_without_a_camera_are_told_apart_from_those_without_a_pose(tmp_path):
    folder = write_scannetpp(tmp_path / "s", SMALL)
    entries = json.loads((folder / "pose_intrinsic_imu.json").read_text())
    entries["frame_000010"]["intrinsic"][0][0] = None
    (folder / "pose_intrinsic_imu.json").write_text(json.dumps(entries))
    assert told(open_recording(folder), "1 frames have no usable camera")


def test_invalid_scannetpp_intrinsics_report_the_expected_format(tmp_path):
    folder = write_scannetpp(tmp_path / "s", SMALL)
    (folder / "pose_intrinsic_imu.json").write_text('{"frame_000000": {"intrinsic": [[1, 0], 2]}}')
    with pytest.raises(CaptureError, match="'intrinsic' of 3x3 numbers"):
        open_recording(folder)


# 3DMatch and 7-Scenes


def test_3dmatch_reads_the_first_sequence_with_a_notice(tmp_path):
    recording = open_recording(write_threedmatch(tmp_path / "m", SMALL, sequences=2))
    assert len(recording.frames) == 4
    assert {f.rgb_name.split("/")[0] for f in recording.frames} == {"seq-01"}
    assert told(recording, "of 2 sequences seq-01 is read")
    assert open_recording(tmp_path / "m" / "seq-02").frames[0].rgb_name.startswith("frame-")


def test_7scenes_without_calibration_is_reported_as_unregistered(tmp_path):
    room = replace(SMALL, rgb_size=(640, 480))
    recording = open_recording(write_threedmatch(tmp_path / "m", room, intrinsics=False))
    frame = recording.frames[0]
    assert (frame.depth_camera.fx, frame.depth_camera.cx, frame.rgb_camera.fx) == (585.0, 320.0, 525.0)
    assert told(recording, "not registered")


# Redwood / Open3D


def test_redwood_images_numbered_from_one_match_their_poses(tmp_path):
    recording = open_recording(write_redwood(tmp_path / "r", ROOM, first=1))
    zero = open_recording(write_redwood(tmp_path / "z", ROOM))
    assert [f.index for f in recording.frames] == list(range(1, 13))
    assert told(recording, "numbered from 1")
    for a, b in zip(recording.frames, zero.frames, strict=True):
        assert np.array_equal(a.capture_from_camera.matrix, b.capture_from_camera.matrix)


def test_redwood_without_calibration_uses_primesense_defaults(tmp_path):
    room = replace(SMALL, rgb_size=(640, 480))
    recording = open_recording(write_redwood(tmp_path / "r", room, calibrated=False))
    assert (recording.frames[0].rgb_camera.fx, recording.frames[0].rgb_camera.cy) == (525.0, 240.0)
    assert told(recording, "PrimeSense")


@pytest.mark.parametrize(
    ("said", "metres_per_unit"),
    [(4000.0, 0.00025), (0.0001, 0.0001), (3999.999810010195, 0.00025), (1.0, 0.001), ("?", 0.001), (-1, 0.001)],
)
def test_open3d_depth_is_scaled_by_the_unit_of_its_calibration(said, metres_per_unit, tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    (folder / "trajectory.log").unlink()
    camera = json.loads((folder / "camera.json").read_text()) | {"depth_scale": said, "device_name": "Intel RealSense L515"}
    (folder / "camera.json").unlink()
    (folder / "intrinsic.json").write_text(json.dumps(camera))
    recording = open_recording(folder)
    stored = cv2.imread(str(folder / recording.frames[1].depth_name), cv2.IMREAD_UNCHANGED)
    assert np.allclose(recording.depth_of(recording.frames[1]).metres, stored * metres_per_unit, rtol=1e-5)
    assert told(recording, "as intrinsic.json says") == (metres_per_unit != 0.001)


# nerfstudio


def test_nerfstudio_depth_is_read_from_npy_and_in_custom_units(tmp_path):
    for k, options in enumerate(({"npy": True}, {"depth_unit_scale_factor": 0.002})):
        recording = open_recording(write_nerfstudio(tmp_path / str(k), SMALL, **options))
        frame = recording.frames[2]
        exact = ROOM.depth(SMALL.poses()[2], ROOM.depth_camera) * (2 if k else 1)
        assert np.abs(recording.depth_of(frame).metres - exact).max() < 0.0011


def test_nerfstudio_without_depth_raises_a_clear_error(tmp_path):
    with pytest.raises(CaptureError, match="0 of 4 frames name a depth image"):
        open_recording(write_nerfstudio(tmp_path / "n", SMALL, depth=False))


def test_nerfstudio_lens_distortion_is_corrected(tmp_path):
    room = replace(SMALL, rgb_size=(192, 256), depth_size=(192, 256), focal=184.0)
    lens = {"k1": 0.35, "k2": -0.1, "p1": 0.002, "p2": -0.001}
    folder = write_nerfstudio(tmp_path / "n", room, **lens)
    matrix, coefficients = integer_centred(room.camera), np.array([*lens.values(), 0.0])
    pixels = np.indices((256, 192), np.float64)[::-1].reshape(2, -1).T
    ideal = cv2.undistortPoints(pixels[:, None], matrix, coefficients, P=matrix).reshape(256, 192, 2).astype(np.float32)
    for path in (folder / "images").iterdir():  # source position of each ideal pixel in the distorted image
        clean = room.image(room.poses()[int(path.stem[-2:])], room.camera)
        cv2.imwrite(str(path), cv2.remap(clean, ideal[..., 0], ideal[..., 1], cv2.INTER_LINEAR))
    recording = open_recording(folder)
    seen = recording.colour_of(recording.frames[2])[20:-20, 20:-20].astype(int)
    clean = room.image(room.poses()[2], room.camera)[..., ::-1][20:-20, 20:-20]
    distorted = cv2.imread(str(folder / "images" / "frame_00002.jpg"))[..., ::-1][20:-20, 20:-20]
    assert np.abs(seen - clean).mean() < 3.0 < 0.5 * np.abs(distorted.astype(int) - clean).mean()


def test_nerfstudio_depth_is_removed_where_the_mask_is_black(tmp_path):
    folder = write_nerfstudio(tmp_path / "n", SMALL)
    document = json.loads((folder / "transforms.json").read_text())
    mask = np.full(ROOM.rgb_size[::-1], 255, np.uint8)
    mask[:, :48] = 0
    cv2.imwrite(str(folder / "mask.png"), mask)
    for entry in document["frames"]:
        entry["mask_path"] = "mask.png"
    (folder / "transforms.json").write_text(json.dumps(document))
    recording = open_recording(folder)
    metres = recording.depth_of(recording.frames[1]).metres
    assert not metres[:, :24].any()
    assert (metres[:, 24:] > 0).all()
    assert "mask.png" in recording.names


def test_nerfstudio_rejects_fisheye_and_has_no_up_in_colmap_worlds(tmp_path):
    with pytest.raises(CaptureError, match="camera model OPENCV_FISHEYE"):
        open_recording(write_nerfstudio(tmp_path / "f", SMALL, camera_model="OPENCV_FISHEYE"))
    folder = write_nerfstudio(tmp_path / "c", SMALL)
    assert open_recording(folder).up_capture is not None
    text = (folder / "transforms.json").read_text()
    (folder / "transforms.json").write_text(text.replace('"file_path"', '"colmap_im_id": 3, "file_path"'))
    assert open_recording(folder).up_capture is None


def test_nerfcapture_exports_are_read_with_their_poses_and_depth_unit(tmp_path):
    """As NeRFCapture writes it: `depth_path`, in steps of integer_depth_scale."""
    folder = write_nerfstudio(tmp_path / "n", SMALL, integer_depth_scale=1e-3)
    document = json.loads((folder / "transforms.json").read_text())
    for old, new in (("images", "rgb"), ("depths", "depth")):
        (folder / old).rename(folder / new)
        for path in (folder / new).iterdir():
            path.rename(path.with_stem(path.stem.removeprefix("frame_")))
    for entry in document["frames"]:
        entry["file_path"] = entry["file_path"].replace("images/frame_", "rgb/")
        entry["depth_path"] = entry.pop("depth_file_path").replace("depths/frame_", "depth/")
    (folder / "transforms.json").write_text(json.dumps(document))
    recording = open_recording(folder)
    assert recording.format == "nerfstudio transforms.json"
    expected = open_recording(write_nerfstudio(tmp_path / "same", SMALL))
    for found, same in zip(recording.frames, expected.frames, strict=True):
        assert np.allclose(found.capture_from_camera.matrix, same.capture_from_camera.matrix)
        assert np.allclose(recording.depth_of(found).metres, expected.depth_of(same).metres)


# TUM RGB-D


def test_tum_calibration_is_selected_from_comments_or_folder_name(tmp_path):
    folder = write_tum(tmp_path / "t", replace(SMALL, rgb_size=(640, 480), focal=535.0))
    (folder / "settings.yaml").unlink()
    assert told(open_recording(folder), "generic Kinect")
    for name, heading in (("rgb.txt", "color images"), ("groundtruth.txt", "ground truth trajectory")):
        lists = (folder / name).read_text()
        (folder / name).write_text(f"# {heading}\n# file: 'rgbd_dataset_freiburg3_cabinet.bag'\n{lists}")
        recording = open_recording(folder)
        assert recording.frames[0].rgb_camera.fx == 535.4
        assert not told(recording, "generic Kinect")
        (folder / name).write_text(lists)
    renamed = folder.rename(tmp_path / "freiburg1_kitchen")
    lists = (renamed / "rgb.txt").read_text()
    assert open_recording(renamed).frames[0].rgb_camera.fx == 517.3
    (renamed / "rgb.txt").write_text(f"# file: 'rgbd_dataset_freiburg2_desk.bag'\n{lists}")
    assert open_recording(renamed).frames[0].rgb_camera.fx == 520.9  # the recording's own content precedes its folder's name


def _associated(folder, line):
    """The two lists as one associations.txt."""
    rows = [
        [row for row in (folder / f"{name}.txt").read_text().splitlines() if not row.startswith("#")]
        for name in ("rgb", "depth")
    ]
    (folder / "associations.txt").write_text(
        "\n".join(line.format(rgb=rgb, depth=depth) for rgb, depth in zip(*rows, strict=True))
    )
    for name in ("rgb.txt", "depth.txt"):
        (folder / name).unlink()


@pytest.mark.parametrize("line", ["{rgb} {depth}", "{depth} {rgb}"])
def test_tum_associations_in_either_column_order_are_read(line, tmp_path):
    as_lists = open_recording(write_tum(tmp_path / "t", SMALL))
    folder = write_tum(tmp_path / "a", SMALL)
    _associated(folder, line)
    recording = open_recording(folder)
    assert recording.format == "TUM RGB-D"
    for found, expected in zip(recording.frames, as_lists.frames, strict=True):
        assert (found.rgb_name, found.depth_name) == (expected.rgb_name, expected.depth_name)
        assert np.allclose(found.capture_from_camera.matrix, expected.capture_from_camera.matrix)


@pytest.mark.parametrize("shorter", ["rgb.txt", "depth.txt"])
def test_tum_frames_that_only_the_associations_name_are_read(shorter, tmp_path):
    whole = open_recording(write_tum(tmp_path / "t", SMALL))
    folder = write_tum(tmp_path / "a", SMALL)
    lists = {name: (folder / name).read_text() for name in ("rgb.txt", "depth.txt")}
    _associated(folder, "{rgb} {depth}")
    lists[shorter] = "\n".join(lists[shorter].splitlines()[:3])
    for name, text in lists.items():
        (folder / name).write_text(text)
    recording = open_recording(folder)
    assert [frame.rgb_name for frame in recording.frames] == [frame.rgb_name for frame in whole.frames]
    assert [frame.depth_name for frame in recording.frames] == [frame.depth_name for frame in whole.frames]
    assert {"associations.txt", "rgb.txt", "depth.txt"} <= set(recording.names)
    assert not told(recording, "left out")


def test_tum_associations_of_some_frames_leave_none_out_and_their_pairs_hold(tmp_path):
    folder = write_tum(tmp_path / "a", SMALL)
    rgb, depth = ((folder / name).read_text().splitlines()[1:] for name in ("rgb.txt", "depth.txt"))
    (folder / "associations.txt").write_text(f"{rgb[1]} {depth[0]}\nno line of it")
    recording = open_recording(folder)
    assert [frame.depth_name for frame in recording.frames] == [depth[k].split()[1] for k in (0, 0, 2, 3)]


def test_tum_images_that_a_short_list_does_not_name_are_counted(tmp_path):
    folder = write_tum(tmp_path / "t", SMALL)
    lines = (folder / "rgb.txt").read_text().splitlines()
    (folder / "rgb.txt").write_text("\n".join([*lines[:3], lines[3][:8]]))  # cut off within a line
    recording = open_recording(folder)
    assert len(recording.frames) == 2
    assert told(recording, "2 files in rgb/ are not named in rgb.txt and were left out")


def test_tum_images_that_do_not_exist_are_counted(tmp_path):
    folder = write_tum(tmp_path / "t", SMALL)
    sorted((folder / "rgb").iterdir())[1].unlink()
    recording = open_recording(folder)
    assert len(recording.frames) == 3
    assert told(recording, "1 of 4 images that rgb.txt names do not exist")


def test_icl_nuim_poses_are_read_without_an_up_direction(tmp_path):
    folder = write_tum(tmp_path / "t", SMALL)
    _associated(folder, "{depth} {rgb}")
    (folder / "groundtruth.txt").rename(folder / "livingRoom0.gt.freiburg")
    recording = open_recording(folder)
    assert all(frame.capture_from_camera is not None for frame in recording.frames)
    assert recording.up_capture is None


def test_invalid_associations_columns_report_the_expected_format(tmp_path):
    folder = write_tum(tmp_path / "t", SMALL)
    _associated(folder, "{rgb}")
    with pytest.raises(CaptureError, match=r"associations\.txt: line") as caught:
        open_recording(folder)
    assert "time filename time filename" in caught.value.hint


# RTAB-Map


@pytest.mark.parametrize(("by_id", "of_camera"), [(True, True), (False, False), (True, False)])
def test_rtabmap_file_naming_and_pose_variants_give_the_same_frames(by_id, of_camera, tmp_path):
    expected = open_recording(write_rtabmap(tmp_path / "e", SMALL))
    found = open_recording(write_rtabmap(tmp_path / "f", SMALL, by_id=by_id, of_camera=of_camera))
    assert [frame.index for frame in found.frames] == [0, 5, 10, 15]
    for one, same in zip(found.frames, expected.frames, strict=True):
        assert np.allclose(one.capture_from_camera.matrix, same.capture_from_camera.matrix)
        assert (one.rgb_camera, one.depth_camera) == (same.rgb_camera, same.depth_camera)


def test_rtabmap_poses_in_a_wrong_format_report_the_expected_format(tmp_path):
    folder = write_rtabmap(tmp_path / "r", SMALL)
    (folder / "kitchen_camera_poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    with pytest.raises(CaptureError, match="time x y z qx qy qz qw") as caught:
        open_recording(folder)
    assert "format 11" in caught.value.hint


# All formats


def test_a_zip_with_backslash_paths_is_read_like_the_folder(tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL)
    for top in ("", "2026-11-02 kitchen/"):
        packed = tmp_path / f"{len(top)}.zip"
        with zipfile.ZipFile(packed, "w") as archive:
            for path in folder.rglob("*"):
                member = zipfile.ZipInfo("x")
                member.filename = (top + path.relative_to(folder).as_posix()).replace("/", "\\") + "\\" * path.is_dir()
                archive.writestr(member, b"" if path.is_dir() else path.read_bytes())
        recording = open_recording(packed)
        assert recording.format == "Polycam raw export"
        frame = recording.frames[0]
        assert recording.colour_of(frame) == (folder / frame.rgb_name).read_bytes()
        assert np.isfinite(recording.depth_of(frame).metres).any()


@pytest.mark.parametrize("worth", [np.full(12, np.nan), np.zeros(12)])
def test_a_recording_with_only_invalid_poses_is_opened_without_poses(worth, tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL)
    for path in (folder / "keyframes").glob("*cameras/*.json"):
        camera = json.loads(path.read_text())
        camera |= {f"t_{n // 4}{n % 4}": value for n, value in enumerate(worth.tolist())}
        path.write_text(json.dumps(camera))
    recording = open_recording(folder)
    assert [frame.capture_from_camera for frame in recording.frames] == [None] * 4
    assert told(recording, "none of 4 poses")


def test_an_unknown_folder_reports_the_two_closest_formats(tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    for name in ("trajectory.log", "camera.json"):
        (folder / name).unlink()
    with pytest.raises(CaptureError) as caught:
        open_recording(folder)
    assert "looks like 7-Scenes folder, but intrinsics_color.txt is missing" in str(caught.value)
    assert "Redwood / Open3D would need trajectory.log or a camera's .json" in caught.value.hint
    assert len(f"{caught.value}{caught.value.hint}") < 500


@pytest.mark.parametrize(
    ("name", "what", "bring"),
    [
        ("Kitchen.USDZ", "a finished 3D model", "Raw data"),
        ("scan.ply", "a finished 3D model", "Raw data"),
        ("2026-11-02.bag", "RealSense bag", "save_frames"),
        ("rosbag2_0.mcap", "a ROS 2 bag", "color/ and depth/"),
        ("k4a.mkv", "Azure Kinect", "azure_kinect_mkv_reader"),
        ("rtabmap.db", "a database of RTAB-Map", "rtabmap-export"),
        ("scene0000_00.sens", "ScanNet's packed .sens stream", "reader.py --filename"),
        ("HD720.svo2", "a ZED camera", "ZED_SVO_Export"),
        ("scan.tar", "an archive that is not a zip", "as a zip"),
        ("IMG_0042.MOV", "a film without depth", "the whole folder"),
        ("IMG_0042.HEIC", "a picture", "with depth"),
    ],
)
def test_an_unsupported_file_is_identified_with_a_hint_on_what_to_provide(name, what, bring, tmp_path):
    (tmp_path / "alone").mkdir()
    alone = tmp_path / "alone" / name
    alone.write_bytes(b"x")
    beside = tmp_path / "beside"
    beside.mkdir()
    for one in (name, "notes.txt", "cover.jpg"):
        (beside / one).write_bytes(b"x")
    for source in (alone, beside, zip_folder(beside, tmp_path / "sent.zip", top="beside/")):
        with pytest.raises(CaptureError) as caught:
            open_recording(source)
        assert what in str(caught.value)
        assert str(caught.value).count(name) == 1
        assert bring in caught.value.hint


def test_an_extra_3d_model_file_does_not_affect_reading_a_recording(tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL)
    (folder / "raw.glb").write_bytes(b"glTF")
    assert open_recording(folder).format == "Polycam raw export"


@pytest.mark.parametrize(
    ("write", "name", "top"),
    [
        (write_tum, "settings.yaml", ""),
        (write_seven_scenes, "intrinsics_color.txt", ""),
        (write_threedmatch, "camera-intrinsics.txt", "seq-01"),
    ],
)
def test_calibration_in_the_parent_folder_is_used_with_a_notice(write, name, top, tmp_path):
    folder = write(tmp_path / "scene" / "made", SMALL)
    (folder / name).rename(tmp_path / "scene" / name)
    source = folder / top
    if top:  # of 3DMatch only the sequence: its scene's calibration is then one folder up
        source = (folder / top).rename(tmp_path / "scene" / top)
    recording = open_recording(source)
    assert recording.frames[0].rgb_camera == ROOM.camera
    assert told(recording, f"the calibration was read from {name}, one folder up")
    digest = recording.files.sha256(recording.names)
    calibration = tmp_path / "scene" / name
    calibration.write_text(calibration.read_text() + "\n")
    assert open_recording(source).files.sha256(recording.names) != digest  # another calibration is another recording
    if not top:
        (folder / "made.txt").write_text("")
        zipped = zip_folder(tmp_path / "scene", tmp_path / "scene.zip", top="scene/")
        assert open_recording(zipped).frames[0].rgb_camera == ROOM.camera


def test_ambiguous_calibrations_in_the_parent_folder_are_ignored(tmp_path):
    folder = write_tum(tmp_path / "scene" / "made", replace(SMALL, rgb_size=(640, 480), focal=535.0))
    (folder / "settings.yaml").rename(tmp_path / "scene" / "TUM1.yaml")
    (tmp_path / "scene" / "TUM3.yaml").write_bytes((tmp_path / "scene" / "TUM1.yaml").read_bytes())
    assert told(open_recording(folder), "generic Kinect")


@pytest.mark.parametrize(
    ("write", "poses"),
    [
        (write_seven_scenes, "pose/*"),
        (write_tum, "groundtruth.txt"),
        (write_redwood, "trajectory.log"),
        (write_scannet, "pose/*"),
        (write_threedmatch, "seq-01/*.pose.txt"),
    ],
)
def test_a_recording_without_pose_files_is_opened_without_poses(write, poses, tmp_path):
    folder = write(tmp_path / "made", SMALL)
    for path in list(folder.glob(poses)):
        path.unlink()
    recording = open_recording(folder)
    assert [f.capture_from_camera for f in recording.frames] == [None] * 4


def test_uppercase_file_extensions_are_read(tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    for path in [*(folder / "color").iterdir(), *(folder / "depth").iterdir()]:
        path.rename(path.with_suffix(path.suffix.upper()))
    assert len(open_recording(folder).frames) == 4


@pytest.mark.parametrize("name", ["color/0.jpg", "depth/0.png", "intrinsic/intrinsic_color.txt"])
def test_a_git_lfs_pointer_instead_of_a_file_is_reported(name, tmp_path):
    folder = write_scannet(tmp_path / "s", SMALL)
    (folder / name).write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    for source in (folder, zip_folder(folder, tmp_path / "s.zip", top="s/")):
        with pytest.raises(CaptureError, match=f"{name}.*Git LFS") as caught:
            open_recording(source)
        assert "git lfs pull" in caught.value.hint


def test_an_unsupported_zip_compression_method_is_reported_with_a_hint(tmp_path):
    """Windows packs large folders by Deflate64."""
    zipped = zip_folder(write_scannet(tmp_path / "s", SMALL), tmp_path / "s.zip", top="s/")
    content = bytearray(zipped.read_bytes())
    with zipfile.ZipFile(zipped) as archive:
        last = archive.infolist()[-1]
    entry = content.rindex(b"PK\x01\x02")
    for at in (entry + 10, last.header_offset + 8):  # the compression method, in the table of contents and in the local header
        content[at] = 9
    zipped.write_bytes(content)
    with pytest.raises(CaptureError, match="Deflate64") as caught:
        open_recording(zipped)
    assert "method Deflate" in caught.value.hint


def test_eight_bit_depth_reports_that_16_bit_is_expected(tmp_path):
    folder = write_redwood(tmp_path / "r", SMALL)
    for path in (folder / "depth").iterdir():
        cv2.imwrite(str(path), (cv2.imread(str(path), cv2.IMREAD_UNCHANGED) // 16).astype(np.uint8))
    with pytest.raises(CaptureError, match="1 x uint8 a pixel, one uint16 expected") as caught:
        open_recording(folder)
    assert "write depth as 16-bit PNG" in caught.value.hint


def test_nested_wrapper_folders_in_a_zip_are_skipped(tmp_path):
    folder = write_polycam(tmp_path / "p", SMALL)
    zipped = zip_folder(folder, tmp_path / "p.zip", top="export/2026-11-21/kitchen/")
    assert open_recording(zipped).format == "Polycam raw export"


def test_a_calibration_for_another_image_size_is_rejected(tmp_path):
    folder = write_seven_scenes(tmp_path / "k", SMALL)
    np.savetxt(folder / "intrinsics_color.txt", integer_centred(ROOM.camera.resized(960, 1280)))
    with pytest.raises(CaptureError, match="do not belong to 96x128 pixels"):
        open_recording(folder)


def test_a_frame_with_a_pose_over_a_kilometre_away_is_skipped(tmp_path):
    folder = write_seven_scenes(tmp_path / "k", SMALL)
    pose = np.eye(4)
    pose[0, 3] = 1e12
    np.savetxt(folder / "pose" / "000005.txt", pose)
    recording = open_recording(folder)
    assert [f.index for f in recording.frames] == [0, 10, 15]
    assert told(recording, "more than a kilometre")


def test_tum_poses_matched_by_line_stay_aligned_when_an_image_is_missing(tmp_path):
    folder = write_tum(tmp_path / "t", ROOM, pose_clock_offset_s=0.006)
    rows = [line.split() for line in (folder / "groundtruth.txt").read_text().splitlines()[1:]]
    images = [line for line in (folder / "rgb.txt").read_text().splitlines() if not line.startswith("#")]
    (folder / "groundtruth.txt").write_text("\n".join(" ".join([str(k), *rows[k][1:]]) for k in range(len(images))))
    (folder / images[2].split()[1]).unlink()
    recording = open_recording(folder)
    assert told(recording, "matched by line")
    assert 2 not in [f.index for f in recording.frames]
    for frame in recording.frames:
        assert np.allclose(frame.capture_from_camera.translation, [float(n) for n in rows[frame.index][1:4]])


def test_a_folder_that_contains_an_archive_reports_its_name(tmp_path):
    from .tiny import write_r3d

    (tmp_path / "scans").mkdir()
    write_r3d(tmp_path / "scans" / "kitchen.r3d", SMALL)
    with pytest.raises(CaptureError, match=r"holds kitchen\.r3d") as caught:
        open_recording(tmp_path / "scans")
    assert "choose" in caught.value.hint


def test_the_first_of_several_recordings_is_read_with_a_notice(tmp_path):
    for name in ("monday", "tuesday"):
        write_scannet(tmp_path / "scans" / name, SMALL)
    recording = open_recording(tmp_path / "scans")
    assert len(recording.frames) == 4
    assert told(recording, "2 recordings found, monday is read: monday, tuesday")
