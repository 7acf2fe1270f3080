from pathlib import Path

import numpy as np
import pytest
import trimesh

from r2c2r_core.export.plan import collider_corners_world, plan_bundle
from r2c2r_core.export.writers.glb import Y_UP_FROM_WORLD, write_glb
from tests.core.export.kitchen import kitchen


def test_the_glb_is_y_up_and_holds_every_link_where_it_stands(tmp_path: Path) -> None:
    plan = plan_bundle(kitchen())
    write_glb(plan, tmp_path / "scene.glb")
    scene = trimesh.load(tmp_path / "scene.glb")
    assert {f"{body.name}_vis" for body in plan.bodies} == set(scene.geometry)
    corners = np.concatenate([c for body in plan.bodies if body.link.visual is None for c in collider_corners_world(body)])
    turned = corners @ Y_UP_FROM_WORLD[:3, :3].T
    assert scene.bounds[0][1] == pytest.approx(turned[:, 1].min(), abs=2e-3)  # metres; the bottle's mesh is its own
    for body in plan.bodies:
        pose, _ = scene.graph.get(body.name)
        np.testing.assert_allclose(pose, Y_UP_FROM_WORLD @ body.world_from_body.matrix, atol=1e-6)


def test_the_glb_carries_its_textures_and_is_the_same_twice(tmp_path: Path) -> None:
    plan = plan_bundle(kitchen())
    write_glb(plan, tmp_path / "a.glb")
    write_glb(plan, tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    scene = trimesh.load(tmp_path / "a.glb")
    texture = np.asarray(scene.geometry["cabinet_1_door_vis"].visual.material.baseColorTexture.convert("RGB"))
    np.testing.assert_array_equal(texture, next(b for b in plan.bodies if b.name == "cabinet_1_door").link.visual.texture)
