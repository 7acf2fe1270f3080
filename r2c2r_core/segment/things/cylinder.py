"""Cylinder fitted to silhouettes: for small upright objects whose frame poses disagree too much to carve a hull."""

from dataclasses import dataclass, replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.model.capture import Frame
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.silhouettes import colours_of, crop_outline
from r2c2r_core.segment.things.thing import Thing, ThingConfig
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the cylinder fit."""

    wanders_m: float = param(
        0.05,
        "m",
        "Pose error of a small object between frames",
        source="seen between frames of recordings whose poses disagree",
    )
    width: float = param(1.2, "ratio", "Initial width relative to the object's radius, where its category gives no width")
    height: float = param(1.5, "ratio", "Minimum initial height relative to the object's radius")
    clicked_at: float = param(
        0.45, "ratio", "Distance of the object's centre behind a click, relative to its width: clicks hit the near side"
    )
    growth: tuple[float, float] = param(
        (0.6, 1.5), "ratio", "Minimum and maximum factor by which silhouettes may change its size in one round"
    )
    rounds: int = param(2, "count", "Number of rounds of size correction by silhouettes", ge=1)
    drawn_m: tuple[float, float] = param(
        (0.012, 0.015), "m", "Tolerance of the outline while colours are learned, and while silhouettes are extracted"
    )
    border_m: float = param(0.010, "m", "Tolerance of the final outline")
    shown: float = param(0.9, "share", "Minimum unoccluded fraction of the object for a silhouette to measure its size")


def upright_shape(
    scene: Scene, positives: Points, views: list[Frame], config: ThingConfig, support: float | None
) -> Thing | None:
    """Cylinder of the usual size at the click, refined to the size of its silhouettes; masks are found frame by frame."""
    params = tuned(Params)
    base = support if support is not None else float(positives[:, 2].min()) - 0.5 * config.radius_m
    width = config.width_m or params.width * config.radius_m
    height = max(params.height * config.radius_m, float(positives[:, 2].max()) - base + 0.01)
    nearest = min(views, key=lambda frame: float(np.linalg.norm(frame.world_from_camera.translation - positives[0])))
    away = (positives.mean(axis=0) - nearest.world_from_camera.translation) * [1, 1, 0]
    centre = positives.mean(axis=0) + params.clicked_at * width * away / max(float(np.linalg.norm(away)), 1e-6)
    thing = _cylinder(centre, base, width, height, support)
    for _ in range(params.rounds):
        outlines = [outline for frame in views if (outline := _outline(thing, scene, frame)) is not None]
        if not outlines:
            break
        across, tall, east, north = (float(value) for value in np.median(np.array(outlines), axis=0))
        low, high = params.growth
        width = float(np.clip(across, low * width, high * width))
        height = float(np.clip(tall, low * height, high * height))
        centre = centre + np.array([east, north, 0.0])  # the click was off its centre
        thing = _cylinder(centre, base, width, height, support)
        thing = replace(thing, colours=colours_of(thing, scene, views, params.drawn_m[0]))
    return thing


def _cylinder(centre: Vector3, base: float, width: float, height: float, support: float | None) -> Thing:
    spacing = 0.004
    levels, angles = max(2, round(height / spacing)), max(12, round(np.pi * width / spacing))
    rings = max(1, round(width / 2 / spacing))
    side = [(width / 2, angle, z) for z in np.linspace(0, height, levels) for angle in np.arange(angles) / angles * 2 * np.pi]
    lids = [
        (radius, angle, z)
        for z in (0.0, height)
        for radius in np.linspace(0, width / 2, rings, endpoint=False)
        for angle in np.arange(angles) / angles * 2 * np.pi
    ]
    polar = np.array(side + lids)
    vertices = np.stack([polar[:, 0] * np.cos(polar[:, 1]), polar[:, 0] * np.sin(polar[:, 1]), polar[:, 2]], axis=1)
    placed = vertices + np.array([centre[0], centre[1], base])
    no_faces, params = np.zeros((0, 3), np.int64), tuned(Params)
    return Thing(placed, no_faces, support, spacing, pose_error_m=params.wanders_m, border_m=params.border_m)


def _outline(thing: Thing, scene: Scene, frame: Frame) -> tuple[float, float, float, float] | None:
    """Width, height and plan offset (world x, y) in metres that a frame's silhouette suggests for the drawn hull."""
    crop, mask, share = crop_outline(thing, scene, frame, tuned(Params).drawn_m[1])
    if crop is None or share < tuned(Params).shown or not mask.any():
        return None
    found, drawn = np.argwhere(mask), np.argwhere(crop.hull)
    if found.min() < 2 or (found.max(axis=0) > np.array(mask.shape) - 3).any():
        return None
    grown = found.std(axis=0) / np.maximum(drawn.std(axis=0), 1e-6)
    low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
    sideways = frame.world_from_camera.rotation[:, 0] * float(found[:, 1].mean() - drawn[:, 1].mean()) / crop.scale
    return float((high - low)[0] * grown[1]), float((high - low)[2] * grown[0]), float(sideways[0]), float(sideways[1])
