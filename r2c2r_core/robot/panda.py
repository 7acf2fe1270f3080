"""A Franka Panda with its hand, as a MjSpec, from the description in pybullet's wheel (Apache-2.0, after franka_ros).

Masses and inertias are that file's (0.1 kg m2 per link, more than the real ones). The arm stands on a lifting column, is
gravity-compensated, and is driven through springs like libfranka's example `joint_impedance_control`.
"""

import importlib.util
from pathlib import Path
from typing import Any

from r2c2r_core.errors import BackendUnavailable

NAME = "Franka Panda"
SOURCE = "pybullet_data/franka_panda of pybullet, Apache-2.0"
JOINTS = tuple(f"panda_joint{number}" for number in range(1, 8))
ROOT = "panda_link0"
LIFTS_M = (0.1, 0.4, 0.7, 1.0, 1.3)  # own choice: heights of its root above the floor, on a lifting column
SHOULDER_M = 0.333  # above its root
REACH_M = 0.855 + 0.107 + 0.102  # from the shoulder: Franka's data sheet to the wrist, the flange, the hand
PEDESTAL_RADIUS_M = 0.2
CLEAR_M = 0.015  # own choice: clearance between its links and all else when base positions are searched
RESTS = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)  # Franka's "ready" pose, rad

_SPRINGS = (600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0)  # N m/rad, of libfranka's example
_DAMPERS = (50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0)
_EFFORTS = (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)  # N m, of the description
_PAD_Z_M = 0.0439  # in a finger: its tip lies at 0.0539
_HAND_FROM_FINGER_Z_M = 0.0584
_LINKS = ("panda_link0", "panda_link1", "panda_link2", "panda_link3", "panda_link4", "panda_link5", "panda_link6")
_HAND = ("panda_hand", "panda_leftfinger", "panda_rightfinger")
_WRIST = ("panda_link7", "panda_link8", *_HAND)
_BESIDE = 3  # maximum distance in the chain of links whose hulls may overlap at rest


def panda_spec() -> Any:
    """The arm on its pedestal, a tool frame between its pads (x forwards, y along the stroke), and its actuators.

    Raises BackendUnavailable where the extra is not installed.
    """
    import mujoco

    spec = mujoco.MjSpec.from_string(_described(_folder()))
    spec.delete(spec.body("panda_grasptarget"))
    for body in spec.bodies[1:]:
        body.gravcomp = 1.0
        for geom in body.geoms:
            geom.friction, geom.rgba = [0.4, 0.01, 0.001], [0.9, 0.91, 0.92, 1.0]
            geom.gap = 0.0 if body.name in _HAND else CLEAR_M
    root = spec.body(ROOT)
    root.mocap = True
    root.add_geom(
        name="pedestal",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[PEDESTAL_RADIUS_M / 2**0.5] * 2 + [LIFTS_M[-1] / 2],  # the part below the floor collides with nothing
        pos=[0.0, 0.0, -LIFTS_M[-1] / 2 - 0.005],
        rgba=[0.35, 0.37, 0.4, 1.0],
        gap=CLEAR_M,
    )
    spec.body("panda_hand").add_site(
        name="tool", pos=[0.0, 0.0, _HAND_FROM_FINGER_Z_M + _PAD_Z_M], quat=[0.0, 0.70710678, 0.0, 0.70710678], rgba=[0.0] * 4
    )
    _with_pads(spec)
    _with_actuators(spec)
    _without_own_contacts(spec)
    return spec


def _folder() -> Path:
    found = importlib.util.find_spec("pybullet_data")
    if found is None or found.origin is None:
        raise BackendUnavailable("the arm: its description is not installed", hint="pip install 'r2c2r[arm]'")
    return Path(found.origin).parent / "franka_panda"


def _described(folder: Path) -> str:
    """The URDF with resolved mesh paths and colliders only, which also serve as visuals: 300 triangles per link."""
    text = (folder / "panda.urdf").read_text(encoding="utf-8").replace("package://meshes/", "")
    head, _, rest = text.partition("<robot")
    _, _, rest = rest.partition(">")
    block = (
        f'<mujoco><compiler meshdir="{folder / "meshes"}" strippath="false" fusestatic="false" discardvisual="true"/></mujoco>'
    )
    return f'{head}<robot name="panda">{block}{rest}'


def _with_pads(spec: Any) -> None:
    import mujoco

    for side, inwards in (("left", 1.0), ("right", -1.0)):
        finger = spec.body(f"panda_{side}finger")
        finger.add_geom(
            name=f"{side}_pad",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[0.009, 0.004, 0.010],
            pos=[0.0, inwards * 0.0035, _PAD_Z_M],
            condim=4,
            friction=[1.0, 0.02, 0.001],
            priority=1,
            solref=[0.006, 1.0],
            rgba=[0.95, 0.5, 0.15, 1.0],
        )


def _with_actuators(spec: Any) -> None:
    import mujoco

    for name, spring, damper, effort in zip(JOINTS, _SPRINGS, _DAMPERS, _EFFORTS, strict=True):
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_position(kp=spring, kv=damper)
        motor.forcelimited, motor.forcerange = 1, [-effort, effort]
    for name, side in (("panda_finger_joint1", "left"), ("panda_finger_joint2", "right")):
        finger = spec.joint(name)
        finger.name, finger.damping = side, [4.0, 0.0, 0.0]
        finger.actfrclimited = 0
    for equality in list(spec.equalities):  # from the description's mimic joint
        spec.delete(equality)
    linkage = spec.add_equality(name="linkage", type=mujoco.mjtEq.mjEQ_JOINT, name1="left", name2="right")
    linkage.data[:2], linkage.solref = [0.0, 1.0], [0.005, 1.0]
    tendon = spec.add_tendon(name="width")
    tendon.wrap_joint("left", 1.0)
    tendon.wrap_joint("right", 1.0)
    width = spec.add_actuator(name="width", target="width", trntype=mujoco.mjtTrn.mjTRN_TENDON)
    width.set_to_position(kp=4000.0, kv=40.0)
    width.forcelimited, width.forcerange = 1, [-40.0, 40.0]


def _without_own_contacts(spec: Any) -> None:
    """Exclude contacts of nearby links, whose hulls overlap though the links do not."""
    chain = [*_LINKS, *_WRIST]
    for number, first in enumerate(chain):
        for second in chain[number + 1 :]:
            both_wrist = first in _WRIST and second in _WRIST
            if both_wrist or chain.index(second) - number <= _BESIDE:
                spec.add_exclude(bodyname1=first, bodyname2=second)
