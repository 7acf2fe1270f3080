"""Common base of SuperGlue and LightGlue: SuperPoint keypoints computed once per image, and a network over image pairs.

transformers' own call repeats the detection for every pair; 6 photos against 100 views would take hours on a CPU. Here
keypoints are cached (the result is the same, stack.md §7), and of many images only the most similar go through the network.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from r2c2r_core.align.protocol import NO_MATCH, Features, Matcher, Matches
from r2c2r_core.arrays import Image, Mask
from r2c2r_core.errors import BackendUnavailable
from r2c2r_core.tuning import param, tuned

CANVAS_PX = 256  # side of the square a crop is scaled to; a multiple of 8. The stage's own views have 200 px


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of learned matchers."""

    keypoints: int = param(
        512,
        "count",
        "Maximum number of keypoints per image",
        source="2000 of them cost 5 s per pair on two cores, and match a 200 px view no better",
        ge=8,
    )
    shortlist: int = param(
        5,
        "count",
        "Number of most similar images that go through the network",
        source="as many as a photo votes with (voting.py)",
        ge=1,
    )
    detected: int = param(4, "ratio", "Ratio of detected to kept keypoints, since those outside the object are dropped", ge=1)
    margin: float = param(
        0.08,
        "ratio",
        "Margin around the object's box, relative to its size",
        source="a descriptor covers some 8 px on each side",
    )
    least: int = param(4, "count", "Minimum number of keypoints in each image", ge=1)


class Keypoints(NamedTuple):
    """Components of a feature row: position on the canvas (pixel indices, the network's convention), score, descriptor."""

    canvas_px: np.ndarray  # (n, 2)
    scores: np.ndarray  # (n,)
    descriptors: np.ndarray  # (n, d), unit length


class Pair(NamedTuple):
    """Two images' keypoints padded to one length, as torch tensors with a leading batch of 1."""

    keypoints: Any  # (1, 2, n, 2)
    scores: Any  # (1, 2, n)
    descriptors: Any  # (1, 2, n, d)
    mask: Any  # (1, 2, n)


class GlueMatcher(Matcher):
    """Matcher of SuperPoint keypoints; subclasses set the model class and how it is called."""

    class_name: str  # name in transformers
    settings: Mapping[str, float] = {}  # overrides of its stored configuration

    def __init__(self, *, weights: Path) -> None:
        self._model = _load(self.class_name, weights, self.settings)

    def describe(self, image: Image, mask: Mask) -> Features:
        """The strongest keypoints of `image` inside `mask`."""
        return _describe(self._model, image, mask)

    def match(self, first: Features, second: Features) -> Matches:
        """Pairs above the model's own threshold, one to one."""
        return _match(self._model, self._partners, first, second)

    def match_many(self, first: Features, others: Sequence[Features]) -> list[Matches]:
        """Pairs with the most similar of the other images; none with the rest."""
        near = set(_shortlist(first, others))
        return [self.match(first, other) if k in near else NO_MATCH for k, other in enumerate(others)]

    def _partners(self, pair: Pair) -> Any:
        """Indices into the other image (1, 2, n), -1 for none."""
        raise NotImplementedError


def _load(class_name: str, weights: Path, settings: Mapping[str, float]) -> Any:
    """The model of that transformers class from a folder, on the GPU if available; raises BackendUnavailable."""
    params = tuned(Params)
    import torch
    import transformers

    model_class = getattr(transformers, class_name)
    try:
        config = model_class.config_class.from_pretrained(weights, local_files_only=True)
        config.keypoint_detector_config.max_keypoints = params.detected * params.keypoints
        for name, value in settings.items():
            setattr(config, name, value)
        model = model_class.from_pretrained(weights, config=config, local_files_only=True)
    except Exception as error:  # wrong model, truncated files, wrong version: each makes the weights unusable
        line = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise BackendUnavailable(f"{weights}: no {class_name} ({line[:200]})", hint="download the weights again") from error
    return model.to("cuda" if torch.cuda.is_available() else "cpu").eval()


