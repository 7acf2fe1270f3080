"""Log-odds of fronts' edges and handles on an orthomosaic, by small networks trained on randomly drawn elevations.

An ensemble of two (`panel_net_*.onnx`, U-Nets of 0.57 million weights, trained by `training/train.py` on different images):
the mean of their probabilities, so that one that sees a faint gap is not outvoted by one that rules it out. The training data
contain no kitchen generator that the benchmarks use.
"""

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import cv2
import numpy as np

from r2c2r_core.arrays import Image
from r2c2r_core.segment.mosaics.orthomosaic import STEP, Cell

NETWORKS = tuple(sorted(Path(__file__).parent.glob("panel_net_*.onnx")))
_LOCAL = threading.local()
_MULTIPLE = 16
SUREST = 4.0  # nats: the drawn training data support no higher confidence
_LEVEL_M = 0.02
_AROUND = 61  # cells over which lightness is normalised


@dataclass(frozen=True, slots=True, eq=False)
class PanelOdds:
    """Log-odds (natural) on cells of STEP grid cells, (rows, columns)."""

    upright: np.ndarray  # of an upright edge of a front
    level: np.ndarray
    handle: np.ndarray
    front: np.ndarray  # of being on a front

    def near(self, axis: int) -> np.ndarray:
        """Maximum log-odds of an edge here or one cell beside: lines deviate by about that much. Axis 0 is upright."""
        odds, size = (self.upright, (1, 3)) if axis == 0 else (self.level, (3, 1))
        return np.asarray(cv2.dilate(odds, np.ones(size, np.uint8)))

    def along(self, axis: int, position: float, low: float, high: float) -> np.ndarray:
        """Log-odds of an edge along a line at `position`, from `low` to `high`, in grid cells: one per cell of the odds."""
        odds = self.near(axis) if axis == 0 else self.near(axis).T
        at = min(max(round(position / STEP - 0.5), 0), odds.shape[1] - 1)
        first = min(max(round(low / STEP), 0), len(odds) - 1)
        return odds[first : max(round(high / STEP), first + 1), at]

    def of_edges(self, cell: Cell) -> tuple[float, float, float, float]:
        """Mean log-odds of each edge of a rectangle: left, right, top, bottom."""
        return (
            float(self.along(0, cell.left, cell.top, cell.bottom).mean()),
            float(self.along(0, cell.right, cell.top, cell.bottom).mean()),
            float(self.along(1, cell.top, cell.left, cell.right).mean()),
            float(self.along(1, cell.bottom, cell.left, cell.right).mean()),
        )


def panel_odds(mosaic: Image, count: np.ndarray, raised: np.ndarray, level_m: np.ndarray) -> PanelOdds:
    """Network log-odds on a mosaic (rows, columns, 3) and the relief of the same plane."""
    inputs = features(mosaic, count, raised, level_m)
    rows, columns = inputs.shape[1:]
    padded = np.pad(inputs, ((0, 0), (0, -rows % _MULTIPLE), (0, -columns % _MULTIPLE)))
    odds = np.stack([np.clip(_forward(network, padded), -SUREST, SUREST) for network in _networks()])[:, :, :rows, :columns]
    chance = np.mean(1 / (1 + np.exp(-odds)), axis=0)
    upright, level, handle, front = np.log(chance / (1 - chance))
    return PanelOdds(upright, level, handle, front)


def features(mosaic: Image, count: np.ndarray, raised: np.ndarray, level_m: np.ndarray) -> np.ndarray:
    """Network input (19, rows, columns), float32 on cells of STEP grid cells: colours, normalised lightness, depth."""
    rows, columns = mosaic.shape[0] // STEP, mosaic.shape[1] // STEP
    colour = mosaic[: rows * STEP, : columns * STEP].astype(np.float32) / 255
    light = colour.mean(axis=2)
    mean = cv2.blur(light, (_AROUND, _AROUND))
    spread = np.sqrt(np.maximum(cv2.blur(light * light, (_AROUND, _AROUND)) - mean * mean, 0))
    normal = np.clip((light - mean) / (spread + 0.01), -4, 4) / 2
    count, raised, level_m = (values[:rows, :columns].astype(np.float32) for values in (count, raised, level_m))
    flat, high = cv2.blur(count * (1 - raised), (3, 3)), cv2.blur(count * raised, (3, 3))
    usual = float(np.median(flat[flat > 0])) if (flat > 0).any() else 1.0
    depth = np.stack(
        [np.clip(flat / usual, 0, 2), np.clip(high / usual, 0, 2), np.clip(cv2.blur(level_m, (3, 3)) / _LEVEL_M, -1, 1)]
    )
    parts = np.concatenate([colour - 0.5, normal[..., None]], axis=2)
    parts = parts.reshape(rows, STEP, columns, STEP, 4).transpose(1, 3, 4, 0, 2).reshape(4 * STEP * STEP, rows, columns)
    return np.ascontiguousarray(np.concatenate([parts, depth]), dtype=np.float32)


def _forward(network: cv2.dnn.Net, inputs: np.ndarray) -> np.ndarray:
    network.setInput(inputs[None])
    return np.array(network.forward()[0])  # a copy: the next run writes into the same memory


def _networks() -> list[cv2.dnn.Net]:
    """Networks of this thread: a network holds the buffers of its last run."""
    if not hasattr(_LOCAL, "networks"):
        _LOCAL.networks = [cv2.dnn.readNetFromONNX(str(path)) for path in NETWORKS]
    return cast(list[cv2.dnn.Net], _LOCAL.networks)
