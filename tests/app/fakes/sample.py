"""Stand-in for the sample's job, which writes only a prompts file: `sample.py FOLDER --name NAME --seed …`."""

import json
import sys
from pathlib import Path

folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
click, other = ({"frame": 3, "x": x, "y": y, "label": 1} for x, y in ((80.5, 60.5), (8.5, 112.5)))
objects = [
    {"name": "drawer_1", "category": "drawer", "points": [click]},
    {"name": "mug_1", "category": "mug", "points": [other]},
]
(folder / "prompts.json").write_text(json.dumps({"version": 1, "objects": objects}))
(folder / f"{sys.argv[3]}.r3d").write_bytes(b"PK")
sys.stdout.write(json.dumps({"stage": "sample", "fraction": 0.5, "text": "rendering"}) + "\n")
sys.stdout.write(json.dumps({"done": "sample"}) + "\n")
