"""Twists that ripl-articulation fits to part poses: run in that package's own environment, not in this project's.

    python -m venv PEER && PEER/bin/pip install ripl-articulation
    PEER/bin/python benchmarks/peer_ripl.py < POSES.json > TWISTS.json

POSES.json: {name: {"base": [4x4 …], "part": [4x4 …]}}, world poses by frame. TWISTS.json: {name: {"twist": [rotation,
translation] in the base's frame, "states": [θ …]}}. The values are the package's own (solve_articulation_from_poses with its
defaults).
"""

import json
import sys

import numpy as np
from ripl_articulation import solve_articulation_from_poses


def main() -> None:
    """Print every joint's twist as JSON."""
    found = {}
    for name, poses in json.load(sys.stdin).items():
        twist, states = solve_articulation_from_poses(np.array(poses["base"]), np.array(poses["part"]))
        found[name] = {"twist": twist.tolist(), "states": states.tolist()}
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main()
