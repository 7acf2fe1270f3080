"""Weight-free segmenter: fronts cut on orthomosaics, free-standing objects cut from the fused surface."""

import contextlib
import hashlib
import importlib
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from r2c2r_core.arrays import Mask, Vector3
from r2c2r_core.errors import ObjectNotSeen, PromptError, R2C2RError
from r2c2r_core.geometry.masks import PackedMask, pack_mask
from r2c2r_core.kitchen.category import Category
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture, Frame
from r2c2r_core.model.elevation import Elevation
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.motion import JointMotion
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.model.track import FrontPanel, MaskTrack, ThingBox
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.segment.appliances.find import appliance_margins
from r2c2r_core.segment.appliances.found import FoundAppliance
from r2c2r_core.segment.corrected import painted_masks
from r2c2r_core.segment.cropped import cropped, world_crop
from r2c2r_core.segment.elevations import elevations
from r2c2r_core.segment.found import Found, View
from r2c2r_core.segment.fronts.clicked_dark import dark_place
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.fronts.front import holds
from r2c2r_core.segment.geometric.cache import kept
from r2c2r_core.segment.geometric.finders import find_drawn, find_object, find_painted_object, glimpse_object
from r2c2r_core.segment.mosaics.orthomosaic import Cell, PlaneGrid
from r2c2r_core.segment.occlusion import seeded
from r2c2r_core.segment.planes import PlaneRegion, find_planes
from r2c2r_core.segment.prepared import Hits
from r2c2r_core.segment.prompts import check_prompt
from r2c2r_core.segment.proposals.propose import propose_steps
from r2c2r_core.segment.protocol import Glimpse, SegmentConfig, Segmenter
from r2c2r_core.segment.runs.run import Run, make_run
from r2c2r_core.segment.scene import Scene, prepare_scene
from r2c2r_core.sources import modules_of, source_key
from r2c2r_core.threads import in_threads
from r2c2r_core.tuning import in_force


class GeometricSegmenter(Segmenter):
    """Segmenter that needs no weights and no optional dependencies."""

    def open(self, capture: Capture, cache: Path, config: SegmentConfig, *, progress: Progress = SILENT) -> "GeometricSession":
        """Prepare a capture: render the surface from every frame, find its vertical planes."""
        folder = cache / f"geometric-{_cache_key(capture, config)}"
        _forget_others(folder)
        _import_heavy()
        scene = prepare_scene(capture, folder, progress=progress.part(0.0, 0.9))
        progress.at(0.9, "looking for flat upright parts")
        centres = np.stack([frame.world_from_camera.translation for frame in capture.frames])
        planes = kept(folder / "planes.noun", lambda: find_planes(capture.surface, centres))
        progress.at(1.0, f"{len(planes)} flat upright parts found")
        return GeometricSession(scene=scene, planes=planes, config=config, folder=folder)


