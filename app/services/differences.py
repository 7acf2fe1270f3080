"""What tells an object's candidates apart: each from all sides, where it lies off another, the crops they were made from."""

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

OFF = 0.012  # of the longest side: what lies further off than that differs
_SAMPLES = 60_000  # points of a surface: less than `OFF` apart
_FRONT = [0, 2]  # axes of the side that was filmed
_FACES_AHEAD = 0.9  # of a normal's length to the front
_LEAST_FRONT = 0.02  # of the surface: what is round has hardly any front


def differences(context: Context, project_id: str, object_id: int, against: str) -> schemas.Differences:
    """By how much every candidate lies off one of them, and the frames that any of them was made from."""
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
    """A candidate from all sides, one beside the other; in another colour what lies off `against`, unless that is empty."""
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
    low: Vector3  # of its box; y: where most of its front is, whatever stands out of it
    high: Vector3


class _Model:
    """The candidate that others are laid onto, by the side that was filmed: behind it they differ."""

    def __init__(self, files: ProjectFiles, name: str, candidate: str) -> None:
        self._files, self._name = files, name
        self._shape = self._stood(candidate)
        self._longest = float((self._shape.high - self._shape.low).max())
        self._tree = cKDTree(self._shape.surface)

    def difference(self, candidate: str) -> schemas.Difference:
        """How far that candidate lies off."""
        shape = self._stood(candidate)
        laid = self._laid(shape.surface, shape)
        there, back = self._tree.query(laid)[0], cKDTree(laid).query(self._shape.surface)[0]
        return schemas.Difference(
            candidate=candidate,
            share=float((there > OFF * self._longest).mean()),
            most=float(max(there.max(), back.max())) / self._longest,
        )

    def marker(self, candidate: str) -> Callable[[Points], Mask]:
        """Tells of points of that candidate, upright, which lie off."""
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
    """The longest side of the placed candidate, as large as it was found; None before it was placed."""
    placement = views.latest(files, "align", name)
    if placement is None:
        return None
    points = candidate_mesh(files, name, placement.candidate_id).mesh.vertices @ upright(files, name, placement.candidate_id).T
    return float(placement.world_from_mesh.scale * np.ptp(points, axis=0).max())


def _crop(files: ProjectFiles, track: MaskTrack, index: int) -> schemas.Crop | None:
    """Where the object is in a frame; None where it has no mask there."""
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
