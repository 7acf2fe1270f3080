"""A hand-made cabinet, configurable for tests: a front of 18 mm in a frame of boards, hinged or sliding."""

import math
from dataclasses import dataclass
from pathlib import Path

from r2c2r_core.robot.motion import Travel, travel_of
from r2c2r_core.robot.rig import Rig, gripper_in


@dataclass(frozen=True, kw_only=True)
class Bar:
    """A handle on two posts, or a plate: width, height and protrusion."""

    wide: float = 0.012
    high: float = 0.16
    stands_out: float = 0.03


def scene(
    folder: Path,
    *,
    kind: str = "hinge",
    bar: Bar | None = None,
    frictionloss: float = 0.15,
    beside: str = "",
    turned: float = 0.0,
) -> Path:
    """scene.xml of a front 0.4 m wide and 0.5 m high, its outer face at y = -0.3 before it is rotated about z."""
    joint = {
        "hinge": f'type="hinge" axis="0 0 1" pos="0.2 -0.282 0" range="0 1.92" damping="0.3" frictionloss="{frictionloss}"',
        "drawer": f'type="slide" axis="0 -1 0" range="0 0.4" damping="8" frictionloss="{frictionloss}"',
        "sliding": f'type="slide" axis="1 0 0" range="0 0.35" damping="8" frictionloss="{frictionloss}"',
    }[kind]
    x = 0.0 if kind == "drawer" else -0.16
    (folder / "scene.xml").write_text(f"""
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <default><geom type="box" friction="0.5 0.01 0.001"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 0.05"/>
    <body name="frame" pos="0 0 0.8" quat="{_quat(turned)}">
      <geom name="back" size="0.2 0.01 0.25" pos="0 0.25 0"/>
      <body name="front">
        <inertial pos="0 -0.29 0" mass="4" diaginertia="0.1 0.05 0.1"/>
        <joint name="front_joint" {joint}/>
        <geom name="board" size="0.2 0.009 0.25" pos="0 -0.291 0"/>
        {_handle(bar, x)}
      </body>
      {beside}
    </body>
  </worldbody>
</mujoco>""")
    return folder / "scene.xml"


def rig_and_travel(path: Path) -> tuple[Rig, Travel]:
    rig = gripper_in(path)
    travel = travel_of(rig, "front_joint")
    assert travel is not None
    return rig, travel


def _handle(bar: Bar | None, x: float) -> str:
    if bar is None:
        return ""
    thick = 0.01
    y = -0.3 - bar.stands_out + thick / 2
    post = (bar.stands_out - thick) / 2
    half = min(bar.wide, bar.high) / 2
    away = max(bar.wide, bar.high) / 2 - 0.006
    posts = [(x, sign * away) if bar.high > bar.wide else (x + sign * away, 0.0) for sign in (-1, 1)]
    pieces = [f'<geom size="{half} {post} {half}" pos="{px} {-0.3 - post} {pz}"/>' for px, pz in posts]
    grip = f'size="{bar.wide / 2} {thick / 2} {bar.high / 2}" pos="{x} {y} 0"'
    return f'<geom name="bar" {grip}/><site name="handle" type="box" {grip}/>' + "".join(pieces)


def _quat(turned: float) -> str:
    return f"{math.cos(turned / 2)} 0 0 {math.sin(turned / 2)}"
