"""Batched forward and inverse kinematics of an arm."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3, rotation_of

_DAMPING = 0.02  # of the least squares, m: slows down near singularities
_TURN_M = 0.3  # weight of a radian of rotation error, in m
_MOST_RAD = 0.25  # maximum joint step of one iteration
_HOMING = 0.05  # null-space step towards rest per iteration, as a fraction of the way


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """A serial chain of hinges, each about the z axis of its own frame."""

    parent_from_joint: np.ndarray  # (j, 4, 4) at angle zero
    last_from_tool: np.ndarray  # (4, 4)
    low: np.ndarray  # (j,) rad
    high: np.ndarray
    rest: np.ndarray  # (j,) target of the null-space motion


class Solved(NamedTuple):
    """IK solutions with their residual tool errors."""

    angles: np.ndarray  # (n, j)
    off_m: np.ndarray  # (n,)
    off_rad: np.ndarray  # (n,)


class Placed(NamedTuple):
    """Tool poses and Jacobians at given angles."""

    base_from_tool: np.ndarray  # (n, 4, 4)
    jacobian: np.ndarray  # (n, 6, j) of the tool's position and rotation, in the base's frame


def chain_of(model: Any, joints: tuple[str, ...], tool: str, rest: tuple[float, ...]) -> Chain:
    """The chain of a compiled model, whose hinges turn about z at their bodies' origins."""
    bodies = [int(model.joint(name).bodyid[0]) for name in joints]
    assert all(np.allclose(model.joint(name).axis, (0, 0, 1)) and not model.joint(name).pos.any() for name in joints)
    site = model.site(tool)
    last_from_tool = _matrix(site.pos, site.quat)
    body = int(site.bodyid[0])
    while body != bodies[-1]:
        last_from_tool = _matrix(model.body_pos[body], model.body_quat[body]) @ last_from_tool
        body = int(model.body_parentid[body])
    return Chain(
        parent_from_joint=np.stack([_matrix(model.body_pos[b], model.body_quat[b]) for b in bodies]),
        last_from_tool=last_from_tool,
        low=np.array([model.joint(name).range[0] for name in joints]),
        high=np.array([model.joint(name).range[1] for name in joints]),
        rest=np.array(rest),
    )


def placed(chain: Chain, angles: np.ndarray) -> Placed:
    """Forward kinematics: tool poses and geometric Jacobians."""
    count, joints = angles.shape
    pose = np.broadcast_to(np.eye(4), (count, 4, 4))
    axes, anchors = np.zeros((count, joints, 3)), np.zeros((count, joints, 3))
    cos, sin = np.cos(angles), np.sin(angles)
    for joint in range(joints):
        turn = np.zeros((count, 4, 4))
        turn[:, 0, 0] = turn[:, 1, 1] = cos[:, joint]
        turn[:, 1, 0], turn[:, 0, 1] = sin[:, joint], -sin[:, joint]
        turn[:, 2, 2] = turn[:, 3, 3] = 1.0
        pose = pose @ (chain.parent_from_joint[joint] @ turn)
        axes[:, joint], anchors[:, joint] = pose[:, :3, 2], pose[:, :3, 3]
    pose = pose @ chain.last_from_tool
    along = np.cross(axes, pose[:, None, :3, 3] - anchors)
    return Placed(pose, np.concatenate([along, axes], axis=2).transpose(0, 2, 1))


def solve(chain: Chain, base_from_tool: np.ndarray, start: np.ndarray, iterations: int) -> Solved:
    """Inverse kinematics within joint limits for tool poses (n, 4, 4), from `start` (n, j) by damped least squares.

    Null-space motion goes towards rest (Liegeois 1977).
    """
    angles = np.clip(start, chain.low, chain.high)
    damping, joints = _DAMPING**2 * np.eye(6), np.eye(angles.shape[1])
    for _ in range(iterations):
        now = placed(chain, angles)
        error = _error(base_from_tool, now.base_from_tool)
        error[:, 3:] *= _TURN_M
        jacobian = now.jacobian.copy()
        jacobian[:, 3:] *= _TURN_M
        inverse = jacobian.transpose(0, 2, 1) @ np.linalg.inv(jacobian @ jacobian.transpose(0, 2, 1) + damping)
        homing = _HOMING * (chain.rest - angles)
        step = (inverse @ error[..., None])[..., 0] + ((joints - inverse @ jacobian) @ homing[..., None])[..., 0]
        angles = np.clip(angles + np.clip(step, -_MOST_RAD, _MOST_RAD), chain.low, chain.high)
    left = _error(base_from_tool, placed(chain, angles).base_from_tool)
    return Solved(angles, np.linalg.norm(left[:, :3], axis=1), np.linalg.norm(left[:, 3:], axis=1))


def ease(chain: Chain, angles: np.ndarray) -> float:
    """Minimum dexterity over all angles (n, j); 0 at a singularity.

    The smallest singular value of the Jacobian (metres, a rad counting as 0.3 m), reduced near joint limits (Tsai 1986).
    """
    jacobian = placed(chain, angles).jacobian.copy()
    jacobian[:, 3:] *= _TURN_M
    share = (angles - chain.low) * (chain.high - angles) / ((chain.high - chain.low) / 2) ** 2
    return float((np.linalg.svd(jacobian, compute_uv=False)[:, -1] * share.min(axis=1)).min())


def matrices(poses: list[Rigid3]) -> np.ndarray:
    """Poses as (n, 4, 4)."""
    return np.stack([pose.matrix for pose in poses])


def _error(wanted: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Pose error (n, 6) from current to wanted in metres and radians, in the base's frame."""
    turn = wanted[:, :3, :3] @ now[:, :3, :3].transpose(0, 2, 1)
    twist = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], axis=1)
    sine, cosine = np.linalg.norm(twist, axis=1) / 2, (np.trace(turn, axis1=1, axis2=2) - 1) / 2
    scale = np.arctan2(sine, cosine) / np.maximum(2 * sine, 1e-9)
    return np.concatenate([wanted[:, :3, 3] - now[:, :3, 3], scale[:, None] * twist], axis=1)


def _matrix(position: np.ndarray, quat_wxyz: np.ndarray) -> np.ndarray:
    return Rigid3(rotation_of(quat_wxyz), np.array(position)).matrix
