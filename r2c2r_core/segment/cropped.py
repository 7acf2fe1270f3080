"""Restriction of an object to a crop box drawn by a person, for any segmenter."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from r2c2r_core.arrays import DepthMetres, Mask, Matrix3, PointField, Points, Vector3
from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.geometry.camera import pixel_rays
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.category import Kind
from r2c2r_core.model.capture import Frame
from r2c2r_core.model.inputs import CropBox
from r2c2r_core.model.track import ThingBox
from r2c2r_core.segment.found import Found, View
from r2c2r_core.segment.scene import Scene
from r2c2r_core.segment.things.found import FoundCarried, FoundThing, Loose
from r2c2r_core.tuning import param, tuned


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the crop box."""

    slack_m: float = param(0.02, "m", "Maximum distance outside the box of depth that still counts as inside")
    least_points: int = param(20, "count", "Minimum number of an object's points in its box", ge=4)


@dataclass(frozen=True, slots=True, eq=False)
class Crop:
    """The box in the world; its own coordinates run from 0 to 1 along each edge."""

    corner: Vector3
    edges: Matrix3  # one per row

    @property
    def bottom_m(self) -> float:
        """Height of the lowest corner."""
        return float(self.corner[2] + np.minimum(self.edges[:, 2], 0.0).sum())

    def holds(self, points: Points) -> np.ndarray:
        """Mask of the points (n, 3) that lie in the box."""
        local = self._turned(points - self.corner)
        return np.asarray(((local >= 0) & (local <= 1)).all(axis=-1))

    def span(self, origin: Vector3, rays: PointField) -> tuple[np.ndarray, np.ndarray]:
        """Entry and exit of each ray, in ray lengths; a ray that misses the box exits before it enters."""
        start, way = self._turned(origin - self.corner), self._turned(rays)
        with np.errstate(divide="ignore", invalid="ignore"):
            low, high = -start / way, (1 - start) / way
        return np.fmin(low, high).max(axis=-1), np.fmax(low, high).min(axis=-1)

    def _turned(self, vectors: PointField) -> PointField:
        return np.asarray(vectors @ (self.edges / (self.edges**2).sum(axis=1, keepdims=True)).T)


def world_crop(crop: CropBox, world_from_capture: Rigid3) -> Crop:
    """Crop box in world coordinates."""
    corner = world_from_capture.apply(np.array([crop.corner_capture]))[0]
    return Crop(corner, world_from_capture.turn(np.array(crop.edges_capture)))


def cropped(found: Found, crop: Crop, scene: Scene, name: str) -> Found:
    """Part of an object that lies in the box; raises ObjectNotSeen where hardly any does."""
    if isinstance(found, FoundCarried):  # the box is where it is with its drawer closed, like the thing
        return replace(found, thing=cropped(found.thing, crop, found.scene, name))
    assert isinstance(found, FoundThing), found  # check_prompt refuses others
    within, least = crop.holds(found.thing.vertices), tuned(Params).least_points
    if within.sum() < least:
        raise ObjectNotSeen(
            f"{name}: {within.sum()} of its {len(within)} points lie in its crop box, at least {least} expected",
            hint="move the box over the object, or delete the box",
        )
    return FoundCropped(found, crop, scene)


def cropped_mask(mask: Mask, frame: Frame, depth: DepthMetres, crop: Crop) -> Mask:
    """Pixels of a mask whose rays meet the box, and whose depth, where known, lies in it."""
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return mask
    slack, camera = tuned(Params).slack_m, frame.rgb_camera
    rays = pixel_rays(np.column_stack([columns, rows]) + 0.5, camera) @ frame.world_from_camera.rotation.T
    begins, ends = crop.span(frame.world_from_camera.translation, rays)
    seen = cv2.resize(depth, (camera.width, camera.height), interpolation=cv2.INTER_NEAREST)[rows, columns]
    near = (seen > begins - slack) & (seen < ends + slack)
    kept = np.zeros_like(mask)
    kept[rows, columns] = (ends > np.maximum(begins, 0.0)) & (near | (seen <= 0))
    return kept


@dataclass(frozen=True, slots=True, eq=False)
class FoundCropped(Loose):
    """An object restricted to a crop box."""

    found: FoundThing
    crop: Crop
    scene: Scene

    @property
    def kind(self) -> Kind:
        """Kind of the uncropped object."""
        return self.found.kind

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of the uncropped object."""
        return self.found.warnings

    def see(self, frame: Frame) -> View:
        """Visible pixels of the object within the box."""
        view = self.found.see(frame)
        return replace(view, mask=cropped_mask(view.mask, frame, self.scene.depth(frame.index), self.crop))

    def box(self) -> ThingBox | None:
        """Box of the part in the crop box; its base is the crop box's, where that is above the support."""
        support = self.found.thing.support_z_m
        part = replace(
            self.found.thing,
            vertices=self.found.thing.vertices[self.crop.holds(self.found.thing.vertices)],
            faces=np.zeros((0, 3), np.int64),
            support_z_m=None if support is None else max(support, self.crop.bottom_m),
        )
        return FoundThing(part, self.scene, round=self.found.round).box()
