from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.export import pictures, scan_fit
from r2c2r_core.export.looks import looks_of
from r2c2r_core.export.pictures import write_pictures
from r2c2r_core.export.plan import Plan, plan_bundle
from r2c2r_core.export.preview import scene_soup, soup_faces
from r2c2r_core.export.scan_fit import ScanFit, f_score, scan_fits
from r2c2r_core.geometry.masks import PackedMask, pack_mask, unpack_mask
from r2c2r_core.geometry.raster import rasterize
from r2c2r_core.model.capture import Depth
from r2c2r_core.model.reconstruction import Reconstruction
from tests.core.export.kitchen import GreyImages, kitchen, reconstruction
from tests.core.motions import motion


class Filmed(GreyImages):
    """Depth images of the kitchen itself, with everything `behind_m` further away."""

    def __init__(self, item: Reconstruction, behind_m: float, hidden_columns: int) -> None:
        soup = scene_soup(plan_bundle(item.scene), 0.0)
        ids = np.repeat(soup.ids[:, None], 3, axis=1)
        self.drawn = {
            frame.index: rasterize(soup.corners, soup_faces(soup), ids, frame.depth_camera, frame.world_from_camera.inverse)
            for frame in item.capture.frames
        }
        self.behind_m, self.hidden_columns = behind_m, hidden_columns

    def depth(self, frame_index: int) -> Depth:
        metres = self.drawn[frame_index].depth_m
        measured = metres + np.float32(self.behind_m)
        measured[:, : self.hidden_columns] = 0.5
        return Depth(measured, measured > np.float32(self.behind_m))


def filmed(behind_m: float, hidden_columns: int = 0) -> Reconstruction:
    """The kitchen as filmed; a foreign surface occludes the left `hidden_columns` of the picture."""
    item = reconstruction(kitchen())
    images = Filmed(item, behind_m, hidden_columns)
    plan = plan_bundle(item.scene)

    def masks(name: str) -> dict:
        own = [k for k, body in enumerate(plan.bodies, start=1) if body.object_name == name]
        shows = {index: np.isin(np.rint(d.attributes[..., 0]), own) for index, d in images.drawn.items()}
        return {index: pack_mask(mask & (np.arange(mask.shape[1]) >= hidden_columns)) for index, mask in shows.items()}

    tracks = tuple(replace(track, masks=masks(track.name)) for track in item.tracks)
    return replace(item, tracks=tracks, capture=replace(item.capture, images=images))


def fits_of(item: Reconstruction, plan: Plan) -> dict[str, ScanFit]:
    return scan_fits(item, plan, looks_of(item.capture, plan))


@pytest.mark.parametrize("behind_m", [0.0, 0.004, 0.015])
def test_the_scan_fit_measures_a_known_offset(behind_m: float) -> None:
    item = filmed(behind_m)
    fit = fits_of(item, plan_bundle(item.scene))["drawer_1"]  # a flat front, filmed straight on
    assert fit.median_m == pytest.approx(behind_m, abs=0.0015)
    assert fit.f_score_1cm == pytest.approx(1.0 if behind_m < 0.01 else 0.0, abs=0.02)
    assert fit.f_score_2cm == pytest.approx(1.0, abs=0.02)


def test_an_object_that_fails_fit_or_picture_is_skipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    item = filmed(0.0)
    plan = plan_bundle(item.scene)
    clicked = {track.name for track in item.tracks}
    broken = item.tracks[0].masks

    def unpacked(mask: PackedMask) -> np.ndarray:
        if any(mask is other for other in broken.values()):
            raise ValueError("cannot reshape array")
        return unpack_mask(mask)

    monkeypatch.setattr(scan_fit, "unpack_mask", unpacked)
    window = pictures._window
    monkeypatch.setattr(pictures, "_window", lambda mask: (unpacked(mask), window(mask))[1])
    assert set(fits_of(item, plan)) == clicked - {item.tracks[0].name}
    assert set(write_pictures(item, plan, tmp_path)) == clicked - {item.tracks[0].name}


def test_surface_occluded_by_an_unsegmented_object_is_not_scored() -> None:
    item = filmed(0.0)
    name = item.tracks[0].name
    left, width = item.tracks[0].masks[0].left, item.tracks[0].masks[0].box_width
    covered = filmed(0.0, hidden_columns=left + width // 2)
    assert covered.tracks[0].masks[0].area_px < 0.7 * item.tracks[0].masks[0].area_px
    assert fits_of(covered, plan_bundle(item.scene))[name].f_score_1cm == pytest.approx(1.0, abs=0.02)


def test_a_perfect_large_mesh_has_an_f_score_of_one() -> None:
    """The widest front has so many points that mesh and scan are subsampled, each with different points."""
    item = filmed(0.0)
    masks = {index: unpack_mask(mask) for index, mask in item.tracks[2].masks.items()}
    assert sum(int(mask.sum()) for mask in masks.values()) > 20_000
    for mask in masks.values():
        mask[np.flatnonzero(mask.any(axis=1))[0]] = False
    shorter = replace(item.tracks[2], masks={index: pack_mask(mask) for index, mask in masks.items()})
    fits = fits_of(replace(item, tracks=(shorter,)), plan_bundle(item.scene))
    assert fits["double_1"].f_score_1cm > 0.995


def test_frames_with_an_open_door_are_excluded_from_the_fit() -> None:
    item = filmed(0.0)
    opened = motion(dict.fromkeys(item.tracks[0].masks, 1.0), "left")
    tracks = (replace(item.tracks[0], motions=(opened,)), *item.tracks[1:])
    found = fits_of(replace(item, tracks=tracks), plan_bundle(item.scene))
    assert item.tracks[0].name not in found
    assert item.tracks[1].name in found


def test_objects_without_depth_points_have_no_fit() -> None:
    item = filmed(0.0)
    empty = tuple(replace(track, masks={}) for track in item.tracks)
    assert fits_of(replace(item, tracks=empty), plan_bundle(item.scene)) == {}


def test_the_f_score_is_the_harmonic_mean_of_precision_and_recall() -> None:
    to_mesh, to_scan = np.array([0.0, 0.0, 0.0, 0.03]), np.array([0.0, 0.03])
    assert f_score(to_mesh, to_scan, 0.01) == pytest.approx(2 * 0.75 * 0.5 / 1.25)
    assert f_score(np.array([0.5]), np.array([0.5]), 0.01) == 0.0
