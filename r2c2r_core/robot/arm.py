"""A bundle's scene with an arm at a given base pose."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.robot import panda
from r2c2r_core.robot.kinematics import Chain, chain_of, solve
from r2c2r_core.robot.rig import PREFIX, Rig, compiled_with, hand_of

_FOLLOWED = 2  # IK iterations from one command to the next
_FOUND = 60  # IK iterations from an arbitrary start


class Stand(NamedTuple):
    """Base pose of the arm: position and yaw on the floor, and lift of its root."""

    x_m: float
    y_m: float
    yaw_rad: float
    lift_m: float

    @property
    def world_from_base(self) -> Rigid3:
        """Pose of the arm's root."""
        return Rigid3(rotation_about_z(self.yaw_rad), np.array([self.x_m, self.y_m, self.lift_m]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arm(Rig):
    """The arm, with joints driven through springs to the IK solution of a tool pose."""

    chain: Chain
    angles: np.ndarray  # (7,) addresses in qpos
    drives: np.ndarray  # (7,) actuators
    mocap: int  # of its root
    start: np.ndarray  # (7,) start angles of the IK in `put`; mutable

    def stand(self, stand: Stand, start: np.ndarray) -> None:
        """Set the base pose and the start angles."""
        base = stand.world_from_base
        self.data.mocap_pos[self.mocap] = base.translation
        self.data.mocap_quat[self.mocap] = (np.cos(stand.yaw_rad / 2), 0.0, 0.0, np.sin(stand.yaw_rad / 2))
        self.start[:] = start

    @property
    def world_from_base(self) -> Rigid3:
        """Current pose of the root."""
        w, _, _, z = self.data.mocap_quat[self.mocap]
        return Rigid3(rotation_about_z(2 * float(np.arctan2(z, w))), self.data.mocap_pos[self.mocap].copy())

    @property
    def base_force_n(self) -> float:
        """Magnitude of the net contact force on the environment, in N."""
        import mujoco

        net, force, contacts = np.zeros(3), np.zeros(6), self.data.contact
        for number, (a, b) in enumerate(contacts.geom[: self.data.ncon]):
            if (a in self.own) != (b in self.own):
                mujoco.mj_contactForce(self.model, self.data, number, force)
                net += (1.0 if a in self.own else -1.0) * force[:3] @ contacts.frame[number].reshape(3, 3)
        return float(np.linalg.norm(net))

    def meets_itself(self) -> bool:
        """Whether links overlap each other now."""
        contacts = self.data.contact
        return any(
            a in self.own and b in self.own and contacts.dist[number] < 0
            for number, (a, b) in enumerate(contacts.geom[: self.data.ncon])
        )

    def put(self, pose: Rigid3, width_m: float) -> None:
        """Set the tool pose at once, by IK from the start angles."""
        self.bend(self._angles(pose, self.start, _FOUND), width_m)
        self.data.ctrl[self.drives] = self.data.qpos[self.angles]
        self.data.ctrl[self.width] = width_m

    def bend(self, angles: np.ndarray, width_m: float) -> None:
        """Set the joint angles and the finger width."""
        self.data.qpos[self.angles] = angles
        self.data.qpos[self.fingers] = width_m / 2

    def command(self, pose: Rigid3, width_m: float) -> None:
        """Drive the tool to a pose, by IK from the last commanded angles."""
        self.data.ctrl[self.drives] = self._angles(pose, self.data.ctrl[self.drives], _FOLLOWED)
        self.data.ctrl[self.width] = width_m

    def _angles(self, pose: Rigid3, start: np.ndarray, iterations: int) -> np.ndarray:
        return solve(self.chain, (self.world_from_base.inverse @ pose).matrix[None], start[None], iterations).angles[0]


def arm_in(scene: Path, change: Callable[[Any], None] | None = None) -> Arm:
    """The arm in a scene.xml, at the origin.

    Raises ValueError where scene.xml is invalid, BackendUnavailable without the extra.
    """
    import mujoco

    model = compiled_with(scene, panda.panda_spec(), change)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    names = tuple(PREFIX + name for name in panda.JOINTS)
    return Arm(
        chain=chain_of(model, names, f"{PREFIX}tool", panda.RESTS),
        angles=np.array([model.joint(name).qposadr[0] for name in names]),
        drives=np.array([model.actuator(name).id for name in names]),
        mocap=int(model.body(PREFIX + panda.ROOT).mocapid[0]),
        start=np.array(panda.RESTS),
        **hand_of(model, data, PREFIX + panda.ROOT),
    )
