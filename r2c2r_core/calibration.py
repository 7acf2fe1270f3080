"""What a score is worth as a probability: the logistic map of two numbers between a claim and how often it is right.

Cox, "Two further applications of a model for binary regression", Biometrika 1958; Platt scaling is the same map on a margin.
`benchmarks/calibration.py` fits the numbers over the sample kitchens of both generators.
"""

from math import exp, log

FITTED = "fitted over the sample kitchens of both generators: benchmarks/calibration.py"
"""The source of a map's numbers."""


def probability(log_odds: float) -> float:
    """Of natural log-odds."""
    return 1.0 / (1.0 + exp(-log_odds))


def calibrated(claim: float, slope: float, offset: float) -> float:
    """The share of claims like this one (0..1) that are right: log-odds taken `slope` times and `offset` further.

    It rises with the claim where `slope` is above 0, so nothing changes its rank; 0 and 1 stay what they are.
    """
    if not 0.0 < claim < 1.0:
        return min(max(claim, 0.0), 1.0)
    return probability(slope * log(claim / (1.0 - claim)) + offset)
