"""Learned segmenters: a video model predicts masks, depth prunes them, furniture is measured as without weights."""

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from r2c2r_core.arrays import Image, Mask
from r2c2r_core.errors import ObjectNotSeen, PromptError, R2C2RError
from r2c2r_core.geometry.masks import PackedMask, pack_mask, unpack_mask
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.carrier import Carrier
from r2c2r_core.model.elevation import Elevation
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.model.motion import JointMotion, opened_frames
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.model.track import FrontPanel, MaskTrack, ThingBox
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.segment.cropped import cropped_mask, world_crop
from r2c2r_core.segment.found import Found as WeightFree
from r2c2r_core.segment.fronts.drawer_at import drawer_at
from r2c2r_core.segment.geometric.session import GeometricSegmenter, GeometricSession
from r2c2r_core.segment.learned.fuse import DepthPictures, Fused, both_masks, with_evidence
from r2c2r_core.segment.learned.measure import Measured, measure, measure_carried, measured_as
from r2c2r_core.segment.learned.sam_video import EDGETAM, SAM2, SAM3, Click, Family, Seen, VideoModel, load_model
from r2c2r_core.segment.learned.voting import agreed_body
from r2c2r_core.segment.motion.carried import seen_from_drawer
from r2c2r_core.segment.prompts import check_prompt
from r2c2r_core.segment.protocol import SegmentConfig, Segmenter
from r2c2r_core.segment.scene import Scene

_KEPT_OBJECTS = 8  # tracked so far: a later click resumes where it stopped

Found = tuple[int, PackedMask, float]  # frame, mask, confidence


class LearnedSegmenter(Segmenter):
    """Backend with masks from a video model in the folder `weights`."""

    name: str
    family: Family

    def __init__(self, weights: Path) -> None:
        self.weights = weights

    def open(self, capture: Capture, cache: Path, config: SegmentConfig, *, progress: Progress = SILENT) -> "LearnedSession":
        """Load the model, and prepare the capture as the weight-free segmenter does, for its surface and planes."""
        progress.at(0.0, f"loading {self.name}")
        model = load_model(self.weights, self.family)
        prepared = GeometricSegmenter().open(capture, cache, config, progress=progress.part(0.2, 1.0))
        return LearnedSession(name=self.name, model=model, prepared=prepared, config=config)


class Sam2Segmenter(LearnedSegmenter):
    """SAM 2 and 2.1 (Ravi et al. 2024)."""

    name, family = "sam2", SAM2


class EdgeTamSegmenter(LearnedSegmenter):
    """EdgeTAM (Zhou et al. 2025)."""

    name, family = "edgetam", EDGETAM


class Sam3Segmenter(LearnedSegmenter):
    """SAM 3's tracker (Meta 2025)."""

    name, family = "sam3", SAM3


