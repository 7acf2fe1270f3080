"""Finds every file readable, except one that says otherwise: `probe.py recording|mesh FILE NAME`. "endless" never ends."""

import json
import signal
import sys
from pathlib import Path

if b"endless" in Path(sys.argv[2]).read_bytes():
    signal.pause()
if b"unreadable" in Path(sys.argv[2]).read_bytes():
    kind, said = {"recording": ("CaptureError", "no frame can be read"), "mesh": ("OverrideError", "no triangles found")}[
        sys.argv[1]
    ]
    error = {"kind": kind, "message": f"{sys.argv[3]}: {said}", "hint": "make it again"}
    sys.stdout.write(json.dumps({"error": error}) + "\n")
else:
    sys.stdout.write(json.dumps({"done": "probe"}) + "\n")
