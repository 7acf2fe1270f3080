"""The arm's certificate: base positions for each joint, and trials that open and close every joint from them."""

from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.robot import panda
from r2c2r_core.robot.arm import Arm, Stand, arm_in
from r2c2r_core.robot.arms import MAP
from r2c2r_core.robot.certificate import Grip, film_of_joint, filmed_to, grip_to_json, tried
from r2c2r_core.robot.film import Film
from r2c2r_core.robot.grasps import Way, clear_ways
from r2c2r_core.robot.motion import Travel, travel_of
from r2c2r_core.robot.opening import joints_of, reset
from r2c2r_core.robot.rig import GRIPS_N, Rig, gripper_in
from r2c2r_core.robot.standing import Floor, Reach, fewest_places, flipped, free_floor, reaches
from r2c2r_core.robot.standing_map import standing_svg
from r2c2r_core.robot.view import Surfaces, surfaces_of

ARM_VERSION = 1
_WAYS = 4  # maximum grasps tested per joint until one is reachable
_SEEN_M = 0.8  # margin around a front, so that the arm is in the picture


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmCertificate:
    """Results of all joints of a bundle, with base positions."""

    grips: tuple[Grip, ...]
    floor: Floor
    reached: dict[str, dict[Stand, Reach]]  # by joint
    places: dict[Stand, tuple[str, ...]]  # a small set of base positions that serves every reachable joint

    @property
    def opened(self) -> int:
        """Number of joints that the arm opened and closed."""
        return sum(grip.passed for grip in self.grips)


def certify_with_arm(
    scene: Path, films: Path | None = None, *, moving: bool = True, progress: Progress = SILENT
) -> ArmCertificate:
    """Place the arm within reach and let it open every joint of a scene.xml; pictures and the map go to `films`.

    Raises ValueError where the file is not a scene, BackendUnavailable without the arm's extra.
    """
    arm, gripper = arm_in(scene), gripper_in(scene)
    joints = joints_of(arm.model)
    travels = {joint: travel for joint in joints if (travel := travel_of(arm, joint)) is not None}
    handles = [t.world_from_closed.apply((t.part.bar or t.part.front).centre) for t in travels.values()]
    floor = free_floor(arm.model, arm.data, arm.own, handles)
    ways: dict[str, Way] = {}
    reached: dict[str, dict[Stand, Reach]] = {joint: {} for joint in joints}
    for joint in progress.part(0.0, 0.5).each(list(travels), "searching base positions"):
        if (found := _reached(arm, gripper, travels[joint], floor)) is not None:
            ways[joint], reached[joint] = found
    places = {stand: tuple(served) for stand, served in fewest_places(reached).items()}
    surfaces = surfaces_of(arm.model) if films is not None else None
    grips = []
    for joint in progress.part(0.5, 1.0).each(joints, "the arm"):
        if not reached[joint]:
            grips.append(_out_of_reach(joint, joint in travels))
            continue
        planned = next(stand for stand, served in places.items() if joint in served)
        grip, film = _from(arm, travels[joint], ways[joint], planned, reached[joint][planned], surfaces)
        grips.append(filmed_to(grip, film, films, moving))
    if films is not None:
        films.mkdir(parents=True, exist_ok=True)
        (films / MAP).write_text(standing_svg(floor, reached, places), encoding="utf-8")
    return ArmCertificate(grips=tuple(grips), floor=floor, reached=reached, places=places)


def arm_to_json(certificate: ArmCertificate) -> dict[str, Any]:
    """The certificate as a versioned JSON document."""
    return {
        "version": ARM_VERSION,
        "arm": {"name": panda.NAME, "source": panda.SOURCE, "grips_n": list(GRIPS_N), "lifts_m": list(panda.LIFTS_M)},
        "joints_opened": certificate.opened,
        "joints_in_reach": sum(bool(stands) for stands in certificate.reached.values()),
        "joints": len(certificate.grips),
        "places": [
            {"x_m": s.x_m, "y_m": s.y_m, "yaw_rad": round(s.yaw_rad, 3), "lift_m": s.lift_m, "joints": list(served)}
            for s, served in certificate.places.items()
        ],
        "reached_from": {joint: len({stand[:2] for stand in stands}) for joint, stands in certificate.reached.items()},
        "grips": [grip_to_json(grip) for grip in certificate.grips],
    }


def _reached(arm: Arm, gripper: Rig, travel: Travel, floor: Floor) -> tuple[Way, dict[Stand, Reach]] | None:
    """The first collision-free grasp that the arm can reach, with its base positions; None where there is none."""
    reset(gripper)
    for way in islice(clear_ways(gripper, travel), _WAYS):
        if found := reaches(arm, travel, way, floor.stands):
            return way, found
    return None


def _from(
    arm: Arm, travel: Travel, way: Way, stand: Stand, reach: Reach, surfaces: Surfaces | None
) -> tuple[Grip, Film | None]:
    """Trial of a joint from one base position."""

    def begin() -> None:
        reset(arm)
        arm.stand(stand, reach.start)

    filmed = None if surfaces is None else lambda: film_of_joint(arm, travel, surfaces, _SEEN_M)
    grip, film = tried(arm, travel, flipped(way) if reach.flipped else way, begin, filmed)
    return (grip if grip.passed else replace(grip, blame="arm")), film


def _out_of_reach(joint: str, board: bool) -> Grip:
    why = "no place on the floor lets the arm reach the whole motion" if board else "nothing to grasp"
    return Grip(kind="joint", name=joint, method=None, passed=False, why=why, blame="arm" if board else "scan")
