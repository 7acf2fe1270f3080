"""How a scan shows an elevation: light, blur, noise and holes of its orthomosaic, and depth as a phone gives it."""

from dataclasses import dataclass

import cv2
import numpy as np

from training.canvas import Elevation, any_paint, noise


@dataclass(frozen=True)
class Sight:
    """An elevation as an orthomosaic shows it: uint8 RGB (0 where unseen), depth points a 5 mm cell, and what is true."""

    mosaic: np.ndarray
    count: np.ndarray  # depth points, on cells of two
    raised: np.ndarray
    level_m: np.ndarray
    truth: np.ndarray  # (4, rows, columns) uint8: upright edges, level edges, handles, fronts


def seen(e: Elevation) -> Sight:
    """Light, blur, ghosts of badly posed frames, noise, holes; depth as a phone gives it."""
    rng = e.rng
    if rng.random() < 0.6:
        e = _bounded(e)
    shape = e.front.shape
    image = e.colour.copy()
    image *= (rng.uniform(0.55, 1.0) + rng.uniform(0.1, 0.7) * noise(rng, shape, rng.uniform(150, 700)))[..., None]
    for _ in range(rng.integers(0, 4)):  # shadows of things, and patches of light, with straight borders
        polygon = rng.integers((-100, -100), (shape[1] + 100, shape[0] + 100), (rng.integers(3, 5), 2))
        patch = np.zeros(shape, np.float32)
        cv2.fillPoly(patch, [polygon.astype(np.int32)], 1.0)
        patch = cv2.GaussianBlur(patch, (0, 0), rng.uniform(1.5, 40))
        image *= (1 + rng.uniform(-0.35, 0.25) * patch)[..., None]
    if rng.random() < 0.2:
        image += _reflections(rng, shape)[..., None]
    image = np.clip(image * rng.uniform(0.5, 1.3), 0, 1)
    if rng.random() < 0.75:  # frames that lie a few millimetres off each other
        most = rng.choice([0.2, 0.6, 1.5, 3.0])
        near, filmed = rng.uniform(0.35, 1.0), rng.random() < 0.7
        copies = [
            _moved(_filmed(rng, image, near * rng.uniform(0.7, 1.0)) if filmed else image, rng.normal(0, most, 2))
            for _ in range(rng.integers(2, 5))
        ]
        image = np.mean(copies, axis=0)
    image = cv2.GaussianBlur(image, (0, 0), rng.choice([rng.uniform(0.3, 0.8), rng.uniform(0.3, 2.0)]))
    image = np.clip(image, 0, 1) ** (1 / rng.uniform(1.8, 2.4))
    if rng.random() < 0.6:
        image *= _exposures(rng, shape)[..., None]
    image += rng.normal(0, rng.uniform(0.001, 0.015), image.shape) * rng.uniform(0.3, 1)
    image = (np.clip(image, 0, 1) * 255).astype(np.uint8)
    if rng.random() < 0.4:
        _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(60, 95))])
        image = cv2.imdecode(data, cv2.IMREAD_COLOR)
    image = np.maximum(image, 1)
    truth = np.stack([e.upright, e.level, e.handle, e.front])
    if rng.random() < 0.4:  # the borders of what was seen are ragged
        ragged = cv2.distanceTransform(np.pad(np.ones(shape, np.uint8), 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
        image[ragged < e.cells(rng.uniform(0.01, 0.12)) * noise(rng, shape, rng.uniform(2, 40))] = 0
    for _ in range(rng.integers(0, 4) if rng.random() < 0.5 else 0):  # what stands before it, or was never seen
        polygon = (rng.integers((0, 0), shape[::-1], 2) + rng.integers(-160, 160, (rng.integers(3, 7), 2))).astype(np.int32)
        hole = np.zeros(shape, np.uint8)
        cv2.fillPoly(hole, [polygon], 1)
        if rng.random() < 0.6:
            image[hole > 0] = 0
        else:
            image[hole > 0] = np.clip(any_paint(rng) * 255, 1, 255).astype(np.uint8)
        e.lift[hole > 0] = np.nan
    return Sight(image, *_depth(e), truth)


def _reflections(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Windows and lamps that glossy fronts mirror: light that is added, and goes on from front to front."""
    light = np.zeros(shape, np.float32)
    for _ in range(rng.integers(1, 4)):
        middle, size = rng.uniform(0, shape[::-1]), rng.uniform(0.1, 0.8, 2) * shape[::-1]
        window = np.zeros(shape, np.float32)
        corners = cv2.boxPoints((middle.tolist(), size.tolist(), rng.normal(0, 6)))
        cv2.fillPoly(window, [np.round(corners).astype(np.int32)], 1.0)
        light += rng.uniform(0.01, 0.2) * cv2.GaussianBlur(window, (0, 0), rng.uniform(1.5, 50))
    return light


def _bounded(e: Elevation) -> Elevation:
    """The part that the bounds of a plane would keep: its fronts and a little around them."""
    rows, columns = np.flatnonzero(e.front.any(axis=1)), np.flatnonzero(e.front.any(axis=0))
    if len(rows) < 80 or len(columns) < 80:
        return e
    ends = [(rows[0], rows[-1], e.front.shape[0]), (columns[0], columns[-1], e.front.shape[1])]
    near, far = [], []
    for first, last, most in ends:
        around = [e.cells(e.rng.uniform(0, 0.15)) for _ in range(2)]
        inside = [e.cells(e.rng.uniform(0, 0.4)) if e.rng.random() < 0.15 else 0 for _ in range(2)]  # the scan ends there
        near.append(int(np.clip(first - around[0] + inside[0], 0, most - 80)))
        far.append(int(np.clip(last + around[1] - inside[1], near[-1] + 80, most)))
    area = (slice(near[0], far[0]), slice(near[1], far[1]))
    layers = (e.colour, e.lift, e.known, e.upright, e.level, e.handle, e.front)
    return Elevation(e.rng, *(layer[area].copy() for layer in layers))


def _exposures(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Borders of frames that a mosaic is blended of: they differ a little in exposure and vignetting."""
    light = np.ones(shape, np.float32)
    for _ in range(rng.integers(1, 6)):
        size = rng.uniform(0.3, 1.6, 2) * shape[::-1]
        box = cv2.boxPoints((rng.uniform(0, shape[::-1]).tolist(), size.tolist(), rng.normal(0, 3)))
        frame = np.zeros(shape, np.float32)
        cv2.fillPoly(frame, [np.round(box).astype(np.int32)], 1.0)
        light *= 1 + rng.choice([0.01, 0.03, 0.08]) * rng.uniform(-1, 1) * frame
    return light


def _filmed(rng: np.random.Generator, image: np.ndarray, scale: float) -> np.ndarray:
    """As a camera's pixels show it, `scale` to a cell, sampled back onto the cells: narrow gaps look like rows of beads."""
    size = image.shape[1::-1]
    there = cv2.getRotationMatrix2D((size[0] / 2, size[1] / 2), rng.normal(0, 2.0), scale)
    there[:, 2] += rng.uniform(-0.5, 0.5, 2)
    blurred = cv2.GaussianBlur(image, (0, 0), max(rng.uniform(0.2, 0.5) / scale, 0.1))
    pixels = cv2.warpAffine(blurred, there, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    back = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(pixels, there, size, flags=back, borderMode=cv2.BORDER_REPLICATE)


def _moved(image: np.ndarray, by: np.ndarray) -> np.ndarray:
    return cv2.warpAffine(
        image, np.array([[1, 0, by[0]], [0, 1, by[1]]], np.float32), image.shape[1::-1], borderMode=cv2.BORDER_REPLICATE
    )


def _depth(e: Elevation) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Counts, raised share and level on cells of two, smeared as a depth camera smears."""
    rng = e.rng
    rows, columns = e.lift.shape[0] // 2 + 1, e.lift.shape[1] // 2 + 1
    half = cv2.resize(e.lift, (columns, rows), interpolation=cv2.INTER_NEAREST)
    there = np.isfinite(half) & (cv2.resize(e.known.astype(np.uint8), (columns, rows), interpolation=cv2.INTER_NEAREST) > 0)
    if rng.random() < 0.15:
        there &= False  # no depth at all
    if rng.random() < 0.3:
        there = _short_of_ends(rng, there)
    sigma = rng.uniform(0.8, 5)  # cells of 5 mm
    weight = cv2.GaussianBlur(there.astype(np.float32), (0, 0), sigma)
    lift = cv2.GaussianBlur(np.where(there, half, 0).astype(np.float32), (0, 0), sigma) / np.maximum(weight, 1e-3)
    density = rng.uniform(1, 30)
    holes = noise(rng, (rows, columns), rng.uniform(3, 60)) < rng.choice([0.0, 0.3])
    count = rng.poisson(np.where(there & ~holes, density * np.clip(weight, 0, 1), 0)).astype(np.float32)
    rough = rng.uniform(0.001, 0.007)
    share = _normal_cdf((lift - 0.012) / (rough * 2))
    raised = np.where(count > 0, rng.binomial(np.maximum(count, 1).astype(int), share) / np.maximum(count, 1), 0)
    wave = 0.004 * (2 * noise(rng, (rows, columns), 80) - 1)
    level = np.where(
        count > 0, np.minimum(lift, 0.006) + wave + rng.normal(0, rough, lift.shape) / np.sqrt(np.maximum(count, 1)), 0
    )
    return count, raised.astype(np.float32), level.astype(np.float32)


def _normal_cdf(z: np.ndarray) -> np.ndarray:
    return np.clip(0.5 * (1 + np.tanh(0.8 * z)), 0, 1)


def _short_of_ends(rng: np.random.Generator, there: np.ndarray) -> np.ndarray:
    """Without what lies near jumps of depth, which cameras and readers drop: by up to 35 mm, each side by its own."""
    up, down, left, right = rng.integers(0, 8, 4).tolist()
    kernel = np.ones((up + down + 1, left + right + 1), np.uint8)
    return np.asarray(cv2.erode(there.astype(np.uint8), kernel, anchor=(left, up), borderValue=1) > 0)
