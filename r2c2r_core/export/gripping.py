"""Robot trials on a bundle's joints: the gripper in parallel processes beside the other tests, and the arm."""

from collections.abc import Callable
from itertools import zip_longest
from pathlib import Path
from typing import Any

from r2c2r_core.failing import apart
from r2c2r_core.pool import Failed, Pool, Task
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.robot.arm_certificate import arm_to_json, certify_with_arm
from r2c2r_core.robot.certificate import Grip, GripperCertificate, certify_with_gripper, gripper_to_json, try_share

SCENE = "scene.xml"
_PROCESSES = 4  # at most: each compiles the scene, 0.3 GB, and a kitchen has a dozen joints


def begin_gripping(folder: Path, pool: Pool, progress: Progress = SILENT) -> Callable[[], dict[str, Any] | None]:
    """Start gripper trials on every joint and free object of a bundle's scene.xml; contact sheets go to its gripper/.

    The returned function waits and returns the results as JSON, or None where MuJoCo cannot load the scene. With a pool of
    one process, all trials run during that wait. The result does not depend on the number of processes.
    """
    scene, films = folder / SCENE, folder / "gripper"
    count = min(pool.workers, _PROCESSES)
    if count == 1:
        return lambda: _told(lambda: certify_with_gripper(scene, films, moving=False, progress=progress))
    tasks = {str(first): Task(try_share, (scene, films, False, first, count)) for first in range(count)}
    answers = pool.run(tasks, progress)
    return lambda: _told(lambda: _joined(dict(answers)))


def arm_tried(folder: Path, progress: Progress = SILENT) -> dict[str, Any]:
    """Arm results on a bundle's scene.xml as JSON, or `why` it was not tried; pictures and its map go to arm/."""
    lost: dict[str, str] = {}
    with apart("export", "the arm", lost):
        return arm_to_json(certify_with_arm(folder / SCENE, folder / "arm", moving=False, progress=progress))
    return {"why": lost["the arm"]}


def _told(certified: Callable[[], GripperCertificate]) -> dict[str, Any] | None:
    with apart("export", "the gripper", {}):
        return gripper_to_json(certified())
    return None


def _joined(answers: dict[str, list[Grip] | Failed]) -> GripperCertificate:
    """The results merged in the order of a single process."""
    shares: list[list[Grip]] = []
    for first in range(len(answers)):
        answer = answers[str(first)]
        if isinstance(answer, Failed):
            raise answer.error
        shares.append(answer)
    return GripperCertificate(grips=tuple(grip for tried in zip_longest(*shares) for grip in tried if grip is not None))
