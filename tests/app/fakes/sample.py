"""A sample recording that is only a prompts file: `sample.py FOLDER --seed …`."""

import json
import sys
from pathlib import Path

folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
points = [{"frame": 3, "x": 80.5, "y": 60.5, "label": 1}]
objects = [{"name": "drawer_1", "category": "drawer", "points": points}, {"name": "mug_1", "category": "mug", "points": points}]
(folder / "prompts.json").write_text(json.dumps({"version": 1, "objects": objects}))
(folder / "scan.r3d").write_bytes(b"PK")
sys.stdout.write(json.dumps({"stage": "sample", "fraction": 0.5, "text": "rendering"}) + "\n")
sys.stdout.write(json.dumps({"done": "sample"}) + "\n")
