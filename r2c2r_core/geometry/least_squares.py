"""Robust weighted least squares: kernels by name, normal equations, reweighted linear fits.

Kernels follow Barron, "A General and Adaptive Robust Loss Function" (CVPR 2019): the weight of a residual in iteratively
reweighted least squares, 1 at zero and about a half or a quarter at `scale`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Numbers = np.ndarray | float
Kernel = Callable[[Numbers, Numbers], np.ndarray]  # weights from residuals and their scale
_RIDGE = 1e-9  # added to the information of a linear fit, so that directions without evidence stay at zero


def cauchy(residual: Numbers, scale: Numbers) -> np.ndarray:
    """Weights of the Cauchy kernel; an infinite scale weighs everything 1."""
    return np.asarray(1.0 / (1.0 + (residual / scale) ** 2))


def huber(residual: Numbers, scale: Numbers) -> np.ndarray:
    """Weights of the Huber kernel: beyond the scale, residuals count by their amount instead of its square."""
    return np.asarray(1.0 / np.maximum(np.abs(residual / scale), 1.0))


def geman_mcclure(residual: Numbers, scale: Numbers) -> np.ndarray:
    """Weights of the Geman-McClure kernel: outliers lose all influence."""
    return cauchy(residual, scale) ** 2


def cauchy_loss(scale: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Cauchy kernel as the `loss` of `scipy.optimize.least_squares` with f_scale 1; `scale` (n,), infinite: squared."""
    square = np.where(np.isfinite(scale), scale, 1.0) ** 2
    weight, curvature = np.isfinite(scale) / square, np.isfinite(scale)

    def loss(squares: np.ndarray) -> np.ndarray:
        slope = 1.0 / (1.0 + squares * weight)
        return np.stack([np.where(curvature, square * np.log1p(squares / square), squares), slope, -weight * slope**2])

    return loss


@dataclass(frozen=True, slots=True, eq=False)
class Normal:
    """Normal equations of a linearised problem: `information` (k, k) and `pull` (k,), whose solution is the step."""

    information: np.ndarray
    pull: np.ndarray

    @staticmethod
    def of(jacobian: np.ndarray, residual: np.ndarray, weight: np.ndarray) -> "Normal":
        """Normal equations of residuals (n,), their derivatives (n, k) and weights (n,), which are inverse variances."""
        weighted = jacobian * weight[:, None]
        return Normal(weighted.T @ jacobian, -weighted.T @ residual)

    def __add__(self, other: "Normal") -> "Normal":
        return Normal(self.information + other.information, self.pull + other.pull)

    def __sub__(self, other: "Normal") -> "Normal":
        return Normal(self.information - other.information, self.pull - other.pull)

    def step(self, damping: float = 0.0) -> np.ndarray:
        """The Gauss-Newton step (k,); `damping` is added to the diagonal of the information."""
        return np.asarray(np.linalg.solve(self.information + damping * np.eye(len(self.pull)), self.pull))


def fit_linear(
    design: np.ndarray,
    target: np.ndarray,
    kernel: Kernel,
    scale: Numbers,
    *,
    rounds: int,
    start: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Robust solution x of design (n, k) @ x = target, by iteratively reweighted least squares, and its information (k, k).

    `target` is (n,) or (n, m), whose rows are weighed as a whole; `scale` is the standard deviation, a number or (n,).
    """
    solution = np.zeros((design.shape[1], *target.shape[1:])) if start is None else start
    information = np.zeros((design.shape[1], design.shape[1]))
    for _ in range(rounds):
        off = target - design @ solution
        weight = kernel(off if off.ndim == 1 else np.linalg.norm(off, axis=1), scale) / np.square(scale)
        weighted = design.T * weight
        information = weighted @ design
        solution = np.linalg.solve(information + _RIDGE * np.eye(len(information)), weighted @ target)
    return solution, information
