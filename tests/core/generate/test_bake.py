from dataclasses import replace

import cv2
import numpy as np
import pytest

from r2c2r_core.generate.bake import bake
from r2c2r_core.generate.charts import planar_atlas, unwrapped_atlas
from r2c2r_core.generate.completion import cut_open
from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.unseen import beside_handle
from r2c2r_core.generate.variation import draw_variation
from r2c2r_core.geometry.camera import Intrinsics
from r2c2r_core.geometry.masks import pack_mask, unpack_mask
from r2c2r_core.geometry.raster import render_textured
from r2c2r_core.geometry.transforms import Rigid3
from tests.core.generate.scenes import appliance_scene, best_thing, box, box_shape
from tests.core.motions import motion

FACING = Rigid3(np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), np.array([0.0, -2.0, 0.0]))  # looks along +Y from 2 m
RIGHT = 1  # chart of the faces that look along +X
CAMERA = Intrinsics(fx=800.0, fy=800.0, cx=200.0, cy=200.0, width=400, height=400)


def pictured(scene, make, cut):
    evidence = gather_evidence(*scene, 10)
    shape = make(evidence, draw_variation(evidence, np.random.default_rng(0)))
    atlas = cut(shape.vertices_local, shape.faces)
    posed = shape.vertices_world, shape.faces, shape.world_from_local
    return shape, atlas, bake(atlas, *posed, evidence.pool, shape.front_y_m, shape.handle)


def seen_from(shape, atlas, picture, world_from_camera):
    """The textured mesh in its local frame."""
    vertices = shape.vertices_local[atlas.source]
    return render_textured(vertices, atlas.faces, atlas.uv, picture.texture, CAMERA, world_from_camera.inverse)


def test_a_mark_on_a_door_is_textured_at_its_position(front_scene):
    """The red square spans x 0.08..0.18, z -0.20..-0.10 of the front frame; found to 4 mm (a texel and a photo pixel)."""
    shape, atlas, picture = pictured(front_scene, box_shape, lambda v, f: planar_atlas(v, f, 768, 0.0012))
    image, depth = seen_from(shape, atlas, picture, FACING)
    red = (image[..., 0] > 120) & (image[..., 1] < 90) & (depth > 0)
    rows, columns = np.nonzero(red)
    metres = 2.0 / 800.0
    assert (columns.min() - 200) * metres == pytest.approx(0.08, abs=0.004)
    assert (columns.max() + 1 - 200) * metres == pytest.approx(0.18, abs=0.004)
    assert (200 - rows.min()) * metres == pytest.approx(-0.10, abs=0.004)
    assert (200 - rows.max() - 1) * metres == pytest.approx(-0.20, abs=0.004)


def test_door_and_unseen_sides_have_the_colour_of_the_door(front_scene):
    shape, atlas, picture = pictured(front_scene, box_shape, lambda v, f: planar_atlas(v, f, 768, 0.0012))
    image, _ = seen_from(shape, atlas, picture, FACING)
    assert image[250, 150] == pytest.approx([210, 190, 150], abs=6)
    sideways = Rigid3(np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]), np.array([2.2, 0.3, 0.0]))  # looks along -X
    side, depth = seen_from(shape, atlas, picture, sideways)
    assert (np.abs(side[depth > 0].astype(int) - [210, 190, 150]).max(axis=1) < 10).mean() > 0.97


def test_the_part_of_a_handle_that_the_model_lacks_is_not_painted_on_the_front(front_scene):
    """The modelled bar ends 14 mm before the photographed one."""
    capture, track = front_scene
    short = replace(track.front.handle, right_m=0.066)
    scene = capture, replace(track, front=replace(track.front, handle=short))
    shape, atlas, picture = pictured(scene, box_shape, lambda v, f: planar_atlas(v, f, 768, 0.0012))
    image, _ = seen_from(shape, atlas, picture, FACING)
    metres = 2.0 / 800.0
    rows, columns = (slice(200 - round(0.213 / metres), 200 - round(0.202 / metres)), slice(200 + 28, 200 + 31))
    assert image[rows, columns].mean(axis=(0, 1)) == pytest.approx([210, 190, 150], abs=12)


def test_no_strip_is_left_between_an_erased_handle_and_a_near_edge(front_scene):
    _, track = front_scene
    shape, atlas, _ = pictured(front_scene, box_shape, lambda v, f: planar_atlas(v, f, 768, 0.0012))
    near_edge = replace(track.front.handle, left_m=-0.22, right_m=-0.2, bottom_m=-0.1, top_m=0.1)  # 3 cm from the edge
    erased = atlas.points[beside_handle(atlas, shape.front_y_m, near_edge)]
    assert erased[:, 0].min() == pytest.approx(-0.25, abs=0.004)  # and the chart's padding
    assert erased[:, 0].max() == pytest.approx(-0.18, abs=0.002)
    assert (erased[:, 2].min(), erased[:, 2].max()) == (pytest.approx(-0.12, abs=0.002), pytest.approx(0.12, abs=0.002))


