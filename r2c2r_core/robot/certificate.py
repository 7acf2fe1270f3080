"""The gripper's certificate: trials that open and close every joint and move every free object, by friction alone."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.failing import apart
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.robot.film import Film, film_of
from r2c2r_core.robot.grasps import EJECTED_M, Method, Way, best_way, body_words
from r2c2r_core.robot.motion import Travel, travel_of
from r2c2r_core.robot.opening import Measured, attempt, joints_of, reset
from r2c2r_core.robot.picking import Pick, pick_and_place, plan_pick, things_of
from r2c2r_core.robot.rig import GRIPS_N, STROKE_M, Rig, gripper_in
from r2c2r_core.robot.verdicts import Blame, unholdable, verdict_on, verdict_on_pick
from r2c2r_core.robot.view import Surfaces, surfaces_of

GRIPPER_VERSION = 1

Kind = Literal["joint", "thing"]

_NAN = float("nan")


@dataclass(frozen=True, slots=True, kw_only=True)
class Grip:
    """Result at one joint or object: numbers of the last attempt, or of the strongest grip where none succeeded."""

    kind: Kind
    name: str
    method: Method | Literal["pick"] | None  # None: no grasp found
    passed: bool
    grip_n: float = _NAN  # grip force that sufficed, or the largest tried
    opened: float = _NAN  # 0..1 of the travel
    left_open: float = _NAN  # 0..1 of the travel at the end
    reach_m: float = _NAN  # distance between the actual and the planned position of the closed pads
    slip_m: float = _NAN
    force_n: float = _NAN  # maximum base force while moving the joint
    off_m: float = _NAN  # final distance of an object from its goal
    touched: tuple[tuple[str, float], ...] = ()  # other bodies touched, and the maximum force in N
    why: str = ""
    blame: Blame | None = None  # None: it passed, or the trial itself failed
    film: str | None = None  # file name without extension


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperCertificate:
    """Results of all joints and free objects of a bundle."""

    grips: tuple[Grip, ...]

    def share(self, kind: str) -> tuple[int, int]:
        """Number of passed trials of a kind, and their total."""
        own = [grip for grip in self.grips if grip.kind == kind]
        return sum(grip.passed for grip in own), len(own)

    @property
    def passed(self) -> bool:
        """Whether every joint was opened and closed; objects that cannot be picked up do not count."""
        done, count = self.share("joint")
        return done == count


def certify_with_gripper(
    scene: Path, films: Path | None = None, *, moving: bool = True, progress: Progress = SILENT
) -> GripperCertificate:
    """Try every joint and free object of a scene.xml; a contact sheet of each goes to `films`, and if `moving` a GIF.

    Raises ValueError where the file is not a scene.
    """
    return GripperCertificate(grips=tuple(try_share(scene, films, moving, progress=progress)))


def try_share(
    scene: Path, films: Path | None, moving: bool, first: int = 0, step: int = 1, *, progress: Progress = SILENT
) -> list[Grip]:
    """Trials of every `step`-th joint or free object of a scene.xml from index `first`, joints before objects."""
    rig = gripper_in(scene)
    surfaces = surfaces_of(rig.model) if films is not None else None
    things, grips = _things(rig), list[Grip]()
    for name in progress.each([*joints_of(rig.model), *things][first::step], "gripper"):
        failed: dict[str, str] = {}
        with apart("gripper", name, failed):
            grip, film = _thing(rig, things[name], surfaces) if name in things else _joint(rig, name, surfaces)
            grips.append(filmed_to(grip, film, films, moving))
        grips += [_without_trial(name, why, name in things) for why in failed.values()]
    return grips


def untried(scene: Path, why: str, first: int, step: int) -> list[Grip]:
    """The trials of `try_share` as failed ones, for a process that was lost."""
    rig = gripper_in(scene)
    things = _things(rig)
    return [_without_trial(name, why, name in things) for name in [*joints_of(rig.model), *things][first::step]]


def _things(rig: Rig) -> dict[str, int]:
    """Bodies of the free objects by name."""
    return {body_words(rig.model, body): body for body in things_of(rig.model)}


def _without_trial(name: str, why: str, thing: bool) -> Grip:
    return Grip(kind="thing" if thing else "joint", name=name, method=None, passed=False, why=why)


def gripper_to_json(certificate: GripperCertificate) -> dict[str, Any]:
    """The certificate as a versioned JSON document; what was not measured is null."""
    (opened, joints), (moved, things) = certificate.share("joint"), certificate.share("thing")
    return {
        "version": GRIPPER_VERSION,
        "gripper": {"stroke_m": STROKE_M, "grips_n": list(GRIPS_N), "latch_throw_m": EJECTED_M},
        "joints_opened": opened,
        "joints": joints,
        "things_moved": moved,
        "things": things,
        "grips": [grip_to_json(grip) for grip in certificate.grips],
    }


def grip_to_json(grip: Grip) -> dict[str, Any]:
    """Result at one joint or object as JSON."""
    numbers = ("grip_n", "opened", "left_open", "reach_m", "slip_m", "force_n", "off_m")
    return {
        "kind": grip.kind,
        "name": grip.name,
        "method": grip.method,
        "passed": grip.passed,
        **{name: _number(getattr(grip, name)) for name in numbers},
        "touched": [{"name": name, "force_n": round(force, 1)} for name, force in grip.touched],
        "why": grip.why,
        "blame": grip.blame,
        "film": grip.film,
    }


def _joint(rig: Rig, joint: str, surfaces: Surfaces | None) -> tuple[Grip, Film | None]:
    reset(rig)
    travel = travel_of(rig, joint)
    way = None if travel is None else best_way(rig, travel)
    if travel is None or way is None:
        why, blame = unholdable(travel)
        return Grip(kind="joint", name=joint, method=None, passed=False, why=why, blame=blame), None
    return tried(
        rig, travel, way, lambda: reset(rig), None if surfaces is None else lambda: film_of_joint(rig, travel, surfaces)
    )


def tried(
    rig: Rig, travel: Travel, way: Way, begin: Callable[[], None], filmed: Callable[[], Film] | None
) -> tuple[Grip, Film | None]:
    """Trial of a grasp, with the stronger grip if the first fails; `begin` resets the scene."""
    measured, verdict, film, grip_n = Measured(), None, None, _NAN
    for grip_n in GRIPS_N:
        rig.grip_with(grip_n)
        begin()
        film = None if filmed is None else filmed()
        measured = attempt(rig, travel, way, film.watch if film is not None else None)
        verdict = verdict_on(rig.model, travel, way, measured)
        if verdict is None:
            break
    grip = Grip(
        kind="joint",
        name=travel.part.joint,
        method=way.method,
        passed=verdict is None,
        grip_n=grip_n,
        opened=measured.opened,
        left_open=max(measured.closed, 0.0),
        reach_m=measured.reach_m,
        slip_m=measured.slip_m,
        force_n=measured.force_n,
        touched=_touched(rig, measured),
        why="" if verdict is None else verdict.why,
        blame=None if verdict is None else verdict.blame,
    )
    return grip, film


def _thing(rig: Rig, body: int, surfaces: Surfaces | None) -> tuple[Grip, Film | None]:
    name = body_words(rig.model, body)
    reset(rig)
    pick = plan_pick(rig, body)
    if isinstance(pick, str):
        return Grip(kind="thing", name=name, method=None, passed=False, why=pick, blame="world"), None
    film, put, grip_n = None, None, _NAN
    for grip_n in GRIPS_N:
        rig.grip_with(grip_n)
        reset(rig)
        film = None if surfaces is None else film_of(surfaces, rig, pick.grasp.translation, _seen_from(rig, pick), 0.4)
        put = pick_and_place(rig, pick, film.watch if film is not None else None)
        if put.done:
            break
    assert put is not None
    verdict = None if put.done else verdict_on_pick(put.lifted, put.off_m, float(rig.model.body_subtreemass[body]))
    grip = Grip(
        kind="thing",
        name=name,
        method="pick",
        passed=put.done,
        grip_n=grip_n,
        off_m=put.off_m,
        why="" if verdict is None else verdict.why,
        blame=None if verdict is None else verdict.blame,
    )
    return grip, film


def film_of_joint(rig: Rig, travel: Travel, surfaces: Surfaces, least_m: float = 0.4) -> Film:
    """A film of the joint's front, with at least `least_m` on all sides."""
    pose, front = travel.world_from_closed, travel.part.front
    reach_m = max(0.8 * float(front.size[0]), 0.8 * float(front.size[2]), least_m)
    return film_of(surfaces, rig, pose.apply(front.centre), level(-pose.rotation[:, 1]), reach_m)


