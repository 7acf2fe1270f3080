"""Hypothesis tests for common reading errors: pose conventions, image rotation, frame shift, scale, focal length."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from typing import Literal, NamedTuple

import numpy as np

from r2c2r_core.geometry.transforms import CAMERA_CV_FROM_GL, rotation_about_z
from r2c2r_core.ingest.doctor.pairs import Centres, Disagreement, Pairs, Rotations, Views, compare
from r2c2r_core.ingest.doctor.unit import UNITS
from r2c2r_core.tuning import param, tuned

Cause = Literal[
    "poses_inverted",
    "camera_axes",
    "poses_mirrored",
    "rotation_transposed",
    "quaternion_order",
    "image_rotated",
    "frames_shifted",
    "depth_scale",
    "focal_length",
    "ray_distance",
]
Poses = tuple[Rotations, Centres]

_UNITS = {f: UNITS[f] for f in (0.1, 0.2, 5.0)} | {10.0: "1/1000 m read as 1/10000 m"}
_SCALES = np.geomspace(0.8, 1.25, 23)


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the hypothesis tests."""

    gain: float = param(0.1, "share", "Minimum increase of the fraction of agreeing points for a convention to be called wrong")
    gain_ratio: float = param(
        1.25,
        "ratio",
        "Minimum ratio of the agreement under another convention to the given one",
        source="frames that barely move agree under any",
    )
    least_log: float = param(
        0.04, "log", "Minimum log factor between the best and the given scale or focal length to call it wrong"
    )
    least_pairs: int = param(4, "count", "Minimum number of wide-baseline pairs for a scale test", ge=1)
    cost: float = param(0.85, "ratio", "Maximum ratio of the disagreement under another scale to the given one")
    better: float = param(
        0.7,
        "share",
        "Minimum fraction of pairs that another scale must improve",
        source="wrong calibration hurts nearly all, chance some",
    )
    alike: float = param(1.05, "ratio", "Ratio to the least disagreement below which another hypothesis is also named")


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """An alternative interpretation of the recording that fits better than the given one."""

    cause: Cause
    text: str  # what is wrong, for a person
    factor: float | None  # by which depth or focal length should be multiplied
    agreement_given: float  # share of points on which pairs of frames agree, as the recording was read
    agreement_so: float  # and with this change
    error_given_mm: float | None  # median disagreement, the same two ways
    error_so_mm: float | None


class _Change(NamedTuple):
    cause: Cause
    text: str
    poses: Callable[[Poses], Poses]


def find_convention(views: Views, pairs: Pairs, shifted: Sequence[tuple[int, Poses]]) -> tuple[Finding | None, Views]:
    """The wrong convention that explains the disagreement of neighbouring frames, and the views corrected for it.

    The views' poses are in the recording's own world: levelled ones no longer contain the original quaternions.
    `shifted`: poses of the frames so many places later, to detect images paired with another frame's pose.
    """
    if not len(pairs):
        return None, views
    given, params = compare(views, pairs), tuned(Params)
    change, changed, so = _best(_conventions(shifted), views, pairs)
    if not _is_usable(given):  # then two of them may be wrong at once
        two, mended, better = _best(_combinations(), views, pairs)
        if not _is_usable(so) or better.agreement.mean() > params.gain_ratio * so.agreement.mean():
            change, changed, so = two, mended, better
    agreement, before = so.agreement.mean(), given.agreement.mean()
    if agreement < before + params.gain or agreement < params.gain_ratio * before or not _is_usable(so):
        return None, views
    return _finding(change.cause, change.text, None, given, so), changed


