"""Named presets of settings; a module of its own, so that the command line starts without importing the stages."""

from collections.abc import Mapping
from typing import Any

PRESETS: Mapping[str, Mapping[str, Mapping[str, Any]]] = {
    "default": {},
    "fast": {  # a first look: one candidate an object, fewer frames and views, no gripper, no pictures in the report
        "ingest": {"fused_frames": 60},
        "generate": {"count": 1, "pool_frames": 10},
        "align": {"views": 5, "match_photos": 3, "match_views": 50, "settled": 18, "refined": 4},
        "export": {"gripper": False, "pictures": False},
    },
    "paper": {  # what Real2Code2Real chooses wherever the default departs from it
        "ingest": {"outlier_neighbours": 20},
        "segment": {"fusion": "depth-mask"},
        "generate": {"count": 10, "rule": "mean"},
        "align": {"match_views": 200},
        "synthesize": {"box": "powell", "fixtures": "scene-synthesizer", "outliers": "keep"},
        "warp": {"method": "paper"},
    },
}
"""Settings that differ from the defaults, by the name of the preset."""
