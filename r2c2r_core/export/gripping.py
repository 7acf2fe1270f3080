"""Robot trials on a bundle's joints: the gripper in parallel processes beside the other tests, and the arm."""

from collections.abc import Callable
from itertools import zip_longest
from pathlib import Path
from typing import Any

from r2c2r_core.failing import OBJECT_FAILS, apart, record
from r2c2r_core.pool import Failed, Pool, Task
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.robot.arm_certificate import arm_to_json, certify_with_arm
from r2c2r_core.robot.certificate import Grip, GripperCertificate, certify_with_gripper, gripper_to_json, try_share, untried

SCENE = "scene.xml"
_PROCESSES = 4  # at most: each compiles the scene, 0.3 GB, and a kitchen has a dozen joints


def begin_gripping(folder: Path, pool: Pool, progress: Progress = SILENT) -> Callable[[], dict[str, Any]]:
    """Start gripper trials on every joint and free object of a bundle's scene.xml; contact sheets go to its gripper/.

    The returned function waits and returns the results as JSON, or `why` nothing was tried. With a pool of one process, all
    trials run during that wait. The result does not depend on the number of processes.
    """
    scene, films = folder / SCENE, folder / "gripper"
    count = min(pool.workers, _PROCESSES)
    if count == 1:
        return lambda: _tried(
            "the gripper", lambda: gripper_to_json(certify_with_gripper(scene, films, moving=False, progress=progress))
        )
    tasks = {str(first): Task(try_share, (scene, films, False, first, count)) for first in range(count)}
    answers = pool.run(tasks, progress)
    return lambda: _tried("the gripper", lambda: gripper_to_json(_joined(scene, dict(answers))))


def arm_tried(folder: Path, progress: Progress = SILENT) -> dict[str, Any]:
    """Arm results on a bundle's scene.xml as JSON, or `why` it was not tried; pictures and its map go to arm/."""
    scene, films = folder / SCENE, folder / "arm"
    return _tried("the arm", lambda: arm_to_json(certify_with_arm(scene, films, moving=False, progress=progress)))


def _tried(robot: str, results: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    failed: dict[str, str] = {}
    with apart("export", robot, failed):
        return results()
    return {"why": failed[robot]}


def _joined(scene: Path, answers: dict[str, list[Grip] | Failed]) -> GripperCertificate:
    """The results merged in the order of a single process; trials of a process that failed are listed with its error."""
    failed = [answer.error for answer in answers.values() if isinstance(answer, Failed)]
    if len(failed) == len(answers) or any(not isinstance(error, OBJECT_FAILS) for error in failed):
        raise failed[0]
    shares: list[list[Grip]] = []
    for first in range(len(answers)):
        answer, said = answers[str(first)], dict[str, str]()
        if isinstance(answer, Failed):
            record("export", "the gripper", answer.error, said, answer.where)
            answer = untried(scene, said["the gripper"], first, len(answers))
        shares.append(answer)
    return GripperCertificate(grips=tuple(grip for tried in zip_longest(*shares) for grip in tried if grip is not None))
