"""Stand-in for variants, only a picture and facts: `vary.py BUNDLE FOLDER --count N --seed S`, as PROJECT/behave.json says."""

import json
import signal
import sys
import time
from pathlib import Path

bundle, folder = Path(sys.argv[1]), Path(sys.argv[2])
project = folder.parent.parent
told = project / "behave.json"
behaviour = json.loads(told.read_text()).get("vary", "done") if told.exists() else "done"
sys.stdout.write(json.dumps({"stage": "vary", "fraction": 0.5, "text": "variant 1 of 2"}) + "\n")
sys.stdout.flush()
if behaviour == "hang":
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    (project / "hanging").touch()
    while not stopped:
        time.sleep(0.02)
    sys.stdout.write(json.dumps({"error": {"kind": "Cancelled", "message": "vary: cancelled", "hint": ""}}) + "\n")
    sys.exit(130)
folder.mkdir(parents=True, exist_ok=True)
(folder / "variants.zip").write_bytes(b"PK" + bundle.read_bytes())
(folder / "wall.jpg").write_bytes(b"jpg")
facts = {"count": int(sys.argv[4]), "seed": int(sys.argv[6]), "sha256": "ab" * 32, "size": 3, "created": time.time()}
found = {"rejected": {"an object collides with something": 2}, "checked": 2, "failed": []}
(folder / "facts.json").write_text(json.dumps(facts | found))
sys.stdout.write(json.dumps({"done": "vary"}) + "\n")