@dataclass(slots=True, eq=False)
class GeometricSession:
    """Clicks on one capture. Runs are keyed by plane and objects by prompt, so answers never depend on their order."""

    scene: Scene
    planes: tuple[PlaneRegion, ...]
    config: SegmentConfig
    folder: Path
    _runs: dict[str, Run | None] = field(default_factory=dict)
    _found: dict[ObjectPrompt, Found] = field(default_factory=dict)

    def mask_at(self, prompt: ObjectPrompt, frame_index: int) -> Mask:
        """Mask of the object in one frame; empty when that frame does not show it."""
        known = {frame.index for frame in self.scene.frames}
        if frame_index not in known:
            raise PromptError(
                f"{prompt.name}: frame {frame_index} found, a frame of {min(known)}..{max(known)} expected",
                hint="choose another",
            )
        return self._view(self.find(prompt), prompt, self.scene.frame(frame_index)).mask

    def glimpse(self, prompt: ObjectPrompt) -> Glimpse | None:
        """Preview mask in the frame clicked last, as in `stream`; approximate for free-standing objects and appliances."""
        if prompt.front is not None:
            return None
        whole = replace(prompt, crop=None)
        known = self._found.get(whole) or glimpse_object(self, whole, *self._clicked(prompt)) or self.find(whole)
        found = self._within(known, prompt)
        frame = self.scene.frame(prompt.points[-1].frame)
        view = self._view(found, prompt, frame)
        return (frame.index, pack_mask(view.mask), view.trust) if self._shows(view) else None

    def prefetch(self) -> Iterator[None]:
        """Decode as many images as stay in memory."""
        return self.scene.prefetch()

    def track(self, prompt: ObjectPrompt, *, progress: Progress = SILENT) -> MaskTrack:
        """Mask track of the object over all frames that see it; raises ObjectNotSeen when none does."""
        progress.at(0.0, f"{prompt.name}: finding it")
        found = self.find(prompt)
        masks: dict[int, PackedMask] = {}
        confidence: dict[int, float] = {}
        total = len(self.scene.frames)
        for position, (index, view) in enumerate(self._views(prompt)):
            masks[index], confidence[index] = pack_mask(view.mask), view.trust
            progress.at(min(0.1 + 0.9 * position / total, 0.99), f"{prompt.name}: seen in {position + 1} frames")
        if not masks:
            raise ObjectNotSeen(
                f"{prompt.name}: seen in 0 of {total} frames, at least 1 expected", hint="click where it is clearly visible"
            )
        progress.at(1.0, f"{prompt.name}: {len(masks)} frames")
        return MaskTrack(
            name=prompt.name,
            category=prompt.category,
            masks=dict(sorted(masks.items())),
            confidence=dict(sorted(confidence.items())),
            front=found.panel(),
            box=found.box(),
            kind=found.kind,
            backend="geometric",
            prompt_count=len(prompt.points),
            warnings=found.warnings,
            motions=found.motions(),
        )

    def stream(self, prompt: ObjectPrompt) -> Iterator[Glimpse]:
        """Frame, mask, confidence: the frame clicked last, then outwards both ways."""
        for index, view in self._views(prompt):
            yield index, pack_mask(view.mask), view.trust

    def elevations(self) -> Iterator[Elevation]:
        """Elevations of the capture's planes, on which a person draws fronts."""
        return elevations(self)

    def panel(self, prompt: ObjectPrompt) -> FrontPanel | None:
        """Flat front of the object."""
        return self.find(prompt).panel()

    def thing_box(self, prompt: ObjectPrompt) -> ThingBox | None:
        """Box of a free-standing object on its support."""
        found = self.find(prompt)
        return found.box() if found.kind == "thing" else None

    def motions(self, prompt: ObjectPrompt) -> tuple[JointMotion, ...]:
        """Joint motions of its leaves in the recording."""
        return self.find(prompt).motions()

    def propose(self) -> Iterator[tuple[float, tuple[Proposal, ...]]]:
        """Proposals so far, the most confident first, with the fraction of the work done; the last step has them all."""
        return propose_steps(self)

    def find(self, prompt: ObjectPrompt) -> Found:
        """Object under the clicks, computed once per prompt."""
        found = self._found.get(prompt)
        if found is None:
            found = self._found[prompt] = self._find(prompt)
        return found

    def _find(self, prompt: ObjectPrompt) -> Found:
        if prompt.front is not None:
            check_prompt(self.scene.capture, prompt)
            return find_drawn(self, prompt, prompt.front, category_of(prompt.category))
        hint, positives, negatives = self._clicked(prompt)
        if prompt.crop is not None:  # moving the crop box does not change the segmentation
            return self._within(self.find(replace(prompt, crop=None)), prompt)
        if prompt.frames:
            return self._as_painted(prompt, positives)
        others = np.array([point for click in prompt.others if (point := self._hit(click)) is not None]).reshape(-1, 3)
        return find_object(self, prompt, hint, positives, negatives, others)

    def _as_painted(self, prompt: ObjectPrompt, positives: Hits) -> Found:
        """Object under the clicks and the masks painted in single frames, which are evidence for the other frames."""
        by_clicks, clicked = replace(prompt, frames=()), None
        with contextlib.suppress(ObjectNotSeen):
            clicked = self.find(by_clicks)
        masks = painted_masks(prompt.frames, self.scene.capture)
        found = find_painted_object(self, prompt, positives.points, clicked, masks)
        return found if found is not None else self.find(by_clicks)

    def _within(self, found: Found, prompt: ObjectPrompt) -> Found:
        """Part of an object in the prompt's crop box; the whole object without one."""
        if prompt.crop is None:
            return found
        return cropped(found, world_crop(prompt.crop, self.scene.capture.world_from_capture), self.scene, prompt.name)

    def disputed(self, prompts: Sequence[ObjectPrompt]) -> dict[str, tuple[PromptPoint, ...]]:
        """Clicks of other fronts and appliances on an object's front, by its name; free-standing objects lie on fronts."""
        beside = [prompt for prompt in prompts if category_of(prompt.category).kind != "thing"]
        clicks = [(prompt, click) for prompt in beside for click in prompt.points if click.label == 1]
        hits = [(prompt, click, point) for prompt, click in clicks if (point := self._hit(click)) is not None]
        found: dict[str, tuple[PromptPoint, ...]] = {}
        for prompt in prompts:
            if category_of(prompt.category).kind == "thing" or prompt.front is not None:
                continue
            if (front := self._front_of(prompt)) is not None:
                within = [click for other, click, point in hits if other is not prompt and holds(*front, point)]
                found |= {prompt.name: tuple(within)} if within else {}
        return found

    def _front_of(self, prompt: ObjectPrompt) -> tuple[PlaneGrid, Cell] | None:
        """Grid and rectangle of an object's front, if any; cached, since it is requested again when other clicks change."""

        def where() -> tuple[PlaneGrid, Cell] | None:
            with contextlib.suppress(R2C2RError):  # `track` reports what is not found
                found = self.find(prompt)
                if isinstance(found, FoundFront | FoundAppliance):
                    return found.front.run.grid, found.front.cell
            return None

        key = hashlib.sha256(repr(prompt).encode()).hexdigest()[:16]
        return kept(self.folder / f"front-{key}.noun", where)

    def _hit(self, click: PromptPoint) -> Vector3 | None:
        known = any(frame.index == click.frame for frame in self.scene.frames)
        return self.scene.pick(click.frame, click.x, click.y) if known else None

    def run_of(self, region: PlaneRegion, margin_m: float = 0.0) -> Run | None:
        """Furniture run on a plane with a margin; computed once."""
        key = f"run{self.planes.index(region)}-{round(margin_m * 1000)}"
        if key not in self._runs:
            cell_m, frames = self.config.cell_m, self.config.mosaic_frames
            path = self.folder / f"{key}.noun"
            self._runs[key] = kept(path, lambda: make_run(region, self.scene, cell_m, frames, margin_m))
        return self._runs[key]

    def prepare(self, *, progress: Progress = SILENT) -> None:
        """Cut the runs of all planes, and those around planes that may be part of an appliance."""
        tasks = [(region, 0.0) for region in self.planes]
        tasks += [(region, margin) for region in self.planes for margin in appliance_margins(region)]
        for done, _ in enumerate(in_threads(lambda task: self.run_of(*task), tasks), 1):
            progress.at(done / len(tasks), f"looking for fronts: {done} of {len(tasks)} furniture runs")

    def _views(self, prompt: ObjectPrompt) -> Iterator[tuple[int, View]]:
        """Frames that show the object, the one clicked last first, then outwards both ways."""
        found = self.find(prompt)
        first = prompt.points[-1].frame if prompt.points else self.scene.frames[0].index
        for frame in sorted(self.scene.frames, key=lambda frame: (abs(frame.index - first), frame.index)):
            view = self._view(found, prompt, frame)
            if self._shows(view):
                yield frame.index, view

    def _view(self, found: Found, prompt: ObjectPrompt, frame: Frame) -> View:
        """Pixels of an object in a frame; what was clicked on or off a thing there always holds, but within its crop box."""
        view = found.see(frame)
        holds = found.kind == "thing" and prompt.crop is None
        return replace(view, mask=seeded(view.mask, prompt.points, self.scene, frame)) if holds else view

    def _shows(self, view: View) -> bool:
        return bool(np.count_nonzero(view.mask) >= self.config.least_area_px)

    def _clicked(self, prompt: ObjectPrompt) -> tuple[Category, Hits, Hits]:
        """Category of the prompt, and the points of its positive and negative clicks."""
        check_prompt(self.scene.capture, prompt)
        category = category_of(prompt.category)
        return category, self._hits(prompt, 1, category), self._hits(prompt, 0, category)

    def _hits(self, prompt: ObjectPrompt, label: int, category: Category) -> Hits:
        """Points of the clicks of one label; raises PromptError where the first on a non-appliance hits nothing.

        A later positive click without depth (glass, gloss, a far wall) takes the point of its ray nearest to the first.
        """
        clicks: list[PromptPoint] = []
        points: list[Vector3] = []
        for click in (click for click in prompt.points if click.label == label):
            point = dark_place(self.scene, self.planes, click) if category.kind == "front" else None
            if point is None:
                point = self.scene.pick(click.frame, click.x, click.y)
            if point is None and points and label == 1:
                origin, ray = self.scene.ray(click.frame, click.x, click.y)
                point = origin + ray * float((points[0] - origin) @ ray)
            if point is not None:
                clicks.append(click)
                points.append(point)
            elif label == 1 and category.kind != "appliance":
                raise PromptError(
                    f"{prompt.name}: the click at ({click.x:g}, {click.y:g}) on frame {click.frame} hits no surface, "
                    "a point with depth expected",
                    hint="click where the object is nearer or less glossy, or in another frame",
                )
        return Hits(tuple(clicks), np.array(points).reshape(-1, 3))


def _forget_others(folder: Path) -> None:
    """Delete the caches of older code or other settings, which are never read again."""
    for path in folder.parent.glob("geometric-*"):
        if path != folder:
            shutil.rmtree(path, ignore_errors=True)


def _import_heavy() -> None:
    """Import modules that would otherwise delay the first click."""
    for name in ("scipy.ndimage", "scipy.sparse.csgraph", "skimage.measure", "skimage.segmentation"):
        importlib.import_module(name)


def _cache_key(capture: Capture, config: SegmentConfig) -> str:
    parts = (
        source_key("segment"),
        capture.sha256,
        config,
        in_force(modules_of("segment")),
        capture.world_from_capture.matrix.round(9).tolist(),
        len(capture.surface.vertices_world),
        len(capture.surface.faces),
        [frame.index for frame in capture.frames],
    )
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]
