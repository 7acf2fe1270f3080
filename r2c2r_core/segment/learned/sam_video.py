"""SAM 2, EdgeTAM and SAM 3's tracker via transformers: one object is tracked in both directions from clicks.

No processor is used: those need torchvision, and only resize and normalise. The model's memory of an object is bounded (its
clicked frames and the latest `reach` frames of each direction), so memory use is constant for any video length.
"""

import importlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from r2c2r_core.arrays import Image, Mask
from r2c2r_core.errors import BackendUnavailable

_KEPT_ENCODINGS = 4  # of clicked frames: a second click there costs a decoder pass only (16 MB each at 1024 px)
_STABILITY_LOGIT = 1.0  # SAM's stability score: how much the mask changes when its threshold moves by this


class Click(NamedTuple):
    """A click, in image coordinates as a fraction of width and height."""

    x: float
    y: float
    label: int  # 1 on the object, 0 off it


class Seen(NamedTuple):
    """The model's prediction for one frame."""

    position: int
    mask: Mask  # at the image's resolution
    confidence: float  # 0..1: probability that the object is present, times the stability of its outline


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """Classes of one model family, and its image normalisation (transformers' processors: image_mean, image_std)."""

    model: str
    session: str
    mean: tuple[float, float, float] = (0.485, 0.456, 0.406)
    std: tuple[float, float, float] = (0.229, 0.224, 0.225)


SAM2 = Family(model="Sam2VideoModel", session="Sam2VideoInferenceSession")
EDGETAM = Family(model="EdgeTamVideoModel", session="EdgeTamVideoInferenceSession")
SAM3 = Family(
    model="Sam3TrackerVideoModel", session="Sam3TrackerVideoInferenceSession", mean=(0.5, 0.5, 0.5), std=(0.5, 0.5, 0.5)
)


