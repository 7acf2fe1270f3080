import json
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.robot.certificate import certify_with_gripper, gripper_to_json
from r2c2r_core.robot.film import film_of
from r2c2r_core.robot.picking import Pick, plan_pick, things_of
from r2c2r_core.robot.rig import gripper_in
from r2c2r_core.robot.view import aimed, look, surfaces_of

TABLE = '<body name="table"><geom class="hard" type="box" size="0.4 0.4 0.02" pos="0 0 0.48"/></body>'


def scene(folder: Path, *, radius: float = 0.03, half: float = 0.1, table: str = TABLE) -> Path:
    (folder / "scene.xml").write_text(f"""
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <default><default class="hard"><geom group="3" friction="0.5 0.01 0.001"/></default></default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 0.05" group="1"/>
    {table}
    <body name="block" pos="0 0 {0.5 + half}">
      <freejoint/>
      <inertial pos="0 0 0" mass="0.8" diaginertia="0.003 0.003 0.001"/>
      <geom class="hard" type="box" size="{radius} {radius} {half}"/>
    </body>
  </worldbody>
</mujoco>""")
    return folder / "scene.xml"


@pytest.mark.parametrize("half", [0.03, 0.1])
def test_an_object_is_moved_by_ten_centimetres(tmp_path: Path, half: float) -> None:
    certificate = certify_with_gripper(scene(tmp_path, half=half))
    (grip,) = certificate.grips
    assert grip.passed, grip
    assert grip.off_m < 0.01
    assert json.loads(json.dumps(gripper_to_json(certificate)))["things_moved"] == 1


def test_an_object_wider_than_the_stroke_is_not_picked(tmp_path: Path) -> None:
    (grip,) = certify_with_gripper(scene(tmp_path, radius=0.05)).grips
    assert (grip.passed, grip.why) == (False, "wider than 76 mm all round")


def test_a_bottle_wider_than_the_stroke_is_held_by_its_neck(tmp_path: Path) -> None:
    path = scene(tmp_path, radius=0.045)
    neck = '<geom class="hard" type="box" size="0.015 0.015 0.04" pos="0 0 0.14"/>'
    shelf = '<body name="shelf"><geom class="hard" type="box" size="0.4 0.4 0.02" pos="0 0 0.88"/></body>'  # no room from above
    path.write_text(path.read_text().replace("</body>\n  </worldbody>", f"{neck}</body>{shelf}</worldbody>"))
    (grip,) = certify_with_gripper(path).grips
    assert grip.passed, grip
    rig = gripper_in(path)
    pick = plan_pick(rig, things_of(rig.model)[0])
    assert isinstance(pick, Pick)
    assert pick.held_m == pytest.approx(0.03, abs=1e-3)


def test_an_object_that_stands_on_the_floor_is_moved_unless_it_is_too_heavy(tmp_path: Path) -> None:
    path = scene(tmp_path, table="")
    standing = path.read_text().replace('pos="0 0 0.6"', 'pos="0 0 0.1"')
    path.write_text(standing)
    (grip,) = certify_with_gripper(path).grips
    assert grip.passed, grip
    path.write_text(standing.replace('mass="0.8"', 'mass="30"'))
    (grip,) = certify_with_gripper(path).grips
    assert (grip.passed, grip.why, grip.blame) == (False, "not lifted: its 30.0 kg slipped from the pads", "gripper")


def test_an_object_without_free_support_nearby_is_not_moved(tmp_path: Path) -> None:
    small = '<body name="table"><geom class="hard" type="box" size="0.05 0.05 0.02" pos="0 0 0.48"/></body>'
    (grip,) = certify_with_gripper(scene(tmp_path, table=small)).grips
    assert (grip.passed, grip.why) == (False, "no free place 10 cm further on its support")


def test_a_gif_and_a_contact_sheet_are_written(tmp_path: Path) -> None:
    from PIL import Image

    (grip,) = certify_with_gripper(scene(tmp_path), tmp_path / "films").grips
    assert grip.film == "block"
    with Image.open(tmp_path / "films" / "block.gif") as film:
        assert film.n_frames > 10  # type: ignore[attr-defined]
    with Image.open(tmp_path / "films" / "block.jpg") as sheet:
        assert sheet.size == (4 * 208, 2 * 156)


def test_a_rendered_picture_shows_each_body_at_its_pose(tmp_path: Path) -> None:
    rig = gripper_in(scene(tmp_path).with_name("scene.xml"), lambda spec: [setattr(g, "group", 2) for g in spec.geoms])
    camera, camera_from_world = aimed(np.array([0.0, -1.5, 0.6]), np.array([0.0, 0.0, 0.6]), (160, 120), 0.8)
    rig.data.qpos[rig.axes[2]] = 3.0  # the gripper out of view
    import mujoco

    mujoco.mj_forward(rig.model, rig.data)
    seen = look(surfaces_of(rig.model), rig.model, rig.data, camera, camera_from_world)
    assert seen.body[60, 80] == rig.model.body("block").id
    assert seen.depth_m[60, 80] == pytest.approx(1.47, abs=2e-3)  # the rasteriser's depth at this distance
    assert seen.body[2, 2] == -1


@pytest.mark.parametrize("walls", [0, 1])
def test_a_film_is_seen_from_where_nothing_hides_its_object(tmp_path: Path, walls: int) -> None:
    """A wall on the left in front of the object."""
    wall = '<body name="wall"><geom class="hard" type="box" size="0.2 0.01 1" pos="0.35 -0.3 1"/></body>' * walls
    path = scene(tmp_path, table=TABLE + wall)
    rig = gripper_in(path, lambda spec: [setattr(g, "group", 2) for g in spec.geoms])
    block = rig.model.body("block").id
    film = film_of(surfaces_of(rig.model), rig, rig.data.xpos[block].copy(), np.array([0.0, -1.0, 0.0]), 0.4)
    seen = look(film.surfaces, rig.model, rig.data, film.camera, film.camera_from_world)
    assert (seen.body == block).sum() > 300
    right_of_it = film.camera_from_world.inverse.translation[0] < 0.0
    assert right_of_it == bool(walls)
