"""The tiny room as recorded by other apps and data sets; each writer follows its format's published specification."""

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, Rigid3

from .tiny import YUP_FROM_ZUP, TinyRoom, integer_centred, jpeg

HEVC = Path(__file__).with_name("tiny-room-hevc.mp4")
"""The default room's sensor_images by libx265 (crf 10, hvc1, 12 frames), as a phone would have filmed it."""

TILTED = Rigid3(Rotation.from_euler("xyz", [70.0, 12.0, -25.0], degrees=True).as_matrix(), np.array([0.3, -1.0, 2.0]))
_UPRIGHT_FROM_SENSOR = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # the image was rotated clockwise


def sensor_camera(camera: Intrinsics) -> Intrinsics:
    """The camera of an upright image in sensor orientation: rotated clockwise by 90 deg."""
    return Intrinsics(
        fx=camera.fy, fy=camera.fx, cx=camera.height - camera.cy, cy=camera.cx, width=camera.height, height=camera.width
    )


def sensor_pose(pose: Rigid3) -> Rigid3:
    """The sensor's pose from that of the upright camera."""
    return Rigid3(pose.rotation @ _UPRIGHT_FROM_SENSOR, pose.translation)


def sensor_images(room: TinyRoom) -> list[np.ndarray]:
    """BGR pictures in sensor orientation."""
    return [np.ascontiguousarray(np.rot90(room.image(pose, room.camera), -1)) for pose in room.poses()]


def write_stray(folder: Path, room: TinyRoom, *, skip: tuple[int, ...] = (), per_frame: bool = True) -> Path:
    """Stray Scanner, sensor orientation; `skip` lacks depth; older files have no camera per frame."""
    for name in ("depth", "confidence"):
        (folder / name).mkdir(parents=True)
    camera = integer_centred(sensor_camera(room.camera))
    wrong = camera.copy()
    wrong[0, 0] = wrong[1, 1] = camera[0, 0] * (1.1 if per_frame else 1.0)  # the last frame's, not to be used for the others
    np.savetxt(folder / "camera_matrix.csv", wrong, delimiter=", ")
    lines = ["timestamp, frame, x, y, z, qx, qy, qz, qw"]
    if per_frame:
        lines[0] += ", fx, fy, cx, cy, distortion_center_x, distortion_center_y"
    for k, pose in enumerate(room.poses()):
        phone = sensor_pose(pose)
        quaternion = Rotation.from_matrix(YUP_FROM_ZUP @ phone.rotation).as_quat()
        numbers = [6000.25 + k / 60, *(YUP_FROM_ZUP @ phone.translation), *quaternion]
        row = [f"{numbers[0]:.6f}", f"{k:06d}", *(f"{n:.9f}" for n in numbers[1:])]
        if per_frame:
            row += [f"{n:.6f}" for n in (camera[0, 0], camera[1, 1], camera[0, 2], camera[1, 2])] + ["", ""]
        lines.append(", ".join(row))
        if k not in skip:
            depth = np.rot90(room.depth(pose, room.depth_camera), -1)
            cv2.imwrite(str(folder / "depth" / f"{k:06d}.png"), millimetres(depth))
            cv2.imwrite(str(folder / "confidence" / f"{k:06d}.png"), np.full(depth.shape, 2, np.uint8))
    (folder / "odometry.csv").write_text("\n".join(lines))
    (folder / "imu.csv").write_text("timestamp, a_x, a_y, a_z")
    shutil.copy(HEVC, folder / "rgb.mp4")
    return folder


