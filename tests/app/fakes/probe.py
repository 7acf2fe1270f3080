"""Finds every recording readable, except one that says otherwise: `probe.py FILE NAME`."""

import json
import sys
from pathlib import Path

if b"unreadable" in Path(sys.argv[1]).read_bytes():
    error = {"kind": "CaptureError", "message": f"{sys.argv[2]}: no frame can be read", "hint": "record again"}
    sys.stdout.write(json.dumps({"error": error}) + "\n")
else:
    sys.stdout.write(json.dumps({"done": "probe"}) + "\n")
