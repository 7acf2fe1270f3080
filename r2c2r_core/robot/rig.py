"""A bundle's scene with a floating gripper: commands, state and contacts."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.arrays import Matrix3, Points, Vector3
from r2c2r_core.geometry.boxes import box_corners
from r2c2r_core.geometry.transforms import Rigid3, rotation_about, rotation_about_z

GRIPPER = Path(__file__).with_name("gripper.xml")
STROKE_M = 0.08
TIP_M = 0.010  # from the tool's origin to the fingers' tips
HALF_PAD_M = 0.009  # half the width of a fingertip
GRIPS_N = (20.0, 40.0)
CONTROL_STEPS = 5  # simulation steps between two commands
PREFIX = "gripper/"
_AXES = ("x", "y", "z", "yaw", "pitch", "roll")


class Pull(NamedTuple):
    """One contact of the gripper, or of a part."""

    body: int  # touched body; 0 is the world
    geom: int  # of the gripper or the part
    force_n: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rig(ABC):
    """The compiled scene, with the model indices of a robot with two fingers."""

    model: Any
    data: Any
    fingers: np.ndarray  # (2,) addresses in qpos
    width: int  # the fingers' actuator
    tool: int  # the site between the pads
    own: frozenset[int]  # the robot's geoms
    pads: frozenset[int]

    @abstractmethod
    def put(self, pose: Rigid3, width_m: float) -> None:
        """Set the tool's pose at rest, before the simulation starts."""

    @abstractmethod
    def command(self, pose: Rigid3, width_m: float) -> None:
        """Drive the tool to a pose with bounded forces, and the fingers to a width."""

    @property
    @abstractmethod
    def base_force_n(self) -> float:
        """Magnitude of the force on the tool, in N."""

    @property
    def world_from_tool(self) -> Rigid3:
        """Pose of the tool, between the pads."""
        return Rigid3(self.data.site_xmat[self.tool].reshape(3, 3).copy(), self.data.site_xpos[self.tool].copy())

    @property
    def width_m(self) -> float:
        """Width between the pads."""
        return float(self.data.qpos[self.fingers].sum())

    def world_from_body(self, body: int) -> Rigid3:
        """Pose of a body."""
        return Rigid3(self.data.xmat[body].reshape(3, 3).copy(), self.data.xpos[body].copy())

    def grip_with(self, force_n: float) -> None:
        """Set the maximum force of each pad."""
        self.model.actuator_forcerange[self.width] = (-force_n, force_n)

    def step(self) -> None:
        """Advance the simulation by one command."""
        import mujoco

        mujoco.mj_step(self.model, self.data, CONTROL_STEPS)

    @property
    def step_s(self) -> float:
        """Duration of one command in seconds."""
        return float(self.model.opt.timestep) * CONTROL_STEPS

    def pulls(self) -> Iterator[Pull]:
        """Current contacts of the robot."""
        return self.contacts_of(self.own)

    def contacts_of(self, own: frozenset[int]) -> Iterator[Pull]:
        """Current contacts of some geoms with all others."""
        import mujoco

        force = np.zeros(6)
        pairs: list[tuple[int, int]] = self.data.contact.geom[: self.data.ncon].tolist()  # quicker to look up than NumPy's
        for number, (a, b) in enumerate(pairs):
            if (a in own) != (b in own):
                mine, other = (a, b) if a in own else (b, a)
                mujoco.mj_contactForce(self.model, self.data, number, force)
                yield Pull(int(self.model.geom_bodyid[other]), mine, math.sqrt(force[:3].dot(force[:3])))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gripper(Rig):
    """A floating gripper whose base has six degrees of freedom."""

    axes: np.ndarray  # (6,) addresses in qpos of x, y, z, yaw, pitch, roll
    drives: np.ndarray  # (6,) their actuators

    @property
    def base_force_n(self) -> float:
        """Magnitude of the base's actuator force, in N."""
        return float(np.linalg.norm(self.data.actuator_force[self.drives[:3]]))

    def put(self, pose: Rigid3, width_m: float) -> None:
        """Set the gripper's pose at rest."""
        self.data.qpos[self.axes] = axes_of(pose, self.data.qpos[self.axes[3]])
        self.data.qpos[self.fingers] = width_m / 2
        self.command(pose, width_m)

    def command(self, pose: Rigid3, width_m: float) -> None:
        """Drive the base to a pose, and the fingers to a width."""
        self.data.ctrl[self.drives] = axes_of(pose, self.data.qpos[self.axes[3]])
        self.data.ctrl[self.width] = width_m


