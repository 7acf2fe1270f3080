"""Surface patches of the kitchen: grids of quads, each with its own piece of texture."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.synthetic.kitchen import Paint

LONGEST_EDGE_M = 0.28  # the rasteriser drops triangles that cross the near plane: they must be small


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patch:
    """A grid of vertices (rows, columns, 3), kitchen frame; row 0 is the texture's top, seen from outside."""

    grid: np.ndarray
    size_m: tuple[float, float]  # width, height of the texture on the surface
    paint: Paint
    object_id: int = 0  # 0: background
    is_handle: bool = False
    lumel_m: float = 0.025  # spacing of the baked light
    mover: str = ""  # the joint that it moves with; "": static
    is_body: bool = False  # moving part other than the front itself: the drawer behind it
    is_inner: bool = False  # part of a compartment: visible when its front is open


Vector = tuple[float, float, float]


def quad(
    top_left: np.ndarray,
    right: np.ndarray,
    down: np.ndarray,
    paint: Paint,
    *,
    object_id: int = 0,
    is_handle: bool = False,
    lumel_m: float = 0.025,
) -> Patch:
    """A flat rectangle, split into cells no longer than LONGEST_EDGE_M; its outside faces down x right."""
    width, height = float(np.linalg.norm(right)), float(np.linalg.norm(down))
    columns = np.linspace(0, 1, int(np.ceil(width / LONGEST_EDGE_M)) + 1)
    rows = np.linspace(0, 1, int(np.ceil(height / LONGEST_EDGE_M)) + 1)
    grid = top_left + columns[None, :, None] * right + rows[:, None, None] * down
    return Patch(grid=grid, size_m=(width, height), paint=paint, object_id=object_id, is_handle=is_handle, lumel_m=lumel_m)


def box(
    low: Vector,
    high: Vector,
    paint: Paint | dict[str, Paint],
    *,
    faces: str = "front back left right top bottom",
    object_id: int = 0,
    is_handle: bool = False,
    lumel_m: float = 0.025,
) -> list[Patch]:
    """The named faces of an axis-aligned box; `paint` may differ by face, "" being the rest."""
    x0, y0, z0 = low
    x1, y1, z1 = high
    dx, dy, dz = np.array([x1 - x0, 0, 0]), np.array([0, y1 - y0, 0]), np.array([0, 0, z1 - z0])
    corners = {
        "front": (np.array([x0, y0, z1]), dx, -dz),
        "back": (np.array([x1, y1, z1]), -dx, -dz),
        "left": (np.array([x0, y1, z1]), -dy, -dz),
        "right": (np.array([x1, y0, z1]), dy, -dz),
        "top": (np.array([x0, y1, z1]), dx, -dy),
        "bottom": (np.array([x0, y0, z0]), dx, dy),
    }
    patches = []
    for face in faces.split():
        look = (
            paint if isinstance(paint, Paint) else paint.get(face, paint.get("", Paint(kind="plain", colour=(0.5, 0.5, 0.5))))
        )
        patches.append(quad(*corners[face], look, object_id=object_id, is_handle=is_handle, lumel_m=lumel_m))
    return patches


def inner_walls(low: Vector, high: Vector, paint: Paint, object_id: int = 0) -> list[Patch]:
    """Walls of a box open at the front, seen from within."""
    return box(high, low, paint, faces="front left right top bottom", object_id=object_id)  # corners swapped: facing inwards


def lathe(centre: Vector, profile: list[tuple[float, float]], paint: Paint, *, object_id: int = 0, sides: int = 28) -> Patch:
    """A surface of revolution about the vertical through `centre`; profile of (radius, z) from top to bottom."""
    radius, z = np.array(profile).T
    # The seam lies at the back (+Y); the texture runs left to right as seen from outside.
    angle = np.linspace(np.pi / 2, np.pi / 2 + 2 * np.pi, sides + 1)
    grid = np.stack(
        [
            centre[0] + radius[:, None] * np.cos(angle)[None, :],
            centre[1] + radius[:, None] * np.sin(angle)[None, :],
            np.broadcast_to(centre[2] + z[:, None], (len(z), sides + 1)),
        ],
        axis=-1,
    )
    length = float(np.linalg.norm(np.diff(np.column_stack([radius, z]), axis=0), axis=1).sum())
    return Patch(grid=grid, size_m=(2 * np.pi * float(radius.max()), length), paint=paint, object_id=object_id)


def tube(
    points: np.ndarray, radius_m: float, paint: Paint, *, object_id: int = 0, is_handle: bool = False, sides: int = 12
) -> Patch:
    """A round rod along a polyline (n, 3) that lies in one plane; its ends are closed."""
    tangent = np.gradient(points, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    first, last = points[0] - 1e-4 * tangent[0], points[-1] + 1e-4 * tangent[-1]
    line = np.vstack([first, points, last])
    tangent = np.vstack([tangent[:1], tangent, tangent[-1:]])
    radii = np.full(len(line), radius_m)
    radii[[0, -1]] = 0.0
    chord = points[-1] - points[0]
    bulge = points[len(points) // 2] - (points[0] + points[-1]) / 2
    normal = np.cross(chord, bulge)
    if np.linalg.norm(normal) < 1e-9:  # a straight rod
        normal = np.cross(chord, _any_other(chord))
    normal /= np.linalg.norm(normal)
    side = np.cross(normal[None, :], tangent)
    angle = np.linspace(0, -2 * np.pi, sides + 1)
    ring = np.cos(angle)[None, :, None] * side[:, None, :] + np.sin(angle)[None, :, None] * normal
    grid = line[:, None, :] + radii[:, None, None] * ring
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    return Patch(
        grid=grid, size_m=(2 * np.pi * radius_m, length), paint=paint, object_id=object_id, is_handle=is_handle, lumel_m=0.01
    )


def turned(patches: list[Patch], yaw_rad: float, centre: tuple[float, float]) -> list[Patch]:
    """The patches rotated about the vertical through `centre`."""
    if yaw_rad == 0.0:
        return patches
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    pivot = np.array([*centre, 0.0])
    return [replace(p, grid=(p.grid - pivot) @ rotation.T + pivot) for p in patches]


def moving(patches: list[Patch], mover: str, *, is_body: bool = False) -> list[Patch]:
    """The patches assigned to a joint that moves them."""
    return [replace(p, mover=mover, is_body=is_body) for p in patches]


def shifted(patches: list[Patch], by: np.ndarray) -> list[Patch]:
    """The patches translated by a vector."""
    return [replace(p, grid=p.grid + by) for p in patches]


def _any_other(direction: np.ndarray) -> np.ndarray:
    return np.asarray(np.eye(3)[np.argmin(np.abs(direction))])
