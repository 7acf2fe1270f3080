"""Surfaces of a front: a slab or a frame with its filling, and the handle."""

import numpy as np

from r2c2r_core.synthetic.kitchen import Frame, Handle, Leaf, Paint
from r2c2r_core.synthetic.patches import Patch, Vector, box, tube

_PANEL_M, _PANE_M = 0.006, 0.004
_OPEN_SIDES = "front left right top bottom"
_CUP_STEPS = 9
_CLEAR = Paint(kind="glass", colour=(0.75, 0.80, 0.78), gloss=0.95, texel_m=0.02)
_EDGE = Paint(kind="laminate", colour=(0.06, 0.06, 0.06), gloss=0.3, texel_m=0.002)
_FROSTED = Paint(kind="laminate", colour=(0.62, 0.68, 0.67), gloss=0.35, texel_m=0.002)


def leaf_patches(leaf: Leaf, face_y: float, thickness: float, paint: Paint, metal: Paint, object_id: int) -> list[Patch]:
    """A front and its handle; `face_y` is the outer face, in the frame of the run."""
    front = _slab(leaf, face_y, thickness, paint if leaf.look is None else {"front": leaf.look, "": _EDGE}, object_id)
    if leaf.frame is not None:
        front = _framed(leaf, leaf.frame, face_y, thickness, paint, object_id)
    if leaf.handle is None:
        return front
    return front + handle_patches(leaf.handle, np.array([leaf.x, face_y, leaf.z]), metal, object_id)


def _slab(leaf: Leaf, face_y: float, thickness: float, paint: Paint | dict[str, Paint], object_id: int) -> list[Patch]:
    low, high = (leaf.x, face_y, leaf.z), (leaf.x + leaf.width_m, face_y + thickness, leaf.z + leaf.height_m)
    return box(low, high, paint, faces=_OPEN_SIDES, object_id=object_id)


def _framed(leaf: Leaf, frame: Frame, face_y: float, thickness: float, paint: Paint, object_id: int) -> list[Patch]:
    """Two stiles, two rails between them, and their filling."""
    x0, x1, z0, z1 = leaf.x, leaf.x + leaf.width_m, leaf.z, leaf.z + leaf.height_m
    rail = frame.rail_m
    patches = []
    for low, high in (
        ((x0, z0), (x0 + rail, z1)),
        ((x1 - rail, z0), (x1, z1)),
        ((x0 + rail, z1 - rail), (x1 - rail, z1)),
        ((x0 + rail, z0), (x1 - rail, z0 + rail)),
    ):
        patches += box(
            (low[0], face_y, low[1]),
            (high[0], face_y + thickness, high[1]),
            paint,
            faces=_OPEN_SIDES,
            object_id=object_id,
        )
    y = face_y + frame.recess_m
    depth, filling = {
        "panel": (_PANEL_M, paint),
        "glass": (_PANE_M, _CLEAR),
        "frosted": (_PANE_M, _FROSTED),
    }[frame.filling]
    inner_low, inner_high = (x0 + rail, y, z0 + rail), (x1 - rail, y + depth, z1 - rail)
    return patches + box(inner_low, inner_high, filling, faces="front", object_id=object_id)


def handle_patches(handle: Handle, corner: np.ndarray, paint: Paint, object_id: int) -> list[Patch]:
    """A handle as real geometry; `corner` is the front's lower left corner on its outer face (facing -Y)."""
    along = np.array([0.0, 0.0, 1.0]) if handle.vertical else np.array([1.0, 0.0, 0.0])
    out = np.array([0.0, -1.0, 0.0])
    centre = corner + np.array([handle.x, 0.0, handle.z])
    half, radius = handle.length_m / 2, handle.thickness_m / 2
    share = {"object_id": object_id, "is_handle": True}
    if handle.kind == "finger":
        side = along * half + (1 - along) * radius * [1.0, 0.0, 1.0]
        dark = Paint(kind="laminate", colour=(0.10, 0.10, 0.10), gloss=0.4, texel_m=0.002)
        return box(_triple(centre - side + out * handle.reach_m), _triple(centre + side), dark, lumel_m=0.01, **share)  # type: ignore[arg-type]
    if handle.kind == "cup":
        return _cup(handle, centre, paint, object_id)
    if handle.kind == "knob":
        stem = np.array([centre + out * 0.0, centre + out * (handle.reach_m - 0.012)])
        head = np.array([centre + out * (handle.reach_m - 0.012), centre + out * handle.reach_m])
        return [tube(stem, 0.007, paint, **share), tube(head, radius, paint, **share)]  # type: ignore[arg-type]
    axis = centre + out * (handle.reach_m - radius)
    if handle.kind == "bow":
        turn = np.linspace(0, np.pi, 15)[:, None]
        curve = centre - along * half * np.cos(turn) + out * (handle.reach_m - radius) * np.sin(turn) ** 0.6
        return [tube(curve, radius, paint, **share)]  # type: ignore[arg-type]
    posts = [
        tube(np.array([foot, foot + out * (handle.reach_m - radius)]), radius * 0.7, paint, **share)  # type: ignore[arg-type]
        for foot in (centre - along * (half - 0.02), centre + along * (half - 0.02))
    ]
    if handle.kind == "bar":
        rod = tube(np.linspace(axis - along * half, axis + along * half, 5), radius, paint, **share)  # type: ignore[arg-type]
        return [*posts, rod]
    spread = along * half + np.array([1.0, 0.0, 1.0]) * (1 - np.abs(along)) * radius
    low, high = axis - spread - np.array([0, 0.004, 0]), axis + spread + np.array([0, 0.004, 0])
    bar = box(_triple(low), _triple(high), paint, object_id=object_id, is_handle=True, lumel_m=0.01)
    return [*posts, *bar]


def _cup(handle: Handle, centre: np.ndarray, paint: Paint, object_id: int) -> list[Patch]:
    """A shell open below: a quarter of an ellipsoid, `thickness_m` high, its mouth closed by a dark patch as its shadow."""
    half, reach, height = handle.length_m / 2, handle.reach_m, handle.thickness_m
    rise, turn = np.linspace(np.pi / 2, 0.0, _CUP_STEPS)[:, None], np.linspace(np.pi, 0.0, 2 * _CUP_STEPS)[None, :]
    shell = np.stack(
        [
            half * np.cos(rise) * np.cos(turn),
            -reach * np.cos(rise) * np.sin(turn),
            height * np.sin(rise) * np.ones_like(turn) - height / 2,
        ],
        axis=-1,
    )
    size = (np.pi * half, height + reach)
    bowl = Patch(grid=shell + centre, size_m=size, paint=paint, object_id=object_id, is_handle=True, lumel_m=0.01)
    dark = Paint(kind="plain", colour=(0.03, 0.03, 0.03), texel_m=0.004)
    lip = shell[-1:] + centre
    middle = np.broadcast_to(centre - [0.0, 0.0, height / 2], lip.shape)
    mouth = Patch(grid=np.vstack([lip, middle]), size_m=(2 * half, reach), paint=dark, object_id=object_id, is_handle=True)
    return [bowl, mouth]


def _triple(values: np.ndarray) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))
