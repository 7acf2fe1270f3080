import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from r2c2r_core.export.plan import collider_corners_world, plan_bundle
from r2c2r_core.export.preview import poses_at
from r2c2r_core.export.writers.glb import Y_UP_FROM_WORLD, write_glb
from tests.core.export.conftest import write_meshes
from tests.core.export.kitchen import kitchen


def test_the_glb_is_y_up_with_every_link_at_its_pose(tmp_path: Path) -> None:
    plan = plan_bundle(kitchen())
    write_meshes(plan, tmp_path)
    write_glb(plan, tmp_path / "scene.glb")
    scene = trimesh.load(tmp_path / "scene.glb")
    assert {f"{body.name}_vis" for body in plan.bodies} == set(scene.geometry)
    corners = np.concatenate([c for body in plan.bodies if body.link.visual is None for c in collider_corners_world(body)])
    turned = corners @ Y_UP_FROM_WORLD[:3, :3].T
    assert scene.bounds[0][1] == pytest.approx(turned[:, 1].min(), abs=2e-3)  # metres; the bottle has its own mesh
    for body in plan.bodies:
        pose, _ = scene.graph.get(body.name)
        np.testing.assert_allclose(pose, Y_UP_FROM_WORLD @ body.world_from_body.matrix, atol=1e-6)


def test_the_glb_embeds_its_textures_and_is_deterministic(tmp_path: Path) -> None:
    plan = plan_bundle(kitchen())
    write_meshes(plan, tmp_path)
    write_glb(plan, tmp_path / "a.glb")
    write_glb(plan, tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    scene = trimesh.load(tmp_path / "a.glb")
    texture = np.asarray(scene.geometry["cabinet_1_door_vis"].visual.material.baseColorTexture.convert("RGB"))
    np.testing.assert_array_equal(texture, next(b for b in plan.bodies if b.name == "cabinet_1_door").link.visual.texture)


def document_of(path: Path) -> tuple[dict, bytes]:
    raw = path.read_bytes()
    magic, version, length = struct.unpack_from("<III", raw, 0)
    assert (magic, version, length) == (0x46546C67, 2, len(raw))
    size = struct.unpack_from("<I", raw, 12)[0]
    return json.loads(raw[20 : 20 + size]), raw[28 + size :]


def values_of(document: dict, binary: bytes, accessor: int) -> np.ndarray:
    entry = document["accessors"][accessor]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[entry["type"]]
    view = document["bufferViews"][entry["bufferView"]]
    assert view["byteOffset"] % 4 == 0
    return np.frombuffer(binary, "<f4", entry["count"] * width, view["byteOffset"]).reshape(-1, width)


def test_the_glb_has_an_opening_animation_per_joint_and_one_for_those_open_at_once(tmp_path: Path) -> None:
    plan = plan_bundle(kitchen())
    write_meshes(plan, tmp_path)
    write_glb(plan, tmp_path / "scene.glb")
    document, binary = document_of(tmp_path / "scene.glb")
    assert document["buffers"][0]["byteLength"] <= len(binary) < document["buffers"][0]["byteLength"] + 4
    clips = {clip["name"]: clip for clip in document["animations"]}
    moving = {body.joint_name: body for body in plan.bodies if body.joint is not None}
    assert set(clips) == {"open", *moving}
    assert len(clips["open"]["channels"]) == len(moving)
    assert [channel["sampler"] for channel in clips["open"]["channels"]] == list(range(len(moving)))
    opened = poses_at(plan, 1.0)
    for name, body in moving.items():
        sampler, channel = clips[name]["samplers"][0], clips[name]["channels"][0]
        node = document["nodes"][channel["target"]["node"]]
        assert node["name"] == body.name
        assert "matrix" not in node  # glTF 2.0, 3.11: an animated node has no matrix
        times = values_of(document, binary, sampler["input"])[:, 0]
        assert times.tolist() == [0.0, 1.5, 3.0]
        first, middle, last = values_of(document, binary, sampler["output"])
        np.testing.assert_array_equal(first, last)
        np.testing.assert_allclose(first, node[channel["target"]["path"]], atol=1e-6)
        now = Rotation.from_quat(middle if channel["target"]["path"] == "rotation" else node["rotation"]).as_matrix()
        place = middle if channel["target"]["path"] == "translation" else np.array(node["translation"])
        wanted = opened[body.parent].inverse @ opened[body.name]
        np.testing.assert_allclose(now, wanted.rotation, atol=1e-6)
        np.testing.assert_allclose(place, wanted.translation, atol=1e-6)


def test_the_glb_clip_that_opens_joints_together_leaves_those_in_the_way_closed(tmp_path: Path) -> None:
    plan = replace(plan_bundle(kitchen()), conflicts={"open": (("double_1_left_hinge", "drawer_1_slide"),)})
    write_meshes(plan, tmp_path)
    write_glb(plan, tmp_path / "scene.glb")
    clip = next(clip for clip in document_of(tmp_path / "scene.glb")[0]["animations"] if clip["name"] == "open")
    assert len(clip["channels"]) == 3
