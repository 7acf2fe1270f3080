"""Extent errors along the object's own axes (paper eq. 17-20), separately for observed and unobserved axes.

The paper measures along world axes, which depends on the object's yaw: 2 degrees turn a 2 cm drawer front into 29 % error.
"""

import numpy as np

from r2c2r_core.evaluate.records import ObjectRecord
from r2c2r_core.model.report import Metric

_AXES = ("width", "depth", "height")


def extent_errors(truth: ObjectRecord, found: ObjectRecord) -> tuple[Metric, ...]:
    """|measured - true| / true in percent: each axis, all (E_avg), the observed ones, the unobserved ones."""
    errors = 100.0 * np.abs(_sizes_along(truth, found) - truth.dimensions_m) / truth.dimensions_m  # eq. 19
    observed = np.array(truth.observed_axes if truth.observed_axes is not None else (True, True, True))
    single = [_percent(f"{axis}_error", float(error)) for axis, error in zip(_AXES, errors, strict=True)]
    return (
        *single,
        _percent("extents", float(errors.mean())),  # eq. 20
        _percent("extents_observed", _mean(errors[observed]), "no axis was observed in full"),
        _percent("extents_unobserved", _mean(errors[~observed]), "every axis was observed"),
    )


def _sizes_along(truth: ObjectRecord, found: ObjectRecord) -> np.ndarray:
    """The found sizes in the truth's order: width and depth are swapped when the yaw is off by 90 degrees."""
    turn = truth.world_from_object.rotation.T @ found.world_from_object.rotation
    sideways = not truth.turns_freely and abs(turn[0, 0]) < abs(turn[1, 0])
    return found.dimensions_m[[1, 0, 2]] if sideways else found.dimensions_m


def _mean(values: np.ndarray) -> float | None:
    return float(values.mean()) if len(values) else None


def _percent(name: str, value: float | None, reason: str = "") -> Metric:
    return Metric(name=name, value=value, unit="%", better="lower", tolerance=0.5, note=reason if value is None else "")