def gripper_in(scene: Path, change: Callable[[Any], None] | None = None) -> Gripper:
    """The gripper in a scene.xml, parked at the origin; `change` edits the scene's MjSpec before.

    Raises ValueError where scene.xml is invalid.
    """
    import mujoco

    model = compiled_with(scene, mujoco.MjSpec.from_file(str(GRIPPER)), change)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Gripper(
        axes=np.array([model.joint(PREFIX + name).qposadr[0] for name in _AXES]),
        drives=np.array([model.actuator(PREFIX + name).id for name in _AXES]),
        **hand_of(model, data, f"{PREFIX}base"),
    )


def compiled_with(scene: Path, robot: Any, change: Callable[[Any], None] | None = None) -> Any:
    """The model of a scene.xml with a robot's MjSpec in it; its names are prefixed.

    The pads' friction needs elliptic cones: with pyramids a held bar creeps out (MuJoCo, "Solver parameters: impratio").
    """
    import mujoco

    spec = mujoco.MjSpec.from_file(str(scene))
    if change is not None:
        change(spec)
    spec.attach(robot, frame=spec.worldbody.add_frame(), prefix=PREFIX)
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    return spec.compile()


def hand_of(model: Any, data: Any, base: str) -> dict[str, Any]:
    """Fields common to all rigs: model, data, fingers, tool and geoms; `base` is the robot's first body."""
    root = model.body(base).id
    own = [g for g in range(model.ngeom) if model.body_rootid[model.geom_bodyid[g]] == root]
    return {
        "model": model,
        "data": data,
        "fingers": np.array([model.joint(PREFIX + name).qposadr[0] for name in ("left", "right")]),
        "width": int(model.actuator(f"{PREFIX}width").id),
        "tool": int(model.site(f"{PREFIX}tool").id),
        "own": frozenset(own),
        "pads": frozenset(g for g in own if model.geom(g).name.endswith("_pad")),
    }


def find_contacts(model: Any, data: Any) -> None:
    """Update poses and contacts from qpos, without dynamics."""
    import mujoco

    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)


def corners_of(model: Any, data: Any, geom: int) -> Points:
    """Corners (8, 3) of a geom's bounding box, in the world."""
    local = model.geom_aabb[geom][:3] + box_corners(2 * model.geom_aabb[geom][3:])
    return np.asarray(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])


def axes_of(pose: Rigid3, near_yaw: float = 0.0) -> np.ndarray:
    """x, y, z, yaw, pitch, roll of a pose: R = Rz(yaw) Ry(pitch) Rx(roll), the yaw on the turn nearest to `near_yaw`."""
    r = pose.rotation
    pitch = np.arcsin(np.clip(-r[2, 0], -1.0, 1.0))
    if np.hypot(r[0, 0], r[1, 0]) < 1e-6:  # gimbal lock: pointing straight up or down, yaw and roll coincide
        yaw, roll = near_yaw, _roll_left(r, near_yaw, float(pitch))
    else:
        yaw, roll = np.arctan2(r[1, 0], r[0, 0]), np.arctan2(r[2, 1], r[2, 2])
    yaw += 2 * np.pi * np.round((near_yaw - yaw) / (2 * np.pi))
    return np.array([*pose.translation, yaw, pitch, roll])


def pose_of(axes: np.ndarray) -> Rigid3:
    """Pose from the six axis positions."""
    yaw, pitch, roll = axes[3:]
    return Rigid3(_turned(yaw, pitch) @ rotation_about(np.eye(3)[0], roll), np.array(axes[:3], dtype=np.float64))


def tool_rotation(approach: Vector3, stroke: Vector3) -> Matrix3:
    """The tool's axes in the world: x along the approach, y along the stroke."""
    x = approach / np.linalg.norm(approach)
    y = stroke - (stroke @ x) * x
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def _turned(yaw: float, pitch: float) -> Matrix3:
    return rotation_about_z(yaw) @ rotation_about(np.eye(3)[1], pitch)


def _roll_left(rotation: Matrix3, yaw: float, pitch: float) -> float:
    rest = _turned(yaw, pitch).T @ rotation
    return float(np.arctan2(rest[2, 1], rest[1, 1]))
