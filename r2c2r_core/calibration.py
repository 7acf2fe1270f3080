"""Calibration of scores to probabilities by a logistic map with two parameters.

Cox, "Two further applications of a model for binary regression", Biometrika 1958; Platt scaling is the same map on a margin.
`benchmarks/calibration.py` fits the numbers over the sample kitchens of both generators.
"""

from math import exp, log

FITTED = "fitted over the sample kitchens of both generators: benchmarks/calibration.py"
"""The source of a map's numbers."""


def probability(log_odds: float) -> float:
    """Probability from natural log-odds."""
    return 1.0 / (1.0 + exp(-log_odds))


def log_odds(chance: float) -> float:
    """Natural log-odds of a probability, which is taken as 0.1 % to 99.9 %."""
    bounded = min(max(chance, 0.001), 0.999)
    return log(bounded / (1.0 - bounded))


def calibrated(claim: float, slope: float, offset: float) -> float:
    """Calibrated probability of a claimed score in 0..1: its log-odds times `slope` plus `offset`.

    The map is monotonic for `slope` above 0, so ranks are preserved; 0 and 1 are fixed points.
    """
    if not 0.0 < claim < 1.0:
        return min(max(claim, 0.0), 1.0)
    return probability(slope * log(claim / (1.0 - claim)) + offset)
