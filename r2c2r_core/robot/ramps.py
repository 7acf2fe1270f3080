"""Time profiles of commands: waiting, and smooth ramps."""

from collections.abc import Iterator
from typing import TypeVar

from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.robot.rig import Rig

T = TypeVar("T")


def wait(rig: Rig, command: T, seconds: float) -> Iterator[T]:
    """The same command for a duration."""
    for _ in range(round(seconds / rig.step_s)):
        yield command


def ramp(rig: Rig, seconds: float) -> Iterator[float]:
    """A smooth ramp from 0 to 1, slow at both ends."""
    count = max(round(seconds / rig.step_s), 1)
    for number in range(1, count + 1):
        t = number / count
        yield t * t * (3 - 2 * t)


def approach_from(rig: Rig, pose: Rigid3, back_m: float, seconds: float = 0.8) -> Iterator[Rigid3]:
    """Poses from `back_m` before a pose, along its own x, up to it."""
    for share in ramp(rig, seconds):
        yield Rigid3(pose.rotation, pose.translation - (1 - share) * back_m * pose.rotation[:, 0])