def write_polycam(folder: Path, room: TinyRoom, *, corrected: bool = True, confidence: int = 255) -> Path:
    """Polycam's raw export, named by microseconds; the uncorrected cameras are wrong where corrected ones exist."""
    kinds = ("", "corrected_") if corrected else ("",)
    for name in ("depth", "confidence", *(f"{k}{part}" for k in kinds for part in ("images", "cameras"))):
        (folder / "keyframes" / name).mkdir(parents=True)
    (folder / "mesh_info.json").write_text("{}")
    for k, pose in enumerate(room.poses()):
        stem, keyframes = str(2_145_432_100 + 250_000 * k), folder / "keyframes"
        rows = np.column_stack([YUP_FROM_ZUP @ pose.rotation @ CAMERA_CV_FROM_GL, YUP_FROM_ZUP @ pose.translation])
        matrix = integer_centred(room.camera)
        for kind in kinds:
            focal = room.focal if kind == kinds[-1] else room.focal * 1.2
            camera = {"fx": focal, "fy": focal, "cx": matrix[0, 2], "cy": matrix[1, 2], "blur_score": 120.0}
            camera |= {"width": room.rgb_size[0], "height": room.rgb_size[1], "timestamp": int(stem)}
            camera |= {f"t_{r}{c}": rows[r, c] for r in range(3) for c in range(4)}
            (keyframes / f"{kind}cameras" / f"{stem}.json").write_text(json.dumps(camera))
            (keyframes / f"{kind}images" / f"{stem}.jpg").write_bytes(jpeg(room.image(pose, room.camera)))
        depth = room.depth(pose, room.depth_camera)
        cv2.imwrite(str(keyframes / "depth" / f"{stem}.png"), millimetres(depth))
        cv2.imwrite(str(keyframes / "confidence" / f"{stem}.png"), np.full(depth.shape, confidence, np.uint8))
    return folder


def write_scanner_app(folder: Path, room: TinyRoom, *, without_photo: tuple[int, ...] = ()) -> Path:
    """3D Scanner App in sensor orientation; camera files hold ARKit's poses and the photo's calibration matrix."""
    folder.mkdir(parents=True)
    (folder / "info.json").write_text('{"title": "Untitled Scan"}')
    matrix = integer_centred(sensor_camera(room.camera)).ravel().tolist()
    for k, pose in enumerate(room.poses()):
        phone = sensor_pose(pose)
        arkit = Rigid3(YUP_FROM_ZUP @ phone.rotation @ CAMERA_CV_FROM_GL, YUP_FROM_ZUP @ phone.translation)
        camera = {"cameraPoseARFrame": arkit.matrix.ravel().tolist(), "intrinsics": matrix, "time": 402896.9 + 0.25 * k}
        (folder / f"frame_{k:05d}.json").write_text(json.dumps(camera))
        depth = np.rot90(room.depth(pose, room.depth_camera), -1)
        cv2.imwrite(str(folder / f"depth_{k:05d}.png"), millimetres(depth))
        cv2.imwrite(str(folder / f"conf_{k:05d}.png"), np.full(depth.shape, k % 3, np.uint8))
        if k not in without_photo:
            sensor = np.ascontiguousarray(np.rot90(room.image(pose, room.camera), -1))
            (folder / f"frame_{k:05d}.jpg").write_bytes(jpeg(sensor))
    return folder


def write_arkitscenes(folder: Path, room: TinyRoom) -> Path:
    """ARKitScenes in sensor orientation: every second image has a pose; names and clocks differ by a millisecond."""
    for name in ("lowres_wide", "lowres_depth", "confidence", "lowres_wide_intrinsics"):
        (folder / name).mkdir(parents=True)
    camera = sensor_camera(room.camera)
    matrix, lines = integer_centred(camera), []
    for k, pose in enumerate(room.poses()):
        phone, time_s = sensor_pose(pose), 4311.2 + 0.1 * k
        camera_from_world = phone.inverse
        numbers = [*Rotation.from_matrix(camera_from_world.rotation).as_rotvec(), *camera_from_world.translation]
        lines.append(f"{time_s + 0.0004:.4f} " + " ".join(f"{n:.9f}" for n in numbers))
        for stamp in (time_s, time_s + 0.05):
            stem = f"41069021_{stamp:.3f}"
            cv2.imwrite(str(folder / "lowres_wide" / f"{stem}.png"), np.rot90(room.image(pose, room.camera), -1))
            later = f"41069021_{stamp + 0.001:.3f}"
            depth = np.rot90(room.depth(pose, room.depth_camera), -1)
            cv2.imwrite(str(folder / "lowres_depth" / f"{later}.png"), millimetres(depth))
            cv2.imwrite(str(folder / "confidence" / f"{stem}.png"), np.full(depth.shape, 2, np.uint8))
            (folder / "lowres_wide_intrinsics" / f"{later}.pincam").write_text(
                f"{camera.width} {camera.height} {matrix[0, 0]} {matrix[1, 1]} {matrix[0, 2]} {matrix[1, 2]}"
            )
    (folder / "lowres_wide.traj").write_text("\n".join(lines))
    return folder


