"""Comparison of an object's candidates: turntables, surface differences, and their input crops."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from app import schemas
from app.db import queries
from app.db.engine import reading
from app.drawing import turntable
from app.errors import NotReady
from app.files import ProjectFiles, inside
from app.services import views
from app.services.candidates import candidate_mesh, generate_key
from app.services.context import Context
from app.services.media import kept_file
from app.services.meshes import upright
from r2c2r_core.arrays import Mask, Points, Vector3
from r2c2r_core.model.track import MaskTrack

OFF = 0.012  # distance, as a fraction of the longest side, above which surfaces differ
_SAMPLES = 60_000  # surface points, with a spacing below `OFF`
_FRONT = [0, 2]  # axes of the filmed side
_FACES_AHEAD = 0.9  # minimum normal component towards the front
_LEAST_FRONT = 0.02  # minimum fraction of surface facing the front: round objects have hardly any


def differences(context: Context, project_id: str, object_id: int, against: str) -> schemas.Differences:
    """Differences of all candidates from one of them, and the frames from which they were made."""
    files, name = _files_of(context, project_id, object_id)
    made, track = views.latest(files, "generate", name), views.latest(files, "segment", name)
    if made is None:
        raise NotReady(f"{name} has no candidates yet", hint="run the project first")
    model = _Model(files, name, against)
    frames = sorted({frame for asset in made.candidates for frame in asset.frames})
    return schemas.Differences(
        against=against,
        tolerance=OFF,
        longest_m=_longest_m(files, name),
        candidates=[model.difference(asset.candidate_id) for asset in made.candidates if asset.candidate_id != against],
        crops=[crop for frame in frames if track is not None and (crop := _crop(files, track, frame)) is not None],
    )


def strip(context: Context, project_id: str, object_id: int, candidate: str, against: str) -> Path:
    """Turntable of a candidate, with differences from `against` coloured, unless that is empty."""
    files, name = _files_of(context, project_id, object_id)
    stem = f"{candidate}-{against}-turns-{generate_key(files, name)}"
    return kept_file(
        files,
        inside(files.previews, "candidates", str(object_id), f"{stem}.png"),
        lambda: _strip(files, name, candidate, against),
    )


def _strip(files: ProjectFiles, name: str, candidate: str, against: str) -> bytes:
    marked = _Model(files, name, against).marker(candidate) if against not in ("", candidate) else None
    return turntable(candidate_mesh(files, name, candidate).mesh, upright(files, name, candidate), marked)


class _Upright(NamedTuple):
    """A candidate that stands upright, with its front at -Y."""

    surface: Points
    low: Vector3  # of its box; y: at most of its front, ignoring protrusions
    high: Vector3


class _Model:
    """The reference candidate, to which others are aligned by the filmed side, as they differ behind it."""

    def __init__(self, files: ProjectFiles, name: str, candidate: str) -> None:
        self._files, self._name = files, name
        self._shape = self._stood(candidate)
        self._longest = float((self._shape.high - self._shape.low).max())
        self._tree = cKDTree(self._shape.surface)

    def difference(self, candidate: str) -> schemas.Difference:
        """Difference of a candidate from the reference."""
        shape = self._stood(candidate)
        laid = self._laid(shape.surface, shape)
        there, back = self._tree.query(laid)[0], cKDTree(laid).query(self._shape.surface)[0]
        return schemas.Difference(
            candidate=candidate,
            share=float((there > OFF * self._longest).mean()),
            most=float(max(there.max(), back.max())) / self._longest,
        )

    def marker(self, candidate: str) -> Callable[[Points], Mask]:
        """Predicate on a candidate's upright points that differ from the reference."""
        shape = self._stood(candidate)

        def off(places: Points) -> Mask:
            return np.asarray(self._tree.query(self._laid(places, shape))[0] > OFF * self._longest)

        return off

    def _laid(self, places: Points, shape: _Upright) -> Points:
        size, model_size = (np.maximum(one.high - one.low, 1e-9) for one in (shape, self._shape))
        scale = float(np.sqrt(np.prod(model_size[_FRONT]) / np.prod(size[_FRONT])))
        onto = (self._shape.low + self._shape.high) / 2 - scale * (shape.low + shape.high) / 2
        onto[1] = self._shape.low[1] - scale * shape.low[1]
        return np.asarray(scale * places + onto)

    def _stood(self, candidate: str) -> _Upright:
        import trimesh

        mesh = candidate_mesh(self._files, self._name, candidate).mesh
        points = mesh.vertices @ upright(self._files, self._name, candidate).T
        shape = trimesh.Trimesh(points, mesh.faces, process=False)
        surface, faces = trimesh.sample.sample_surface(shape, _SAMPLES, seed=0)
        low, high = points.min(axis=0), points.max(axis=0)
        ahead = shape.face_normals[faces][:, 1] < -_FACES_AHEAD
        if ahead.mean() > _LEAST_FRONT:
            low[1] = np.median(surface[ahead, 1])
        return _Upright(np.asarray(surface), low, high)


def _longest_m(files: ProjectFiles, name: str) -> float | None:
    """Longest side of the placed candidate in metres; None before placement."""
    placement = views.latest(files, "align", name)
    if placement is None:
        return None
    points = candidate_mesh(files, name, placement.candidate_id).mesh.vertices @ upright(files, name, placement.candidate_id).T
    return float(placement.world_from_mesh.scale * np.ptp(points, axis=0).max())


def _crop(files: ProjectFiles, track: MaskTrack, index: int) -> schemas.Crop | None:
    """Crop of the object in a frame; None without a mask there."""
    mask, frame = track.masks.get(index), views.frame_of(files, index)
    if mask is None or frame is None or not mask.area_px:
        return None
    across, down = mask.width, mask.height
    right, bottom = mask.left + mask.box_width, mask.top + mask.box_height
    camera = frame.rgb_camera
    box = [mask.left / across, mask.top / down, right / across, bottom / down]
    return schemas.Crop(frame=index, width=camera.width, height=camera.height, box=box)


def _files_of(context: Context, project_id: str, object_id: int) -> tuple[ProjectFiles, str]:
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        return context.files(project), queries.object_row(session, project_id, object_id).result_name
