"""A person's hand and forearm on a moving front: dark, and background."""

import numpy as np

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.synthetic.kitchen import Paint
from r2c2r_core.synthetic.opening import Front
from r2c2r_core.synthetic.patches import Patch, lathe, moving

_SLEEVE = Paint(kind="laminate", colour=(0.06, 0.05, 0.05), texel_m=0.004)
_PROFILE = ((0.0, 0.62), (0.055, 0.6), (0.05, 0.35), (0.034, 0.14), (0.045, 0.08), (0.04, 0.02), (0.0, 0.0))
_SHOULDER_DROP_M, _SHOULDER_ASIDE_M = 0.3, 0.25  # of the hand's owner, who holds the phone in the other hand


def hand_mover(joint: str) -> str:
    """Mover name of the hand on that joint's front."""
    return f"hand:{joint}"


def hand_patches(joint: str) -> list[Patch]:
    """A hand at the origin with its arm along +Z."""
    return moving([lathe((0.0, 0.0, 0.0), list(_PROFILE), _SLEEVE, sides=16)], hand_mover(joint))


def hand_pose(front: Front, grip: np.ndarray, state: float, eye: np.ndarray, right: np.ndarray) -> Rigid3:
    """Pose of the hand: on the grip (a point of the closed front), its arm towards the person behind the camera."""
    place = front.pose(state).apply(grip)
    shoulder = eye - [0.0, 0.0, _SHOULDER_DROP_M] + _SHOULDER_ASIDE_M * right
    along = shoulder - place
    along = along / np.linalg.norm(along)
    across = np.cross(along, [0.0, 0.0, 1.0])
    across = across / max(float(np.linalg.norm(across)), 1e-9)
    return Rigid3(np.column_stack([across, np.cross(along, across), along]), place + 0.01 * along)


def grip_of(front: Front, patches: list[Patch]) -> np.ndarray:
    """Grip point of a hand: the handle's centre, or the middle of the edge that moves most."""
    handle = [p.grid.reshape(-1, 3) for p in patches if p.mover == front.joint.name and p.is_handle]
    if handle:
        return np.asarray(np.concatenate(handle).mean(axis=0))
    moved = np.linalg.norm(front.pose(0.5).apply(front.corners) - front.corners, axis=1)
    if front.joint.type == "prismatic":
        return np.asarray(front.corners[front.corners[:, 2] > front.middle[2]].mean(axis=0))
    return np.asarray(front.corners[moved > 0.9 * moved.max()].mean(axis=0))