def _seen_from(rig: Rig, pick: Pick) -> Vector3:
    """Horizontal direction from an object to the bundle's camera, else to the gripper's approach side."""
    if rig.model.ncam:
        return level(rig.data.cam_xpos[0] - pick.grasp.translation)
    return level(-pick.grasp.rotation[:, 0])


def level(direction: Vector3) -> Vector3:
    """The horizontal part of a direction, of length 1; towards -y of an upright one."""
    flat = np.array([direction[0], direction[1], 0.0])
    length = float(np.linalg.norm(flat))
    return flat / length if length > 1e-3 else np.array([0.0, -1.0, 0.0])


def _touched(rig: Rig, measured: Measured) -> tuple[tuple[str, float], ...]:
    return tuple(sorted((body_words(rig.model, body), force) for body, force in measured.touched.items()))


def filmed_to(grip: Grip, film: Film | None, folder: Path | None, moving: bool) -> Grip:
    """Write the film and return the grip with its file name."""
    if film is None or folder is None or not film.moments:
        return grip
    folder.mkdir(parents=True, exist_ok=True)
    if moving:
        (folder / f"{grip.name}.gif").write_bytes(film.gif())
    (folder / f"{grip.name}.jpg").write_bytes(film.sheet_jpg())
    return replace(grip, film=grip.name)


def _number(value: float) -> float | None:
    return round(value, 4) + 0.0 if np.isfinite(value) else None