def test_an_unseen_side_of_the_handle_has_the_handle_colour(front_scene):
    """From above, the bar has its own colour although only its front was well observed."""
    shape, atlas, picture = pictured(front_scene, box_shape, lambda v, f: planar_atlas(v, f, 768, 0.0012))
    above = Rigid3(np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]]), np.array([0.0, 0.0, 2.0]))  # looks along -Z
    image, _ = seen_from(shape, atlas, picture, above)
    bar = image[200 + round(0.032 * 800 / 1.785), 200]
    assert bar.max() < 110


def test_an_observed_dark_body_keeps_its_own_colour(appliance_scene):
    shape, atlas, picture = pictured(appliance_scene, box_shape, lambda v, f: planar_atlas(v, f, 768, 0.0012))
    image, depth = seen_from(shape, atlas, picture, FACING)
    body = image[(depth > 1.97) & (depth < 2.07)]
    assert np.median(body, axis=0) == pytest.approx([70, 72, 75], abs=6)
    assert 0.2 < picture.seen_fraction < 1.0


def test_the_front_of_a_neighbour_does_not_colour_the_side_that_it_covers() -> None:
    """Its mask is some pixels too wide, and the neighbour's front nearer than depth can tell from the side behind it."""
    capture, seen = appliance_scene(0, box((0.232, 0.08, 0.9), (0.6, 0.34, 1.04), (200, 30, 30), 0))
    wider = {k: pack_mask(cv2.dilate(unpack_mask(m).astype(np.uint8), np.ones((15, 15))) > 0) for k, m in seen.masks.items()}
    _, atlas, picture = pictured((capture, replace(seen, masks=wider)), box_shape, lambda v, f: planar_atlas(v, f, 768, 0.0012))
    red, green, _ = picture.texture.reshape(-1, 3)[atlas.texel[atlas.chart == RIGHT]].astype(int).T
    assert (red > green + 30).mean() < 0.002


def test_the_parts_of_a_chair_keep_their_colours(chair_scene):
    shape, atlas, picture = pictured(chair_scene, best_thing, lambda v, f: unwrapped_atlas(v, f, 512))
    image, depth = seen_from(shape, atlas, picture, FACING)
    back, seat_edge = image[200 - round(0.3 * 800 / 2.2), 200], image[200 + 1, 200]
    assert depth[200 + 1, 200] > 0
    assert back.argmax() == 2  # the back is blue, the seat red
    assert seat_edge.argmax() == 0


def test_frames_with_an_open_front_are_not_used_for_texture(front_scene):
    """Even where the front is open by too little to show in depth."""
    capture, track = front_scene
    opened = motion(dict.fromkeys(sorted(track.masks)[::2], 0.02))
    pool = gather_evidence(capture, replace(track, motions=(opened,)), 20).pool
    assert {view.frame_index for view in gather_evidence(capture, track, 20).pool} & set(opened.states)
    assert not {view.frame_index for view in pool} & set(opened.states)


def test_photos_are_normalised_to_the_common_exposure(front_scene):
    capture, track = front_scene
    plain = {view.frame_index: view.rgb for view in gather_evidence(capture, track, 4).pool}
    darker = replace(capture, frames=tuple(replace(f, gain=(0.5, 0.6, 0.7)) for f in capture.frames))
    for view in gather_evidence(darker, track, 4).pool:
        expected = plain[view.frame_index] * np.array((0.5, 0.6, 0.7))
        filmed = plain[view.frame_index].max(axis=-1) < 200  # towards white the gain is reduced
        assert np.abs(view.rgb - expected)[filmed].max() <= 0.51


@pytest.mark.parametrize(("name", "make", "most"), [("front", box_shape, 1536), ("bottle", best_thing, 1024)])
def test_texture_resolution_follows_photo_resolution_up_to_a_limit(name, make, most, request):
    evidence = gather_evidence(*request.getfixturevalue(f"{name}_scene"), 6)
    shape = make(evidence, draw_variation(evidence, np.random.default_rng(0)))

    def texels(times: int) -> int:
        """Number of texels for photos `times` as large."""
        views = [replace(v, rgb_camera=replace(v.rgb_camera, fx=times * v.rgb_camera.fx)) for v in evidence.pool]
        return len(cut_open(shape, views).points)

    assert texels(6) > 1.5 * texels(1)
    assert texels(60) < 3 * most**2  # bounded by memory, whatever the photos' size
