"""Joint estimation of ripl-articulation (by ArtiPoint's authors) compared with this project, on the joints of opened.py.

    python benchmarks/peer.py --python PEER/bin/python --workdir DIR [--noise-mm 4] [--noise-deg 0.5]

The peer estimates no poses: it receives the part's true poses in every frame that shows it open, with Gaussian noise (one sigma
per axis, independent in each frame). This project's figures are those of DIR's bundles, from pictures and clicks alone; both
are scored by every definition (joint_definitions.py). The peer's joint type follows ArtiPoint's rule: a twist whose rotational
part is longer than 0.3 of its norm is revolute.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from joint_definitions import Line, definitions
from scipy.spatial.transform import Rotation

from r2c2r_core.evaluate.joints import pair_joints
from r2c2r_core.evaluate.records import JointRecord, MotionRecord, ObjectRecord, read_bundle, read_truth
from r2c2r_core.evaluate.stage import match_objects
from r2c2r_core.geometry.transforms import Rigid3

_SCRIPT = Path(__file__).resolve().parent / "peer_ripl.py"
_TURNS = 0.3
_FEWEST = 4  # minimum number of frames to fit a joint


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit, score, print one table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", required=True, help="Python of the environment that has ripl-articulation")
    parser.add_argument("--workdir", type=Path, required=True)
    parser.add_argument("--noise-mm", type=float, default=4.0)
    parser.add_argument("--noise-deg", type=float, default=0.5)
    options = parser.parse_args(arguments)
    noise = options.noise_mm / 1000, float(np.radians(options.noise_deg))
    theirs: list[dict[str, float]] = []
    ours: list[dict[str, float]] = []
    for number, truth in enumerate(sorted(options.workdir.glob("*/truth.json"))):
        objects = read_truth(truth, Rigid3())
        theirs += peer_errors(objects, options.python, noise, np.random.default_rng([number, 7]))
        ours += own_errors(truth)
    print(table({"ripl-articulation": theirs, "r2c2r": ours}))
    return 0


def peer_errors(
    objects: tuple[ObjectRecord, ...], python: str, noise: tuple[float, float], rng: np.random.Generator
) -> list[dict[str, float]]:
    """Errors of every joint that opens; for those of the wrong type only that fact."""
    joints = {joint.name: (thing, joint, joint.motion) for thing in objects for joint in thing.joints if _opens(joint.motion)}
    poses = {name: part_poses(*each, noise, rng) for name, each in joints.items()}  # type: ignore[arg-type]
    poses = {name: each for name, each in poses.items() if len(each["part"]) >= _FEWEST}
    done = subprocess.run([python, str(_SCRIPT)], input=json.dumps(poses), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{python}: {done.stderr.strip().splitlines()[-1]}; install ripl-articulation there")
    return [
        _scored(joints[name][0], joints[name][1], np.array(each["twist"])) for name, each in json.loads(done.stdout).items()
    ]


def part_poses(
    thing: ObjectRecord, joint: JointRecord, motion: MotionRecord, noise: tuple[float, float], rng: np.random.Generator
) -> dict[str, Any]:
    """World poses of the unit and of its part in the frames that show the part open.

    Closed frames are withheld: the peer is biased towards a part that does not move, as its authors state, and is off by
    degrees where most frames are closed.
    """
    base, parts = thing.world_from_object, []
    for frame in sorted(motion.shown):
        state = motion.states[frame] or 0.0
        if state <= 0:
            continue
        turn = Rotation.from_rotvec(state * joint.axis).as_matrix() if joint.type == "revolute" else np.eye(3)
        shift = joint.origin - turn @ joint.origin if joint.type == "revolute" else state * joint.axis
        shake = Rigid3(Rotation.from_rotvec(noise[1] * rng.standard_normal(3)).as_matrix(), noise[0] * rng.standard_normal(3))
        parts.append((Rigid3(turn, shift) @ base @ shake).matrix.tolist())
    return {"base": [base.matrix.tolist()] * len(parts), "part": parts}


def _scored(thing: ObjectRecord, joint: JointRecord, twist: np.ndarray) -> dict[str, float]:
    turn, shift = twist[:3], twist[3:]
    length = float(np.linalg.norm(turn))
    turns = length > _TURNS * float(np.linalg.norm(twist))
    if turns != (joint.type == "revolute"):
        return {"type": 0.0}
    local = turn / length if turns else shift / np.linalg.norm(shift)
    place = np.cross(turn, shift) / length**2 if turns else np.zeros(3)
    found = Line(origin=thing.world_from_object.apply(place), axis=thing.world_from_object.turn(local))
    return {"type": 1.0} | _errors(joint, found)


def own_errors(truth: Path) -> list[dict[str, float]]:
    """The same errors of the bundle that benchmarks/opened.py made of that recording; empty if there is none."""
    bundle = truth.parent / "run" / "bundle.zip"
    if not bundle.exists():
        return []
    record = read_bundle(bundle)
    truths = read_truth(truth, record.world_from_capture)
    errors = []
    for true, found in zip(truths, match_objects(truths, record.objects), strict=True):
        for a, b in pair_joints(true.joints, () if found is None else found.joints):
            if _opens(a.motion):
                right = b is not None and a.type == b.type
                line = Line(origin=b.origin, axis=b.axis) if b is not None else None
                errors.append({"type": 1.0} | _errors(a, line) if right and line is not None else {"type": 0.0})
    return errors


def _errors(true: JointRecord, found: Line) -> dict[str, float]:
    every = definitions(Line(origin=true.origin, axis=true.axis), found)
    return every if true.type == "revolute" else {name: value for name, value in every.items() if "axis" in name}


def _opens(motion: MotionRecord | None) -> bool:
    return motion is not None and motion.opens


def table(errors: dict[str, list[dict[str, float]]]) -> str:
    """Median and worst error by each definition, with one column of both per method."""
    names = dict.fromkeys(name for each in errors.values() for entry in each for name in entry)
    lines = ["| | " + " | ".join(f"{method}: median | worst" for method in errors) + " |", "|---" * (1 + 2 * len(errors)) + "|"]
    for name in names:
        cells = []
        for each in errors.values():
            values = np.array([entry[name] for entry in each if name in entry], float)
            known = values[np.isfinite(values)]
            if name == "type":
                cells += [f"{100 * known.mean():.0f} % of {len(known)}" if len(known) else "-", ""]
            else:
                cells += [f"{np.median(known):.3g}", f"{known.max():.3g}"] if len(known) else ["-", "-"]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
