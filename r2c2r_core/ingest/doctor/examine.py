"""Capture doctor: measures a recording, tests for wrong conventions, and derives a verdict."""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.ingest.doctor.hypotheses import Poses, find_convention, find_scale
from r2c2r_core.ingest.doctor.light import grey_views
from r2c2r_core.ingest.doctor.measures import measure, moments
from r2c2r_core.ingest.doctor.pairs import far_pairs, neighbours, stack_views
from r2c2r_core.ingest.doctor.registration import measure_registration
from r2c2r_core.ingest.doctor.report import CaptureReport
from r2c2r_core.ingest.doctor.unit import likely_unit
from r2c2r_core.ingest.doctor.verdict import judge, plausible, worst
from r2c2r_core.ingest.readers.protocol import Recording
from r2c2r_core.model.capture import Capture
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the examination."""

    views: int = param(60, "count", "Maximum number of frames examined", ge=2)
    far_pairs: int = param(30, "count", "Maximum number of wide-baseline pairs for the scale test", ge=4)
    registered: int = param(30, "count", "Maximum number of frames for the registration of depth to colour", ge=1)


def examine(capture: Capture, recording: Recording | None = None) -> CaptureReport:
    """Examine a recording by up to sixty of its frames; `recording` adds confidence and frames that thinning left out."""
    capture = capture.as_recorded  # refined poses would hide what is wrong with the recording
    rng = np.random.default_rng(0)
    params, count = tuned(Params), len(capture.frames)
    positions = np.unique(np.linspace(0, count - 1, min(params.views, count)).round().astype(np.int64))
    views = stack_views(capture.frames, capture.images, list(positions), rng)
    near = neighbours(views)
    as_recorded = views.posed(*_recorded_poses(capture, positions))
    shifted = [(places, _recorded_poses(capture, positions + places)) for places in (1, -1)]
    convention, mended = find_convention(as_recorded, near, shifted)
    scale = find_scale(mended, far_pairs(mended, params.far_pairs))
    spread = positions[:: -(-len(positions) // params.registered)]
    registration = measure_registration([capture.frames[p] for p in spread], capture.images, rng)
    grey = grey_views(capture, views)
    figures = measure(capture, views, near, grey, recording)
    recorded_m = figures.recorded_depth_m
    odd = recording is not None and recorded_m is not None and not plausible(recorded_m)
    unit = likely_unit(capture, recording, recorded_m, rng) if odd and recording and recorded_m else None
    remarks = judge(figures, convention, scale, registration, unit)
    return CaptureReport(
        format=capture.format,
        verdict=worst(remarks),
        remarks=remarks,
        figures=figures,
        moments=moments(capture, views, near, grey),
        convention=convention,
        scale=scale,
        registration=registration,
        notices=capture.notices,
    )


def _recorded_poses(capture: Capture, positions: np.ndarray) -> Poses:
    """Poses of the frames at these positions in the recording's world; beyond its ends, those of the first and the last."""
    within = np.clip(positions, 0, len(capture.frames) - 1)
    poses = [capture.world_from_capture.inverse @ capture.frames[p].world_from_camera for p in within]
    return np.stack([p.rotation for p in poses]), np.stack([p.translation for p in poses])