def find_scale(views: Views, pairs: Pairs) -> Finding | None:
    """The best of these hypotheses: wrong depth unit, depth scale off by some percent, wrong focal length, depth along the ray.

    Needs wide-baseline pairs: without parallax, depth of any scale is consistent.
    """
    params = tuned(Params)
    if len(pairs) < params.least_pairs:
        return None
    given = compare(views, pairs)
    tries = _tries(views, pairs)
    best = min(tries, key=lambda t: t.cost.mean())
    better = best.cost < given.cost
    if best.cost.mean() > params.cost * given.cost.mean() or better.mean() < params.better:
        return None
    if best.factor is not None and abs(np.log(best.factor)) < params.least_log:
        return None
    so = compare(views, pairs, **best.change)
    if not _is_usable(so):
        return None
    # A short path hardly separates a scale from a focal length: then both are named
    alike = [t.text for t in tries if t.cause != best.cause and t.cost.mean() < params.alike * best.cost.mean()]
    return _finding(best.cause, " or ".join((best.text, *alike)), best.factor, given, so)


def _finding(cause: Cause, text: str, factor: float | None, given: Disagreement, so: Disagreement) -> Finding:
    return Finding(
        cause=cause,
        text=text,
        factor=factor,
        agreement_given=float(given.agreement.mean()),
        agreement_so=float(so.agreement.mean()),
        error_given_mm=_millimetres(given.error_m),
        error_so_mm=_millimetres(so.error_m),
    )


def _is_usable(so: Disagreement) -> bool:
    """Whether frames agree on most of what both see: a change that leaves them apart is not the cause."""
    return bool(2 * so.agrees.sum() > so.comparable.sum() > 0)


class _Try(NamedTuple):
    cause: Cause
    text: str
    factor: float | None
    change: dict
    cost: np.ndarray


def _best(changes: list[_Change], views: Views, pairs: Pairs) -> tuple[_Change, Views, Disagreement]:
    """The change under which neighbours agree most, and the views under it."""
    posed = [(change, views.posed(*change.poses((views.rotation, views.translation)))) for change in changes]
    change, changed = max(posed, key=lambda one: compare(one[1], pairs).agreement.mean())
    return change, changed, compare(changed, pairs)


def _combinations() -> list[_Change]:
    """Two wrong conventions at once, undone in either order."""
    stored, of_axes = [_stored(axes) for axes in _READER_AXES], _of_axes()
    both = [two for alike in stored for two in permutations([*alike, *of_axes], 2) if two[0].cause != two[1].cause]
    return [_Change(a.cause, f"{a.text}, and {b.text}", partial(_undone, a, b)) for a, b in both]


def _undone(first: _Change, then: _Change, poses: Poses) -> Poses:
    return then.poses(first.poses(poses))


def _stored(axes: np.ndarray) -> list[_Change]:
    """Changes of the poses as stored in the file, if ingest multiplied its rotations by `axes`."""
    return [
        _Change("poses_inverted", _INVERTED, _in_file(_inverted, axes)),
        _Change("rotation_transposed", "the rotations of the poses are transposed", _in_file(_transposed, axes)),
        *(_Change("quaternion_order", _ORDER, _in_file(_reordered(order), axes)) for order in _ORDERS),
    ]


def _of_axes() -> list[_Change]:
    flips = (CAMERA_CV_FROM_GL, np.diag([-1.0, 1.0, -1.0]))  # the second: of images that stood upside down and were turned
    return [
        *(_Change("camera_axes", _FLIPPED, _turned(axes)) for axes in flips),
        *(_Change("poses_mirrored", _MIRRORED, _mirrored(np.diag(1.0 - 2.0 * axis))) for axis in np.eye(3)),
    ]


def _conventions(shifted: Sequence[tuple[int, Poses]]) -> list[_Change]:
    changes = [*(change for axes in _READER_AXES for change in _stored(axes)), *_of_axes()]
    for quarters in (1, 2, 3):
        text = f"the images are rotated by {90 * quarters}° relative to their poses"
        changes.append(_Change("image_rotated", text, _turned(rotation_about_z(quarters * np.pi / 2))))
    for places, poses in shifted:
        text = f"the images belong to the poses of the frames {abs(places)} {'later' if places > 0 else 'earlier'}"
        changes.append(_Change("frames_shifted", text, _replaced(poses)))
    return changes


