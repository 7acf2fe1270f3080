"""Axis and pivot errors by the definitions of other papers, beside this project's, so that tables can be compared.

DTA stands for PARIS, DigitalTwinArt and ArtGS, which share a definition: the pivot error is a distance between lines, in tenths
of a metre. iTACO's and Real2Code's divide by the length of the axes' cross product: parallel axes, the right answer, give 0/0,
and nearly parallel ones the distance along an arbitrary normal. Arti4D's is the distance of the found point to the true line.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.evaluate.joints import line_distance

_PARALLEL = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Line:
    """An axis in space; the direction is a unit vector."""

    origin: Vector3
    axis: Vector3


def definitions(true: Line, found: Line) -> dict[str, float]:
    """The error by every definition, keyed by name and unit; nan where a definition gives none."""
    cosine = min(abs(float(true.axis @ found.axis)), 1.0)
    return {
        "axis deg": float(np.degrees(np.arccos(cosine))),
        "pivot mm": 1000 * line_distance(true.origin, true.axis, found.origin, found.axis),
        "DTA axis deg": float(np.degrees(np.arccos(cosine))),
        "DTA pivot dm": 10 * _lines_apart(true, found),
        "iTACO axis rad": float(np.arccos(cosine)),
        "iTACO pivot m": _along_normal(true, found),
        "Arti4D axis deg": float(np.degrees(np.arccos(cosine))),
        "Arti4D pivot m": float(np.linalg.norm(np.cross(found.origin - true.origin, true.axis))),
    }


def _lines_apart(a: Line, b: Line) -> float:
    """The shortest distance between two lines."""
    normal = np.cross(a.axis, b.axis)
    length = float(np.linalg.norm(normal))
    if length < _PARALLEL:
        return float(np.linalg.norm(np.cross(b.origin - a.origin, a.axis)))
    return abs(float(normal @ (b.origin - a.origin))) / length


def _along_normal(a: Line, b: Line) -> float:
    """The distance along the axes' common normal; nan for parallel lines."""
    normal = np.cross(a.axis, b.axis)
    length = float(np.linalg.norm(normal))
    return abs(float(normal @ (b.origin - a.origin))) / length if length > 0 else float("nan")
