"""Ingest (paper §3): one recording in, one levelled Capture out; every foreign convention ends here."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from r2c2r_core.errors import CaptureError
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.ingest.cloud import fuse_frames
from r2c2r_core.ingest.depth import usable_depth
from r2c2r_core.ingest.flying import drop_flying
from r2c2r_core.ingest.gravity import level_room
from r2c2r_core.ingest.odometry import estimate_poses
from r2c2r_core.ingest.planes import sample_surface
from r2c2r_core.ingest.poses import SettledPoses, refine_poses
from r2c2r_core.ingest.readers.protocol import RawFrame, Recording, UnreadableFrame
from r2c2r_core.ingest.readers.table import open_recording
from r2c2r_core.ingest.rgb import stored_jpeg
from r2c2r_core.ingest.store import StoredImages, new_store, open_images, write_depth, write_rgb
from r2c2r_core.model.capture import Capture, Frame, PoseEvidence, SceneSurface
from r2c2r_core.model.inputs import Overrides
from r2c2r_core.progress import SILENT, Progress

__all__ = ["IngestConfig", "open_images", "read_capture"]


@dataclass(frozen=True, slots=True, kw_only=True)
class IngestConfig:
    """How a recording is read. Measured defaults: see tests/core/ingest."""

    most_frames: int = 600  # longer recordings keep every n-th frame; numbers stay
    near_m: float = 0.08  # a phone's LiDAR starts at about 0.1 m
    far_m: float = 8.0  # beyond, Kinect and LiDAR are off by decimetres
    fused_frames: int = 120
    fused_far_m: float = 4.0  # beyond, the bias of a Kinect or a phone bends the surface
    finest_voxel_m: float = 0.01
    coarsest_voxel_m: float = 0.025
    smallest_part_m2: float = 0.004  # a handle 2 x 20 cm stays
    outlier_neighbours: int = 0  # the paper removes statistical outliers by 20 neighbours: mostly true surface (cloud.py)
    most_bad_share: float = 0.2
    least_valid_share: float = 0.2  # high confidence alone must leave this much of the median frame
    seed: int = 0


def read_capture(
    source: Path, store: Path, config: IngestConfig, *, overrides: Overrides | None = None, progress: Progress = SILENT
) -> Capture:
    """Read a recording; its images are written below `store`. Raises CaptureError, EnvironmentProblem, Cancelled."""
    progress.at(0.0, "opening the recording")
    recording = open_recording(source)
    raw, thinned = _thinned(recording.frames, config.most_frames)
    least_confidence, unsure = _least_confidence(recording, raw, config)
    with new_store(store) as partial:
        frames, bad = _store_frames(recording, raw, partial, least_confidence, config, progress.part(0.0, 0.5))
    images = StoredImages(store)
    settled = _settle_poses(frames, raw, images, config, progress.part(0.5, 0.65))
    if drop_flying(settled.frames, images, store, progress.part(0.65, 0.75)):
        images = StoredImages(store)  # without what it has read already
    surface, voxel_m = fuse_frames(
        settled.frames,
        images,
        most_frames=config.fused_frames,
        finest_voxel_m=config.finest_voxel_m,
        coarsest_voxel_m=config.coarsest_voxel_m,
        depth_max_m=config.fused_far_m,
        smallest_part_m2=config.smallest_part_m2,
        outlier_neighbours=config.outlier_neighbours,
        progress=progress.part(0.75, 0.9),
    )
    progress.at(0.9, "levelling")
    rng = np.random.default_rng(config.seed)
    sample = sample_surface(surface.vertices, surface.faces, 30_000, rng)
    file_up = None if settled.evidence.source == "odometry" else recording.up_capture  # such a world is the first camera's
    levelled = level_room(sample, [f.world_from_camera for f in settled.frames], file_up, overrides, rng)
    progress.at(0.97, "hashing")
    sha256 = recording.files.sha256(recording.names)
    progress.at(1.0, f"{len(frames)} frames")
    return Capture(
        name=source.stem if source.is_file() else source.name,
        sha256=sha256,
        format=recording.format,
        frames=tuple(_in_world(f, levelled.world_from_capture) for f in settled.frames),
        world_from_capture=levelled.world_from_capture,
        room=levelled.room,
        surface=SceneSurface(
            vertices_world=levelled.world_from_capture.apply(surface.vertices),
            faces=surface.faces,
            colours=surface.colours,
            voxel_m=voxel_m,
        ),
        images=images,
        notices=(*recording.notices, *thinned, *unsure, *bad, *settled.notices, *levelled.notices),
        poses=_given_in_world(settled.evidence, levelled.world_from_capture),
    )


def _store_frames(
    recording: Recording, raw: Sequence[RawFrame], store: Path, least_confidence: int, config: IngestConfig, progress: Progress
) -> tuple[tuple[Frame, ...], tuple[str, ...]]:
    """Write every frame's images; the frames (still in the capture's world) and a notice about those left out."""
    frames: list[Frame] = []
    problems: list[str] = []
    for position, frame in enumerate(raw):
        progress.at(position / len(raw), f"reading frame {position + 1}/{len(raw)}")
        try:
            frames.append(_store_frame(recording, frame, store, least_confidence, config))
        except (UnreadableFrame, CaptureError) as problem:
            problems.append(str(problem))
        if len(problems) > config.most_bad_share * len(raw):
            raise CaptureError(
                f"{recording.files.source}: {len(problems)} of {position + 1} frames cannot be used, first {problems[0]}",
                hint="export or copy the recording again",
            )
    notices = (
        (f"{len(problems)} of {len(raw)} frames cannot be used and were left out, first {problems[0]}",) if problems else ()
    )
    return tuple(frames), notices


def _store_frame(recording: Recording, frame: RawFrame, store: Path, least_confidence: int, config: IngestConfig) -> Frame:
    size = (frame.rgb_camera.width, frame.rgb_camera.height)
    jpeg, sharpness = stored_jpeg(recording.colour_of(frame), frame.rgb_name, size)
    raw = recording.depth_of(frame)
    depth = usable_depth(
        raw.metres,
        raw.confidence,
        frame.depth_camera,
        least_confidence=least_confidence,
        near_m=config.near_m,
        far_m=config.far_m,
    )
    write_rgb(store, frame.index, jpeg)
    write_depth(store, frame.index, depth)
    return Frame(
        index=frame.index,
        timestamp_s=frame.timestamp_s,
        rgb_camera=frame.rgb_camera,
        depth_camera=frame.depth_camera,
        world_from_camera=frame.capture_from_camera or Rigid3(),  # settled once all frames are there
        sharpness=sharpness,
    )


def _settle_poses(
    frames: tuple[Frame, ...], raw: Sequence[RawFrame], images: StoredImages, config: IngestConfig, progress: Progress
) -> SettledPoses:
    """The recording's poses, refined where they drift; estimated where it has none at all."""
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
    """High confidence (2), or medium (1) with a notice where high alone leaves too little of the median frame."""
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