_INVERTED = "the poses are inverted (world to camera where camera to world is expected)"
_FLIPPED = "the camera axes are flipped (OpenGL taken for OpenCV, or the reverse)"
_MIRRORED = "the poses are mirrored (of a left-handed world, such as a renderer's)"
_ORDER = "the quaternions are read in the wrong order"
_ORDERS = ((1, 2, 3, 0), (3, 0, 1, 2))  # w first for w last, and the reverse
# What ingest multiplied the file's rotations by: the format's own flip of axes, and a turn that set the images upright
_READER_AXES = tuple(
    flip @ rotation_about_z(quarters * np.pi / 2) for quarters in range(4) for flip in (np.eye(3), CAMERA_CV_FROM_GL)
)


def _in_file(change: Callable[[Poses], Poses], axes: np.ndarray) -> Callable[[Poses], Poses]:
    """The change applied to poses as stored in the file, if ingest multiplied its rotations by `axes`."""

    def changed(poses: Poses) -> Poses:
        rotation, translation = change((poses[0] @ axes.T, poses[1]))
        return rotation @ axes, translation

    return changed


def _turned(camera_from_camera: np.ndarray) -> Callable[[Poses], Poses]:
    return lambda poses: (poses[0] @ camera_from_camera, poses[1])


def _replaced(by: Poses) -> Callable[[Poses], Poses]:
    return lambda _: by


def _inverted(poses: Poses) -> Poses:
    rotation = np.ascontiguousarray(np.swapaxes(poses[0], 1, 2))
    return rotation, -np.einsum("vij,vj->vi", rotation, poses[1])


def _transposed(poses: Poses) -> Poses:
    return np.ascontiguousarray(np.swapaxes(poses[0], 1, 2)), poses[1]


def _mirrored(mirror: np.ndarray) -> Callable[[Poses], Poses]:
    """Poses reflected along an axis; which axis of the world it is does not matter to frames, that of their camera does."""
    return lambda poses: (mirror @ poses[0] @ mirror, poses[1] @ mirror)


def _reordered(order: tuple[int, ...]) -> Callable[[Poses], Poses]:
    def change(poses: Poses) -> Poses:
        from scipy.spatial.transform import Rotation

        read = Rotation.from_matrix(poses[0]).as_quat()
        return Rotation.from_quat(read[:, order]).as_matrix(), poses[1]

    return change


def _tries(views: Views, pairs: Pairs) -> list[_Try]:
    scale, focal = (_best_factor(views, pairs, name) for name in ("depth_scale", "focal_scale"))
    along = "the depth is measured along the ray, not along the camera's axis"
    changes: list[tuple[Cause, str, float | None, dict]] = [
        *(("depth_scale", f"the depth has the wrong unit ({text})", f, {"depth_scale": f}) for f, text in _UNITS.items()),
        ("depth_scale", f"the depth is {_percent_off(scale)}", scale, {"depth_scale": scale}),
        ("focal_length", f"the focal length is {_percent_off(focal)}", focal, {"focal_scale": focal}),
        ("ray_distance", along, None, {"along_ray": True}),
    ]
    return [_Try(*change, compare(views, pairs, **change[-1]).cost) for change in changes]


def _best_factor(views: Views, pairs: Pairs, name: str) -> float:
    """The factor with the least cost: a grid scan, then the vertex of the parabola through the minimum and its neighbours."""
    costs = [float(compare(views, pairs, **{name: f}).cost.mean()) for f in _SCALES]
    k = int(np.clip(np.argmin(costs), 1, len(costs) - 2))
    left, middle, right = costs[k - 1 : k + 2]
    bend = left - 2 * middle + right
    shift = float(np.clip(0.5 * (left - right) / bend, -1.0, 1.0)) if bend > 1e-12 else 0.0
    return float(_SCALES[k] * (_SCALES[k + 1] / _SCALES[k]) ** shift)


def _percent_off(factor: float) -> str:
    """Deviation in percent, as text, of a value that must be multiplied by `factor`."""
    percent = 100.0 * (1.0 / factor - 1.0)
    return f"{abs(percent):.0f} % too {'large' if percent > 0 else 'small'}"


def _millimetres(errors_m: np.ndarray) -> float | None:
    known = errors_m[np.isfinite(errors_m)]
    return float(1000 * np.median(known)) if len(known) else None