def write_scannet(folder: Path, room: TinyRoom, *, lost: tuple[int, ...] = ()) -> Path:
    """ScanNet's export; the depth camera has its own calibration, lost poses are -inf."""
    for name in ("color", "depth", "pose", "intrinsic"):
        (folder / name).mkdir(parents=True)
    for kind, camera in (("color", room.camera), ("depth", room.depth_camera)):
        matrix = np.eye(4)
        matrix[:3, :3] = integer_centred(camera)
        np.savetxt(folder / "intrinsic" / f"intrinsic_{kind}.txt", matrix)
        np.savetxt(folder / "intrinsic" / f"extrinsic_{kind}.txt", np.eye(4))
    for k, pose in enumerate(room.poses()):
        (folder / "color" / f"{k}.jpg").write_bytes(jpeg(room.image(pose, room.camera)))
        cv2.imwrite(str(folder / "depth" / f"{k}.png"), millimetres(room.depth(pose, room.depth_camera)))
        np.savetxt(folder / "pose" / f"{k}.txt", np.full((4, 4), -np.inf) if k in lost else pose.matrix)
    return folder


def write_scannetpp(folder: Path, room: TinyRoom, *, aligned: bool = True) -> Path:
    """ScanNet++'s iPhone folder in sensor orientation: the JSON also has frames of the video that were not extracted."""
    for name in ("rgb", "depth"):
        (folder / name).mkdir(parents=True)
    camera, entries = integer_centred(sensor_camera(room.camera).resized(1920, 1440)), {}
    for k, pose in enumerate(room.poses()):
        phone, number = sensor_pose(pose), 10 * k
        sensor = np.ascontiguousarray(np.rot90(room.image(pose, room.camera), -1))
        (folder / "rgb" / f"frame_{number:06d}.jpg").write_bytes(jpeg(sensor))
        depth = np.rot90(room.depth(pose, room.depth_camera), -1)
        cv2.imwrite(str(folder / "depth" / f"frame_{number:06d}.png"), millimetres(depth))
        for later in (number, number + 1):
            entry = {"timestamp": 402.5 + later / 60, "intrinsic": camera.tolist(), "pose": (TILTED @ phone).matrix.tolist()}
            entries[f"frame_{later:06d}"] = entry | ({"aligned_pose": phone.matrix.tolist()} if aligned else {})
    (folder / "pose_intrinsic_imu.json").write_text(json.dumps(entries))
    return folder


def write_threedmatch(folder: Path, room: TinyRoom, *, intrinsics: bool = True, sequences: int = 1) -> Path:
    """A 3DMatch scene: sequences below it, with their calibration and gravity in it; rotations are off by 2e-4."""
    for s in range(sequences):
        sequence = folder / f"seq-{s + 1:02d}"
        sequence.mkdir(parents=True)
        for k, pose in enumerate(room.poses()):
            cv2.imwrite(str(sequence / f"frame-{k:06d}.color.png"), room.image(pose, room.camera))
            depth = millimetres(room.depth(pose, room.camera))
            depth[0, :2] = 65535
            cv2.imwrite(str(sequence / f"frame-{k:06d}.depth.png"), depth)
            matrix = (TILTED @ pose).matrix
            matrix[:3, :3] *= 1.0002
            np.savetxt(sequence / f"frame-{k:06d}.pose.txt", matrix)
    if intrinsics:
        np.savetxt(folder / "camera-intrinsics.txt", integer_centred(room.camera))
    np.savetxt(folder / "gravity-direction.txt", TILTED.rotation @ [0.0, 0.0, -1.0])
    return folder