def _describe(model: Any, image: Image, mask: Mask) -> Features:
    """The strongest keypoints of `image` inside `mask`."""
    params = tuned(Params)
    import torch

    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return _features(model, np.zeros((0, 2)), Keypoints(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 0))))
    margin = 2 + params.margin * max(len(rows), len(columns))
    left, top = max(int(columns[0] - margin), 0), max(int(rows[0] - margin), 0)
    crop = image[top : int(rows[-1] + margin) + 1, left : int(columns[-1] + margin) + 1]
    scale = CANVAS_PX / max(crop.shape[:2])
    size = (max(round(crop.shape[1] * scale), 1), max(round(crop.shape[0] * scale), 1))
    smooth = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    grey = cv2.cvtColor(np.ascontiguousarray(crop), cv2.COLOR_RGB2GRAY)
    canvas = np.full((CANVAS_PX, CANVAS_PX), 128, np.uint8)
    canvas[: size[1], : size[0]] = cv2.resize(grey, size, interpolation=smooth)
    pixels = torch.from_numpy(np.repeat(canvas[None, None].astype(np.float32) / 255, 3, axis=1)).to(model.device)
    with torch.inference_mode():
        found = model.keypoint_detector(pixels)
    shares, scores, descriptors = (t[0].float().cpu().numpy() for t in (found.keypoints, found.scores, found.descriptors))
    on_canvas = shares.astype(np.float64) * CANVAS_PX  # pixel indices; their centres lie half a pixel further
    uv = (on_canvas + 0.5) / [size[0] / crop.shape[1], size[1] / crop.shape[0]] + [left, top]
    inside = found.mask[0].cpu().numpy().astype(bool) & _covered(uv, mask)
    best = np.flatnonzero(inside)[np.argsort(-scores[inside], kind="stable")[: params.keypoints]]
    return _features(model, uv[best], Keypoints(on_canvas[best], scores[best], descriptors[best]))


def _match(model: Any, partners_of: Callable[[Pair], Any], first: Features, second: Features) -> Matches:
    """Pairs of keypoints from the network."""
    import torch

    if min(len(first.uv_px), len(second.uv_px)) < tuned(Params).least:
        return NO_MATCH
    with torch.inference_mode():
        partners = partners_of(_padded(model, _unpack(first), _unpack(second)))
    found = partners[0, 0, : len(first.uv_px)].cpu().numpy().astype(np.int64)
    rows = np.flatnonzero((found >= 0) & (found < len(second.uv_px)))
    return Matches(rows, found[rows])


def _shortlist(first: Features, others: Sequence[Features]) -> list[int]:
    """Indices of the images with most mutual nearest neighbours of descriptors: cheap, without the network."""
    votes = [_mutual_neighbours(_unpack(first).descriptors, _unpack(other).descriptors) for other in others]
    return sorted(range(len(others)), key=lambda k: -votes[k])[: tuned(Params).shortlist]


def _unpack(features: Features) -> Keypoints:
    """Components of the rows that `_describe` packed."""
    rows = features.descriptors
    return Keypoints(rows[:, :2], rows[:, 2], rows[:, 3:])


def _features(model: Any, uv_px: np.ndarray, keypoints: Keypoints) -> Features:
    width = model.config.keypoint_detector_config.descriptor_decoder_dim
    descriptors = keypoints.descriptors.reshape(len(uv_px), width)
    return Features(uv_px, np.column_stack([keypoints.canvas_px, keypoints.scores, descriptors]).astype(np.float32))


def _covered(uv_px: np.ndarray, mask: Mask) -> np.ndarray:
    column = np.clip(uv_px[:, 0].astype(int), 0, mask.shape[1] - 1)
    row = np.clip(uv_px[:, 1].astype(int), 0, mask.shape[0] - 1)
    return np.asarray(mask[row, column])


def _padded(model: Any, first: Keypoints, second: Keypoints) -> Pair:
    import torch

    count = max(len(first.scores), len(second.scores))

    def both(a: np.ndarray, b: np.ndarray) -> Any:
        block = np.zeros((1, 2, count, *a.shape[1:]), np.float32)
        block[0, 0, : len(a)], block[0, 1, : len(b)] = a, b
        return torch.from_numpy(block).to(model.device)

    mask = both(np.ones(len(first.scores)), np.ones(len(second.scores))).int()
    return Pair(
        both(first.canvas_px, second.canvas_px),
        both(first.scores, second.scores),
        both(first.descriptors, second.descriptors),
        mask,
    )


def _mutual_neighbours(first: np.ndarray, second: np.ndarray) -> int:
    if min(len(first), len(second)) < tuned(Params).least:
        return 0
    likeness = first @ second.T
    return int(np.count_nonzero(likeness.argmax(axis=0)[likeness.argmax(axis=1)] == np.arange(len(first))))
