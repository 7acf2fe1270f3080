"""Stand-in probe that accepts every file, except by name: `probe.py recording|mesh FILE NAME`. "endless" never ends."""

import json
import signal
import sys
from pathlib import Path

PICTURE = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNkYPhfDwAChwGA60e6kgAAAABJRU5ErkJggg=="  # one pixel
if b"endless" in Path(sys.argv[2]).read_bytes():
    signal.pause()
if b"unreadable" in Path(sys.argv[2]).read_bytes():
    kind, said = {"recording": ("CaptureError", "no frame can be read"), "mesh": ("OverrideError", "no triangles found")}[
        sys.argv[1]
    ]
    error = {"kind": kind, "message": f"{sys.argv[3]}: {said}", "hint": "make it again"}
    sys.stdout.write(json.dumps({"error": error}) + "\n")
else:
    if sys.argv[1] == "mesh":
        seen = {"size": [1.0, 0.6, 0.4], "triangles": 12, "notes": ["small holes were filled"], "picture": PICTURE}
        sys.stdout.write(json.dumps({"seen": seen}) + "\n")
    sys.stdout.write(json.dumps({"done": "probe"}) + "\n")