def write_redwood(folder: Path, room: TinyRoom, *, first: int = 0, calibrated: bool = True) -> Path:
    """Redwood / Open3D; images may count from 1 while the log counts from 0."""
    for name in ("color", "depth"):
        (folder / name).mkdir(parents=True)
    lines = []
    for k, pose in enumerate(room.poses()):
        (folder / "color" / f"{k + first:05d}.jpg").write_bytes(jpeg(room.image(pose, room.camera)))
        cv2.imwrite(str(folder / "depth" / f"{k + first:05d}.png"), millimetres(room.depth(pose, room.camera)))
        lines += [f"{k} {k} {k + 1}", *(" ".join(f"{n:.17g}" for n in row) for row in (TILTED @ pose).matrix)]
    (folder / "trajectory.log").write_text("\n".join(lines))
    if calibrated:
        matrix = integer_centred(room.camera).T.ravel().tolist()
        camera = {"width": room.rgb_size[0], "height": room.rgb_size[1], "intrinsic_matrix": matrix}
        (folder / "camera.json").write_text(json.dumps(camera))
    return folder


def write_rtabmap(folder: Path, room: TinyRoom, *, by_id: bool = False, of_camera: bool = True) -> Path:
    """rtabmap-export: files named by time or by node, poses of the camera or of the device that carries it."""
    for name in ("rgb", "depth", "calib"):
        (folder / f"kitchen_{name}").mkdir(parents=True)
    optical = Rigid3(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([0.02, 0.0, 0.05]))
    matrix, (width, height) = integer_centred(room.camera), room.rgb_size
    rows = ["#timestamp x y z qx qy qz qw id"]
    for k, pose in enumerate(room.poses()):
        stamp, node = 1700000000.25 + 0.25 * k, 5 * k
        stem = str(node) if by_id else f"{stamp:f}"
        (folder / "kitchen_rgb" / f"{stem}.jpg").write_bytes(jpeg(room.image(pose, room.camera)))
        cv2.imwrite(str(folder / "kitchen_depth" / f"{stem}.png"), millimetres(room.depth(pose, room.depth_camera)))
        numbers = {"camera_matrix": matrix, "distortion_coefficients": np.zeros(5), "local_transform": optical.matrix[:3]}
        blocks = [
            f"{key}:\n   rows: 3\n   cols: 3\n   data: [{', '.join(f'{n:.17g}' for n in np.ravel(values))}]"
            for key, values in numbers.items()
        ]
        head = f"%YAML:1.0\n---\ncamera_name: '{stem}'\nimage_width: {width}\nimage_height: {height}"
        (folder / "kitchen_calib" / f"{stem}.yaml").write_text("\n".join([head, *blocks]) + "\n")
        stored = pose if of_camera else pose @ optical.inverse
        quaternion = Rotation.from_matrix(stored.rotation).as_quat()
        rows.append(" ".join([f"{stamp:.6f}", *(f"{n:.17g}" for n in (*stored.translation, *quaternion)), str(node)]))
    (folder / f"kitchen_{'camera_' if of_camera else ''}poses.txt").write_text("\n".join(rows) + "\n")
    return folder


