"""Elevations on disk: a picture each, and elevations.json, which is written last."""

import base64
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import cv2

from r2c2r_core.model.elevation import Elevation, Lines
from r2c2r_core.workspace import write_atomically

INDEX = "elevations.json"


def picture_path(folder: Path, number: int) -> Path:
    """The picture of one of them."""
    return folder / f"{number}.png"


def write_elevations(folder: Path, elevations: Iterable[Elevation]) -> None:
    """All of them, numbered from 0."""
    folder.mkdir(parents=True, exist_ok=True)
    entries = []
    for number, elevation in enumerate(elevations):
        picture = cv2.imencode(".png", cv2.cvtColor(elevation.picture, cv2.COLOR_RGB2BGR))[1].tobytes()
        write_atomically(picture_path(folder, number), picture)
        entries.append(_entry(number, elevation))
    write_atomically(folder / INDEX, json.dumps(entries).encode())


def _entry(number: int, elevation: Elevation) -> dict[str, Any]:
    """schemas.Elevation of it, without its address."""
    rows, columns = elevation.picture.shape[:2]
    return {
        "id": number,
        "cell_m": elevation.cell_m,
        "columns": columns,
        "rows": rows,
        "origin_m": elevation.origin_capture.round(6).tolist(),
        "right": elevation.right_capture.round(9).tolist(),
        "down": elevation.down_capture.round(9).tolist(),
        "top_m": round(elevation.top_m, 4),
        "upright": _lines(elevation.upright),
        "level": _lines(elevation.level),
        "cells": [[round(edge, 3) for edge in cell] for cell in elevation.cells],
    }


def _lines(lines: Lines) -> dict[str, Any]:
    blocks, positions = lines.clarity.shape
    clarity = base64.b64encode(lines.clarity.tobytes()).decode()
    return {"block": lines.block, "blocks": blocks, "positions": positions, "clarity": clarity}
