"""Duration of synthesis, warp, export and certificate for a room of 20 objects or more, made of two finished kitchens.

    python benchmarks/galley.py --workdir DIR [--kitchens seed0,seed1] [--objects 20] [--json FILE]

The second kitchen is rotated and placed opposite the first, as in a galley kitchen: every noun that a stage passes on (tracks,
placements, frames, the scanned surface) is transformed with it, so the four stages work on real measurements and pictures of 20
objects. DIR holds the workdirs of finished `r2c2r run`s, as benchmarks/scene.py reads them. Times are meaningful on an idle
machine only: the load is recorded beside them.
"""

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from proof import Placed, certificate_figures, placed_by, prove

from r2c2r_core.arrays import Image
from r2c2r_core.geometry.transforms import Rigid3, Similarity3, rotation_about_z
from r2c2r_core.model.capture import Capture, Depth, FrameImages, SceneSurface, Wall
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.workspace import Workspace

_AISLE_M = 2.0
_SECOND = 1_000_000  # offset of the second recording's frame numbers


@dataclass(frozen=True, slots=True)
class _BothImages:
    """Pixels of both captures."""

    first: FrameImages
    second: FrameImages

    def rgb(self, frame_index: int) -> Image:
        return self.second.rgb(frame_index - _SECOND) if frame_index >= _SECOND else self.first.rgb(frame_index)

    def depth(self, frame_index: int) -> Depth:
        return self.second.depth(frame_index - _SECOND) if frame_index >= _SECOND else self.first.depth(frame_index)


def main(arguments: Sequence[str] | None = None) -> int:
    """Time one room."""
    parser = argparse.ArgumentParser(description="The four stages after the alignment on a room of 20 objects.")
    parser.add_argument("--workdir", type=Path, required=True)
    parser.add_argument("--kitchens", default="seed0,seed1")
    parser.add_argument("--objects", type=int, default=20)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    first, second = (placed_by(Workspace(options.workdir / name)) for name in options.kitchens.split(","))
    figures = timed(galley(first, second, options.objects)) | {"kitchens": options.kitchens}
    print(json.dumps(figures))
    if options.json is not None:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return 0 if figures["passed"] and figures["seconds_in_all"] <= 60.0 else 1


def timed(placed: Placed) -> dict[str, Any]:
    """Seconds of each stage, and the certificate's figures for the room."""
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory(prefix="r2c2r-galley-") as folder:
        proof = prove(placed, Path(folder) / "bundle.zip")
    return certificate_figures(proof.certificate) | {
        "objects": len(proof.scene.objects),
        "joints": len(proof.certificate.joints),
        "seconds": {name: round(value, 1) for name, value in proof.seconds.items()},
        "seconds_in_all": round(sum(proof.seconds.values()), 1),
        "cpu_seconds": round(proof.cpu_seconds, 1),
        "load_before": round(load, 1),
    }


def galley(first: Placed, second: Placed, objects: int) -> Placed:
    """One room: all of the first kitchen and, opposite, as many objects of the second as are needed."""
    moved = _moved(second, _opposite(_fronts(first), _fronts(second)))
    joined = Capture(
        name=f"{first.capture.name} and {second.capture.name}",
        sha256=first.capture.sha256,
        format=first.capture.format,
        frames=(*first.capture.frames, *moved.capture.frames),
        world_from_capture=first.capture.world_from_capture,
        room=replace(first.capture.room, walls=(*first.capture.room.walls, *moved.capture.room.walls)),
        surface=_together(first.capture.surface, moved.capture.surface),
        images=_BothImages(first.capture.images, second.capture.images),
        notices=(),
    )
    return Placed(
        joined,
        [*first.tracks, *moved.tracks][:objects],
        [*first.placements, *moved.placements][:objects],
        [*first.assets, *moved.assets][:objects],
    )


def _fronts(placed: Placed) -> list[Rigid3]:
    return [track.front.world_from_front for track in placed.tracks if track.front is not None]


def _opposite(fronts: list[Rigid3], others: list[Rigid3]) -> Rigid3:
    """The rigid motion after which the second kitchen's fronts face the first's across the aisle."""

    def middle_and_yaw(poses: list[Rigid3]) -> tuple[np.ndarray, float]:
        outward = -np.sum([pose.rotation[:, 1] for pose in poses], axis=0)
        return np.mean([pose.translation for pose in poses], axis=0), float(np.arctan2(outward[1], outward[0]))

    (here, facing), (there, other) = middle_and_yaw(fronts), middle_and_yaw(others)
    turn = rotation_about_z(facing + np.pi - other)
    target = here + _AISLE_M * np.array([np.cos(facing), np.sin(facing), 0.0])
    shift = target - turn @ there
    return Rigid3(turn, np.array([shift[0], shift[1], 0.0]))


def _moved(placed: Placed, new_from_old: Rigid3) -> Placed:
    """A kitchen with every world coordinate transformed, and with names and frame numbers made unique."""
    capture, tracks, placements, assets = placed
    frames = tuple(
        replace(f, index=f.index + _SECOND, world_from_camera=new_from_old @ f.world_from_camera) for f in capture.frames
    )
    surface = replace(capture.surface, vertices_world=new_from_old.apply(capture.surface.vertices_world))
    walls = tuple(_moved_wall(wall, new_from_old) for wall in capture.room.walls)
    similar = Similarity3(1.0, new_from_old.rotation, new_from_old.translation)
    return Placed(
        replace(capture, frames=frames, surface=surface, room=replace(capture.room, walls=walls), poses=None),
        [_moved_track(track, new_from_old) for track in tracks],
        [replace(p, object_name=f"b_{p.object_name}", world_from_mesh=similar @ p.world_from_mesh) for p in placements],
        [replace(asset, object_name=f"b_{asset.object_name}") for asset in assets],
    )


def _moved_track(track: MaskTrack, new_from_old: Rigid3) -> MaskTrack:
    front, box = track.front, track.box
    return replace(
        track,
        name=f"b_{track.name}",
        masks={index + _SECOND: mask for index, mask in track.masks.items()},
        confidence={index + _SECOND: value for index, value in track.confidence.items()},
        motions=tuple(_moved_motion(motion, new_from_old) for motion in track.motions),
        front=None if front is None else replace(front, world_from_front=new_from_old @ front.world_from_front),
        box=None if box is None else replace(box, world_from_object=new_from_old @ box.world_from_object),
    )


def _moved_motion(motion: JointMotion, new_from_old: Rigid3) -> JointMotion:
    assert motion.axis_world is not None
    assert motion.pivot_world is not None
    return replace(
        motion,
        axis_world=new_from_old.turn(motion.axis_world),
        pivot_world=new_from_old.apply(motion.pivot_world),
        covariance=None,
        states={index + _SECOND: state for index, state in motion.states.items()},
    )


def _moved_wall(wall: Wall, new_from_old: Rigid3) -> Wall:
    normal = new_from_old.rotation @ wall.normal
    return replace(wall, normal=normal, offset_m=wall.offset_m + float(normal @ new_from_old.translation))


def _together(first: SceneSurface, second: SceneSurface) -> SceneSurface:
    return SceneSurface(
        vertices_world=np.concatenate([first.vertices_world, second.vertices_world]),
        faces=np.concatenate([first.faces, second.faces + len(first.vertices_world)]),
        colours=np.concatenate([first.colours, second.colours]),
        voxel_m=first.voxel_m,
    )


if __name__ == "__main__":
    sys.exit(main())
