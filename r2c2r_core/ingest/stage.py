"""Ingest (paper §3): reads one recording into one levelled Capture; all foreign conventions are converted here.

Reading and levelling are separate steps, so a manual correction of the room does not decode the recording again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.cloud import fuse_frames
from r2c2r_core.ingest.depth import usable_depth
from r2c2r_core.ingest.exposure import balance_exposure
from r2c2r_core.ingest.flying import drop_flying
from r2c2r_core.ingest.gravity import level_room
from r2c2r_core.ingest.noise import estimate_depth_noise
from r2c2r_core.ingest.odometry import estimate_poses
from r2c2r_core.ingest.planes import sample_surface
from r2c2r_core.ingest.poses import SettledPoses, refine_poses
from r2c2r_core.ingest.readers.protocol import RawDepth, RawFrame, Recording, UnreadableFrame
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.registering import register_depth
from r2c2r_core.ingest.rgb import stored_jpeg
from r2c2r_core.ingest.store import StoredImages, new_store, open_images, write_depth, write_rgb
from r2c2r_core.model.capture import Capture, Frame, PoseEvidence, Scan, SceneSurface
from r2c2r_core.model.inputs import Overrides
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.schema.settings import setting, tuned_numbers
from r2c2r_core.tuning import Changes

__all__ = ["IngestConfig", "level_scan", "open_images", "read_capture", "read_recording"]


@dataclass(frozen=True, slots=True, kw_only=True)
class IngestConfig:
    """How a recording is read."""  # a LiDAR's handle of 2 x 20 cm stays; the outliers of the paper are mostly true surface

    most_frames: int = setting(600, "maximum number of frames: of more, every n-th is kept", ge=1, le=100_000)
    near_m: float = setting(0.08, "minimum depth used, in m: a phone's LiDAR starts at about 0.1", ge=0, le=100)
    far_m: float = setting(8.0, "maximum depth used, in m: beyond, Kinect and LiDAR err by decimetres", gt=0, le=100)
    fused_frames: int = setting(120, "maximum number of frames fused into the surface", ge=1, le=10_000)
    fused_far_m: float = setting(
        4.0, "maximum depth fused, in m: beyond, the bias of a Kinect or a phone bends the surface", gt=0, le=100
    )
    finest_voxel_m: float = setting(0.01, "voxel size of the fusion in a small room, in m", ge=0.002, le=1)
    coarsest_voxel_m: float = setting(0.025, "voxel size of the fusion in a large room, in m", ge=0.002, le=1)
    smallest_part_m2: float = setting(0.004, "minimum area of a connected part of the surface, in m²", ge=0, le=10)
    outlier_neighbours: int = setting(
        0, "neighbours of the statistical outlier filter (20 in the paper); 0 keeps all points", ge=0, le=1000
    )
    most_bad_share: float = setting(0.2, "maximum fraction of unreadable frames before a recording is refused", ge=0, le=1)
    least_valid_share: float = setting(
        0.2, "minimum fraction of the median frame with high-confidence depth to use that depth alone", ge=0, le=1
    )
    depth_scale: float = setting(
        1.0,
        "factor on the recorded depth, which converts it to metres: 0.1 if 1/10000 m was read as 1/1000 m",
        gt=0,
        le=10_000,
    )
    scale: float = setting(
        1.0,
        "factor on all lengths of the recording, depth and camera path alike, such as from a tape measure",
        ge=0.2,
        le=5,
    )
    register_depth: bool = setting(
        False, "whether depth is registered to the colour images, by the fit that `r2c2r info` reports"
    )
    seed: int = setting(0, "random seed", ge=0, lt=2**31)
    params: Changes = tuned_numbers("ingest")


def read_capture(
    source: Path, store: Path, config: IngestConfig, *, overrides: Overrides | None = None, progress: Progress = SILENT
) -> Capture:
    """Read a recording and level it; images go to the folder `store`. Raises CaptureError, EnvironmentProblem, Cancelled."""
    scan = read_recording(source, store, config, progress=progress.part(0.0, 0.95))
    return level_scan(scan, overrides or Overrides(objects={}), config, progress=progress.part(0.95, 1.0))


def read_recording(source: Path, store: Path, config: IngestConfig, *, progress: Progress = SILENT) -> Scan:
    """Decode a recording and fuse its surface, in its own world frame; its images are written to the folder `store`."""
    progress.at(0.0, "opening the recording")
    recording = open_recording(source)
    raw, thinned = _thinned(recording.frames, config.most_frames)
    least_confidence, unsure = _least_confidence(recording, raw, config)
    with new_store(store) as partial:
        frames, bad = _store_frames(recording, raw, partial, least_confidence, config, progress.part(0.0, 0.5))
        images = StoredImages(partial)
        registered: tuple[str, ...] = ()
        if config.register_depth:
            rng = np.random.default_rng(config.seed)
            frames, told = register_depth(frames, images, partial, rng, progress.part(0.45, 0.5))
            images, registered = StoredImages(partial), (told,)
        settled = _settle_poses(frames, raw, images, config, progress.part(0.5, 0.65))
        drop_flying(settled.frames, images, partial, progress.part(0.65, 0.8))
    images = StoredImages(store)
    surface, voxel_m = fuse_frames(
        settled.frames,
        images,
        most_frames=config.fused_frames,
        finest_voxel_m=config.finest_voxel_m,
        coarsest_voxel_m=config.coarsest_voxel_m,
        depth_max_m=config.fused_far_m,
        smallest_part_m2=config.smallest_part_m2,
        outlier_neighbours=config.outlier_neighbours,
        progress=progress.part(0.8, 0.97),
    )
    noise = estimate_depth_noise(settled.frames, images, surface.vertices, surface.faces)
    rng = np.random.default_rng(config.seed)
    of_light = progress.part(0.97, 0.99)
    balanced = balance_exposure(settled.frames, images, surface.vertices, surface.faces, noise, rng, of_light)
    progress.at(0.99, "hashing")
    sha256 = recording.files.sha256(recording.names)
    own_world = settled.evidence.source != "odometry"  # an estimated one is the first camera's
    progress.at(1.0, f"{len(frames)} frames")
    return Scan(
        name=source.stem if source.is_file() else source.name,
        sha256=sha256,
        format=recording.format,
        frames=balanced,
        surface=SceneSurface(vertices_world=surface.vertices, faces=surface.faces, colours=surface.colours, voxel_m=voxel_m),
        images=images,
        up_capture=recording.up_capture if own_world else None,
        other_ups=recording.other_ups if own_world else (),
        notices=(*_scaled(config.scale), *registered, *recording.notices, *thinned, *unsure, *bad, *settled.notices),
        poses=settled.evidence,
        depth_noise=noise,
    )


def level_scan(scan: Scan, overrides: Overrides, config: IngestConfig, *, progress: Progress = SILENT) -> Capture:
    """The scan with +Z up: floor, yaw and walls are estimated or overridden; one rigid motion moves its poses and surface."""
    progress.at(0.0, "levelling")
    rng = np.random.default_rng(config.seed)
    sample = sample_surface(scan.surface.vertices_world, scan.surface.faces, 30_000, rng)
    cameras = [f.world_from_camera for f in scan.frames]
    levelled = level_room(sample, cameras, scan.up_capture, overrides, rng, other_ups=scan.other_ups)
    motion = levelled.world_from_capture
    return Capture(
        name=scan.name,
        sha256=scan.sha256,
        format=scan.format,
        frames=tuple(_in_world(f, motion) for f in scan.frames),
        world_from_capture=motion,
        room=levelled.room,
        surface=replace(scan.surface, vertices_world=motion.apply(scan.surface.vertices_world)),
        images=scan.images,
        notices=(*scan.notices, *levelled.notices),
        poses=_given_in_world(scan.poses, motion),
        depth_noise=scan.depth_noise,
        scale=config.scale,
    )


def _store_frames(
    recording: Recording, raw: Sequence[RawFrame], store: Path, least_confidence: int, config: IngestConfig, progress: Progress
) -> tuple[tuple[Frame, ...], tuple[str, ...]]:
    """Write every frame's images; return the frames (still in the capture's world) and a notice about skipped ones."""
    frames: list[Frame] = []
    problems: list[str] = []
    unsure: list[str] = []
    for position, frame in enumerate(raw):
        progress.at(position / len(raw), f"reading frame {position + 1}/{len(raw)}")
        try:
            depth = recording.depth_of(frame)
            frames.append(_store_frame(recording, frame, depth, store, least_confidence, config))
            unsure += [depth.damage] if depth.damage else []
        except (UnreadableFrame, CaptureError) as problem:
            problems.append(str(problem))
        if len(problems) > config.most_bad_share * len(raw):
            raise CaptureError(
                f"{recording.files.source}: {len(problems)} of {position + 1} frames cannot be used, first {problems[0]}",
                hint="export or copy the recording again",
            )
    left_out = f"{len(problems)} of {len(raw)} frames cannot be used and were left out"
    no_confidence = f"the confidence of {len(unsure)} of {len(frames)} frames cannot be read: all their depth is used"
    told = ((left_out, problems), (no_confidence, unsure))
    return tuple(frames), tuple(f"{text}, first {named[0]}" for text, named in told if named)


def _store_frame(
    recording: Recording, frame: RawFrame, raw: RawDepth, store: Path, least_confidence: int, config: IngestConfig
) -> Frame:
    size = (frame.rgb_camera.width, frame.rgb_camera.height)
    jpeg, sharpness = stored_jpeg(recording.colour_of(frame), frame.rgb_name, size)
    depth = usable_depth(
        raw.metres * np.float32(config.depth_scale * config.scale),
        raw.confidence,
        frame.depth_camera,
        least_confidence=least_confidence,
        near_m=config.near_m,
        far_m=config.far_m,
    )
    write_rgb(store, frame.index, jpeg)
    write_depth(store, frame.index, depth)
    given = frame.capture_from_camera or Rigid3()  # finally set once all frames are read
    return Frame(
        index=frame.index,
        timestamp_s=frame.timestamp_s,
        rgb_camera=frame.rgb_camera,
        depth_camera=frame.depth_camera,
        world_from_camera=replace(given, translation=config.scale * given.translation),
        sharpness=sharpness,
    )


def _scaled(scale: float) -> tuple[str, ...]:
    return () if scale == 1.0 else (f"all lengths were multiplied by {scale:.4f}, as a person measured",)


def _settle_poses(
    frames: tuple[Frame, ...], raw: Sequence[RawFrame], images: StoredImages, config: IngestConfig, progress: Progress
) -> SettledPoses:
    """The recording's poses, refined where they drift, or estimated by RGB-D odometry where it has none."""
    posed = {f.index for f in raw if f.capture_from_camera is not None}
    if not posed:
        return estimate_poses(frames, images, most_keyframes=config.fused_frames, far_m=config.fused_far_m, progress=progress)
    kept = tuple(f for f in frames if f.index in posed)
    settled = refine_poses(kept, images, most_keyframes=config.fused_frames, far_m=config.fused_far_m, progress=progress)
    if len(kept) == len(frames):
        return settled
    lost = f"{len(frames) - len(kept)} of {len(frames)} frames have no pose and were left out"
    return settled._replace(notices=(lost, *settled.notices))


