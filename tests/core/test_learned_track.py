"""Tracks of a learned segmenter suffice for every later stage: a model's masks in, a scene with a drawer out."""

from dataclasses import replace
from pathlib import Path

import pytest

from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.align.stage import AlignConfig, Placer
from r2c2r_core.generate.stage import GENERATORS, GenerateConfig, generate_candidates
from r2c2r_core.overrides import NO_OVERRIDES
from r2c2r_core.segment.geometric.session import GeometricSegmenter
from r2c2r_core.segment.learned.session import LearnedSession
from r2c2r_core.segment.stage import SegmentConfig
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from r2c2r_core.warp.stage import WarpConfig, fit_meshes
from tests.core.segment.learned.test_session import TrueMasks
from tests.core.segment.scenes import DRAWERS, FRONT_Y, click_on, kitchen, prompt

QUICK = AlignConfig(views=4, match_photos=1, match_views=8, settled=12, refined=2)


def test_a_learned_track_passes_through_all_later_stages(tmp_path: Path) -> None:
    capture, truth = kitchen()
    config = SegmentConfig()
    prepared = GeometricSegmenter().open(capture, tmp_path, config)
    model = TrueMasks([truth["drawer_mid"][frame.index] for frame in capture.frames])
    session = LearnedSession(name="sam2", model=model, prepared=prepared, config=config)  # type: ignore[arg-type]
    left, width, bottom, height = DRAWERS["drawer_mid"]
    middle = (left + 0.3 * width, FRONT_Y, bottom + 0.3 * height)
    track = session.track(prompt("drawer_mid", "drawer", click_on(capture, middle, 60)))
    few = replace(GenerateConfig(), count=1, pool_frames=6)
    candidates = generate_candidates(capture, track, GENERATORS.default, few)
    placement = Placer(MATCHERS.default, QUICK)(capture, track, candidates.chosen)
    scene = build_scene(capture, [track], [placement], [candidates.chosen], NO_OVERRIDES, SynthesizeConfig())
    fitted = fit_meshes(scene, [track], [placement], [candidates.chosen], WarpConfig())
    (drawer,) = fitted.objects
    assert [joint.type for joint in drawer.joints] == ["prismatic"]
    assert drawer.dimensions_m[0] == pytest.approx(width, abs=0.01)
    assert drawer.dimensions_m[2] == pytest.approx(height, abs=0.01)