def write_nerfstudio(folder: Path, room: TinyRoom, *, depth: bool = True, npy: bool = False, **top: object) -> Path:
    """transforms.json with the camera in every frame; `top`: keys to add."""
    for name in ("images", "depths"):
        (folder / name).mkdir(parents=True)
    entries, camera = [], room.camera  # its cx, cy count from the first pixel's corner
    for k, pose in enumerate(room.poses()):
        image = folder / "images" / f"frame_{k:05d}.jpg"
        image.write_bytes(jpeg(room.image(pose, camera)))
        metres = room.depth(pose, room.depth_camera)
        file = f"depths/frame_{k:05d}.{'npy' if npy else 'png'}"
        if npy:
            np.save(folder / file, (metres * 1000).astype(np.float32))
        else:
            cv2.imwrite(str(folder / file), millimetres(metres))
        world_from_gl = Rigid3(pose.rotation @ CAMERA_CV_FROM_GL, pose.translation)
        entry = {"file_path": f"./images/{image.name}", "transform_matrix": world_from_gl.matrix.tolist()}
        entry |= {"fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx, "cy": camera.cy, "w": camera.width, "h": camera.height}
        entries.append({**entry, "depth_file_path": file} if depth else entry)
    (folder / "transforms.json").write_text(json.dumps({"camera_model": "OPENCV", **top, "frames": entries[::-1]}))
    return folder


def write_arti4d(folder: Path, room: TinyRoom, *, flipped: bool = False, tf: bool = True) -> Path:
    """A raw sequence of Arti4D: poses are of a tracked base; `flipped` scenes were filmed upside down and rotated back."""
    for name in ("rgb", "depth", "odom"):
        (folder / name).mkdir(parents=True)
    base_from_depth, depth_from_rgb = TILTED, Rigid3(np.eye(3), np.array([0.03, 0.001, -0.002]))
    turned = Rigid3(np.diag([-1.0, -1.0, 1.0]), np.zeros(3)) if flipped else Rigid3()
    rows = ["timestamp, x, y, z, qx, qy, qz, qw"]
    for k, pose in enumerate(room.poses()):
        time_s = 1_744_364_672 + k / 30
        stamp = f"{time_s:.9f}".replace(".", "")
        (folder / "rgb" / f"rgb_{stamp}.jpg").write_bytes(jpeg(room.image(pose, room.camera)))
        cv2.imwrite(str(folder / "depth" / f"depth_{stamp}.png"), millimetres(room.depth(pose, room.camera)))
        base = pose @ turned @ (base_from_depth @ depth_from_rgb).inverse
        numbers = [*base.translation, *Rotation.from_matrix(base.rotation).as_quat()]
        rows.append(", ".join([f"{time_s:.9f}", *(f"{n:.12f}" for n in numbers)]))
    (folder / "odom" / f"{folder.name}.csv").write_text("\n".join(rows))
    for name in ("rgb", "depth"):
        matrix = ", ".join(str(n) for n in integer_centred(room.camera).ravel())
        text = f"header:\n  seq: 1\nheight: {room.camera.height}\nwidth: {room.camera.width}\nD: (0.0, 0.0)\nK: ({matrix})\n"
        (folder / name / "camera_info.txt").write_text(text)
    if tf:
        tree = {"base_T_depth": _ros_transform(base_from_depth), "depth_T_rgb": _ros_transform(depth_from_rgb)}
        (folder / "azure_tf.json").write_text(json.dumps(tree))
    return folder


def _ros_transform(pose: Rigid3) -> dict[str, dict[str, float]]:
    return {
        "rotation": dict(zip("xyzw", Rotation.from_matrix(pose.rotation).as_quat().tolist(), strict=True)),
        "translation": dict(zip("xyz", pose.translation.tolist(), strict=True)),
    }


def millimetres(depth_m: np.ndarray) -> np.ndarray:
    """uint16 millimetres."""
    return np.rint(depth_m * 1000).astype(np.uint16)


def told(recording, words):
    """Whether a notice contains these words."""
    return any(words in notice for notice in recording.notices)