def _thinned(frames: tuple[RawFrame, ...], most: int) -> tuple[tuple[RawFrame, ...], tuple[str, ...]]:
    step = -(-len(frames) // most)
    if step == 1:
        return frames, ()
    kept = frames[::step]
    return kept, (f"{len(kept)} of {len(frames)} frames were kept, one in {step}; frame numbers are the recording's",)


def _least_confidence(recording: Recording, frames: Sequence[RawFrame], config: IngestConfig) -> tuple[int, tuple[str, ...]]:
    """Minimum confidence: high (2), or medium (1) with a notice where high alone leaves too little of the median frame."""
    shares = [s for s in (_sure_share(recording, f) for f in frames[:: max(1, len(frames) // 25)]) if s is not None]
    if not shares or float(np.median(shares)) >= config.least_valid_share:
        return 2, ()
    return 1, (f"high-confidence depth covers only {np.median(shares):.0%} of the median frame: medium confidence is used too",)


def _sure_share(recording: Recording, frame: RawFrame) -> float | None:
    try:
        raw = recording.depth_of(frame)
    except (UnreadableFrame, CaptureError):
        return None
    if raw.confidence is None:
        return None
    with np.errstate(invalid="ignore"):
        return float(((raw.confidence >= 2) & (raw.metres > 0)).mean())


def _given_in_world(evidence: PoseEvidence, world_from_capture: Rigid3) -> PoseEvidence:
    return evidence if evidence.given is None else replace(evidence, given=world_from_capture.matrix @ evidence.given)


def _in_world(frame: Frame, world_from_capture: Rigid3) -> Frame:
    return replace(frame, world_from_camera=world_from_capture @ frame.world_from_camera)