@dataclass(slots=True, eq=False)
class LearnedSession:
    """Clicks on one capture. Every prompt has its own memory in the model, so objects never disturb each other."""

    name: str
    model: VideoModel
    prepared: GeometricSession
    config: SegmentConfig
    _followed: dict[ObjectPrompt, "_Followed"] = field(default_factory=dict)
    _depths: DepthPictures | None = None
    _drawers: dict[PromptPoint, Carrier | None] = field(default_factory=dict)  # at the clicks on things

    @property
    def capture(self) -> Capture:
        """The opened capture."""
        return self.prepared.scene.capture

    def mask_at(self, prompt: ObjectPrompt, frame_index: int) -> Mask:
        """Mask of the model in one frame; tracks the object up to there if needed."""
        if prompt.front is not None:
            return self.prepared.mask_at(prompt, frame_index)
        known = {frame.index for frame in self.capture.frames}
        if frame_index not in known:
            raise PromptError(
                f"{prompt.name}: frame {frame_index} found, a frame of {min(known)}..{max(known)} expected",
                hint="choose another",
            )
        found = next((packed for index, packed, _ in self._seen(prompt) if index == frame_index), None)
        assert found is not None
        return unpack_mask(found)

    def glimpse(self, prompt: ObjectPrompt) -> Found | None:
        """None: `stream` yields the model's own first mask first, and the model is not thread-safe."""
        return None

    def prepare(self, *, progress: Progress = SILENT) -> None:
        """Prepare runs for measurements and proposals."""
        self.prepared.prepare(progress=progress)

    def prefetch(self) -> Iterator[None]:
        """Decode images."""
        return self.prepared.prefetch()

    def stream(self, prompt: ObjectPrompt) -> Iterator[Found]:
        """Masks in the model's order: the frame clicked last, the other clicked ones, then outwards both ways."""
        if prompt.front is not None:
            return self.prepared.stream(prompt)
        return (found for found in self._seen(prompt) if found[1].area_px >= self.config.least_area_px)

    def track(self, prompt: ObjectPrompt, *, progress: Progress = SILENT) -> MaskTrack:
        """Mask track of the object over all frames that see it, after fusion of all frames; raises ObjectNotSeen."""
        if prompt.front is not None:  # a drawn front needs no search
            return self.prepared.track(prompt, progress=progress)
        drawer, moving = self._drawer(prompt), self._moving(prompt)
        scene = self.prepared.scene if drawer is None else seen_from_drawer(drawer, self.prepared.scene)
        seen = self._fused(prompt, scene, progress)
        opened = opened_frames(moving.motions()) if moving is not None else frozenset()
        body = agreed_body(scene, {index: mask for index, mask in seen.masks.items() if index not in opened} or seen.masks)
        if self.config.fusion == "evidence":
            seen = with_evidence(scene, seen, body, self.config.least_area_px, opened)
        progress.at(0.95, f"{prompt.name}: measuring it")
        if moving is not None:
            measured = measured_as(moving)
        elif drawer is not None:
            measured = measure_carried(drawer, scene, prompt, seen.masks, body)
        else:
            measured = measure(self.prepared, prompt, seen.masks, body)
        return self._track(prompt, seen, measured)

    def elevations(self) -> Iterator[Elevation]:
        """Elevations of the weight-free segmenter."""
        return self.prepared.elevations()

    def panel(self, prompt: ObjectPrompt) -> FrontPanel | None:
        """Front panel if it was drawn; else None, since it is measured after all frames."""
        return self.prepared.panel(prompt) if prompt.front is not None else None

    def thing_box(self, prompt: ObjectPrompt) -> ThingBox | None:
        """None: the box is measured after all frames."""
        return None

    def motions(self, prompt: ObjectPrompt) -> tuple[JointMotion, ...]:
        """Motions of a drawn front; else none, since they are measured after all frames."""
        return self.prepared.motions(prompt) if prompt.front is not None else ()

    def disputed(self, prompts: Sequence[ObjectPrompt]) -> dict[str, tuple[PromptPoint, ...]]:
        """No disputes: the model tracks each object's own clicks."""
        return {}

    def propose(self) -> Iterator[tuple[float, tuple[Proposal, ...]]]:
        """Proposals of the weight-free segmenter; the model tracks confirmed ones."""
        return self.prepared.propose()

    def _drawer(self, prompt: ObjectPrompt) -> Carrier | None:
        """Open drawer in which a free-standing object was clicked; None for others."""
        check_prompt(self.capture, prompt)
        click = next(click for click in prompt.points if click.label == 1)
        point = self.prepared.scene.pick(click.frame, click.x, click.y)
        if point is None or category_of(prompt.category).kind != "thing":
            return None
        if click not in self._drawers:
            self._drawers[click] = drawer_at(self.prepared, point, click.frame)
        return self._drawers[click]

    def _moving(self, prompt: ObjectPrompt) -> WeightFree | None:
        """Front or appliance that the recording shows open, as the weight-free segmenter finds it; None for others.

        Masks alone do not tell where such a front is closed.
        """
        if category_of(prompt.category).kind == "thing":
            return None
        with contextlib.suppress(R2C2RError):  # the model may see what the weight-free segmenter does not
            found = self.prepared.find(prompt)
            return found if found.motions() else None
        return None

    def _fused(self, prompt: ObjectPrompt, scene: Scene, progress: Progress) -> Fused:
        """The model's masks in the frames of a scene, after tracking through all frames; raises ObjectNotSeen."""
        total, usable = len(self.capture.frames), {frame.index for frame in scene.frames}
        masks: dict[int, PackedMask] = {}
        confidence: dict[int, float] = {}
        for position, (index, packed, trust) in enumerate(self._seen(prompt)):
            if index in usable and packed.area_px >= self.config.least_area_px:
                masks[index], confidence[index] = packed, trust
            progress.at(0.9 * (position + 1) / total, f"{prompt.name}: {self.name} at frame {position + 1}/{total}")
        if not masks:
            raise ObjectNotSeen(
                f"{prompt.name}: {self.name} sees it in 0 of {total} frames, at least 1 expected",
                hint="click where it is clearly visible, or add a second click",
            )
        progress.at(0.9, f"{prompt.name}: comparing frames")
        return Fused(masks, confidence, self._of(prompt).warnings())

    def _track(self, prompt: ObjectPrompt, fused: Fused, measured: Measured) -> MaskTrack:
        return MaskTrack(
            name=prompt.name,
            category=prompt.category,
            masks=dict(sorted(fused.masks.items())),
            confidence=dict(sorted(fused.confidence.items())),
            front=measured.front,
            box=measured.box,
            kind=measured.kind,
            backend=self.name,
            prompt_count=len(prompt.points),
            warnings=fused.warnings + measured.warnings,
            motions=measured.motions,
        )

    def _seen(self, prompt: ObjectPrompt) -> Iterator[Found]:
        """Masks of the model, restricted to the prompt's crop box where there is one."""
        if prompt.crop is None:
            yield from self._of(prompt).all()
            return
        crop = world_crop(prompt.crop, self.capture.world_from_capture)
        drawer = self._drawer(prompt)
        for index, packed, trust in self._of(prompt).all():
            frame, depth = self.capture.frame(index), self.prepared.scene.depth(index)
            closed = frame if drawer is None else drawer.frame(frame) or frame  # the box lies where its drawer is closed
            yield index, pack_mask(cropped_mask(unpack_mask(packed), closed, depth, crop)), trust

    def _of(self, prompt: ObjectPrompt) -> "_Followed":
        """Tracking state of the object, reused from earlier requests."""
        prompt = replace(prompt, crop=None, frames=())  # neither a crop box nor a frame's correction reruns the model
        if prompt not in self._followed:
            check_prompt(self.capture, prompt)
            while len(self._followed) >= _KEPT_OBJECTS:
                self._followed.pop(next(iter(self._followed)))
            self._followed[prompt] = _Followed(self._follow(prompt))
        return self._followed[prompt]

    def _follow(self, prompt: ObjectPrompt) -> Iterator[tuple[int, Seen, bool]]:
        """Frame number, prediction there, and whether the depth mask (where there is one) agreed."""
        frames = self.capture.frames
        position_of = {frame.index: position for position, frame in enumerate(frames)}
        clicks: dict[int, list[Click]] = {}
        for point in prompt.points:
            camera = self.capture.frame(point.frame).rgb_camera
            click = Click(point.x / camera.width, point.y / camera.height, point.label)
            position = position_of[point.frame]
            clicks[position] = [*clicks.pop(position, []), click]  # the frame clicked last comes last
        colour = self.model.follow(self._colour, len(frames), clicks)
        if self.config.fusion != "depth-mask":
            for seen in colour:
                yield frames[seen.position].index, seen, True
            return
        if self._depths is None:
            self._depths = DepthPictures.over(self.prepared.scene)
        depth = self.model.follow(self._depths.picture, len(frames), clicks, channel="depth")
        for seen, beside in zip(colour, depth, strict=True):
            mask, agreed = both_masks(seen.mask, beside.mask)
            yield frames[seen.position].index, seen._replace(mask=mask), agreed

    def _colour(self, position: int) -> Image:
        return self.prepared.scene.rgb(self.capture.frames[position].index)


class _Followed:
    """One object as far as it was tracked; tracking resumes on demand."""

    def __init__(self, rest: Iterator[tuple[int, Seen, bool]]) -> None:
        self._rest = rest
        self._found: list[Found] = []
        self._apart = 0  # frames whose depth mask differed too much to count

    def all(self) -> Iterator[Found]:
        """Results so far, then further ones as they are tracked."""
        position = 0
        while position < len(self._found) or self._advance():
            yield self._found[position]
            position += 1

    def warnings(self) -> tuple[str, ...]:
        """Warnings to the user about the object's masks."""
        if not self._apart:
            return ()
        return (
            f"colour and depth masks disagreed in {self._apart} of {len(self._found)} frames: the colour mask was used there",
        )

    def _advance(self) -> bool:
        following = next(self._rest, None)
        if following is None:
            return False
        index, seen, agreed = following
        self._found.append((index, pack_mask(np.asarray(seen.mask)), seen.confidence))
        self._apart += not agreed
        return True