@dataclass(slots=True, eq=False)
class VideoModel:
    """A model on its device. Objects are tracked one by one, independently of each other."""

    model: Any
    family: Family
    device: Any
    dtype: Any
    _encodings: dict[tuple[object, int], Any] = field(default_factory=dict)

    def follow(
        self, image_at: Callable[[int], Image], count: int, clicks: Mapping[int, list[Click]], *, channel: str = "rgb"
    ) -> Iterator[Seen]:
        """Predictions for all `count` frames: the frame clicked last, the other clicked ones, then outwards both ways.

        `clicks` are in the order of their frames' last click, at least one of them on the object. The frame of the first
        such click is read alone; the others with the memory of those before, so that a lone negative click makes sense.
        """
        follower = _Follower(self, image_at, channel)
        clicked = {position: follower.look(position, clicks[position]) for position in _read_order(clicks)}
        start = list(clicks)[-1]
        yield from sorted(clicked.values(), key=lambda seen: abs(seen.position - start))
        follower.start_from(start)
        for position in _outwards(start, count):
            if position not in clicks:
                yield follower.look(position)

    def session(self) -> Any:
        """Empty memory for one object."""
        module = importlib.import_module(type(self.model).__module__)
        return getattr(module, self.family.session)(inference_device=self.device, dtype=self.dtype)

    def pixels(self, image: Image) -> Any:
        """Model input of an image: square, normalised, (3, size, size)."""
        import torch

        size = self.size
        shrinks = image.shape[0] >= size and image.shape[1] >= size
        square = cv2.resize(image, (size, size), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
        mean, std = np.array(self.family.mean, np.float32), np.array(self.family.std, np.float32)
        normal = (square.astype(np.float32) / 255 - mean) / std
        return torch.from_numpy(np.ascontiguousarray(normal.transpose(2, 0, 1))).to(self.device, self.dtype)

    @property
    def size(self) -> int:
        """Side of the square input image, pixels."""
        return int(self.model.config.image_size)


def load_model(weights: Path, family: Family) -> VideoModel:
    """Model from a folder, on the GPU when there is one (in half precision); never downloads."""
    import torch
    import transformers

    if not hasattr(transformers, family.model):
        raise BackendUnavailable(
            f"transformers {transformers.__version__} has no {family.model}", hint="pip install -U 'r2c2r[learned]'"
        )
    device, dtype = best_device()
    try:
        model = getattr(transformers, family.model).from_pretrained(weights, local_files_only=True, dtype=dtype)
    except (OSError, ValueError, RuntimeError, ImportError, KeyError) as error:
        raise BackendUnavailable(
            f"{weights}: not the weights of a {family.model} ({str(error).splitlines()[0]})",
            hint="name the folder or hub id of the converted (transformers) weights",
        ) from error
    return on_device(model, family, torch.device(device), dtype)


def on_device(model: Any, family: Family, device: Any, dtype: Any) -> VideoModel:
    """Loaded model moved to a device, in evaluation mode."""
    return VideoModel(model.to(device, dtype).eval(), family, device, dtype)


def best_device() -> tuple[str, Any]:
    """Fastest device available and the precision it is fastest in: CUDA, Apple's GPU, else the CPU."""
    import torch

    if torch.cuda.is_available():
        return "cuda", torch.bfloat16 if torch.cuda.is_bf16_supported() else torch.float16
    if torch.backends.mps.is_available():
        return "mps", torch.float16
    tiles = False
    with suppress(AttributeError, RuntimeError):
        tiles = torch.cpu._is_amx_tile_supported()  # bfloat16 is 1.5 to 3 times as fast there, and slower elsewhere
    return "cpu", torch.bfloat16 if tiles else torch.float32


class _Follower:
    """Memory of one object, moved from frame to frame."""

    def __init__(self, owner: VideoModel, image_at: Callable[[int], Image], channel: str) -> None:
        self.owner, self.image_at, self.channel = owner, image_at, channel
        self.session = owner.session()
        self.index: int = self.session.obj_id_to_idx(1)
        self.start: int | None = None
        self.ahead = self.behind = 0
        config = owner.model.config
        self.reach = max(int(config.num_maskmem), int(config.max_object_pointers_in_encoder))

    def start_from(self, position: int) -> None:
        """Set the position from which the two directions diverge."""
        self.start = self.ahead = self.behind = position

    def look(self, position: int, clicks: list[Click] | None = None) -> Seen:
        """Prediction in one frame, from its clicks or from memory."""
        first = self.start is None
        if self.start is None:
            self.start = position
        image = self.image_at(position)
        if clicks:
            self._click(position, clicks, first=first)
            self._recall(position)
        output = self.owner.model(
            inference_session=self.session,
            frame=self.owner.pixels(image),
            frame_idx=position,
            reverse=position < self.start,
        )
        if clicks:
            self._keep(position)
        else:
            self.ahead, self.behind = max(self.ahead, position), min(self.behind, position)
        self._forget(position)
        return self._seen(position, output, (image.shape[0], image.shape[1]))

    def _click(self, position: int, clicks: list[Click], *, first: bool) -> None:
        import torch

        side, device = self.owner.size, self.owner.device
        corners = [[[[click.x * side - 0.5, click.y * side - 0.5] for click in clicks]]]  # SAM adds the half pixel back
        labels = [[[click.label for click in clicks]]]
        points = {
            "point_coords": torch.tensor(corners, dtype=torch.float32, device=device),
            "point_labels": torch.tensor(labels, dtype=torch.int32, device=device),
        }
        self.session.add_point_inputs(self.index, position, points)
        self.session.obj_with_new_inputs.append(1)
        if not first:  # as if it had been tracked to here: read with memory, not alone
            self.session.frames_tracked_per_obj[self.index][position] = {"reverse": False}

    def _recall(self, position: int) -> None:
        """Restore a clicked frame's encoding from an earlier click to the session."""
        known = self.owner._encodings.get((self.channel, position))
        if known is not None:
            self.session.cache.cache_vision_features(position, known)

    def _keep(self, position: int) -> None:
        """Keep a clicked frame: its encoding for the next click, its output for the whole video."""
        encodings = self.owner._encodings
        encodings[(self.channel, position)] = self.session.cache.get_vision_features(position)
        while len(encodings) > _KEPT_ENCODINGS:
            encodings.pop(next(iter(encodings)))
        outputs = self.session.output_dict_per_obj[self.index]
        tracked = outputs["non_cond_frame_outputs"].pop(position, None)
        if tracked is not None:
            outputs["cond_frame_outputs"][position] = tracked

    def _forget(self, position: int) -> None:
        """Drop data that no later frame needs: images, full-size masks, frames out of reach of both directions."""
        session = self.session
        session.processed_frames.clear()
        outputs = session.output_dict_per_obj[self.index]
        for kind in ("cond_frame_outputs", "non_cond_frame_outputs"):
            outputs[kind].get(position, {}).pop("high_res_masks", None)
        for held in (outputs["non_cond_frame_outputs"], session.frames_tracked_per_obj[self.index]):
            for old in [p for p in held if self.behind + self.reach < p < self.ahead - self.reach]:
                del held[old]

    def _seen(self, position: int, output: Any, shape: tuple[int, int]) -> Seen:
        import torch

        logits = output.pred_masks[:1].float()
        if logits.ndim == 3:
            logits = logits[None]
        full = torch.nn.functional.interpolate(logits, size=shape, mode="bilinear", align_corners=False)[0, 0]
        mask = np.asarray((full > 0).cpu().numpy(), dtype=bool)
        present = float(torch.sigmoid(output.object_score_logits.float().reshape(-1)[0]))
        sure, maybe = int((logits > _STABILITY_LOGIT).sum()), int((logits > -_STABILITY_LOGIT).sum())
        return Seen(position, mask, present * sure / maybe if maybe else 0.0)


def _read_order(clicks: Mapping[int, list[Click]]) -> list[int]:
    """First frame with a positive click, then the others by their distance from it."""
    start = next(position for position, here in clicks.items() if any(click.label for click in here))
    return sorted(clicks, key=lambda position: (abs(position - start), position))


def _outwards(start: int, count: int) -> Iterator[int]:
    for distance in range(1, count):
        yield from (p for p in (start + distance, start - distance) if 0 <= p < count)
