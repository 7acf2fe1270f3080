"""Stand-in live segmenter whose masks are rectangles around the click: `live.py WORKDIR --width N --segmenter NAME`.

A negative first click fails; a click at x >= 150 is slow, so that it can be superseded; one at x >= 156 yields one frame and
then blocks until it is superseded or stopped; one at y >= 114 finds no mask in its frame. It proposes two drawers and a bottle,
and draws one plane.
"""

import json
import sys
import threading
import time
from pathlib import Path
from queue import Empty, Queue

import numpy as np

from app.jobs.elevation_files import write_elevations
from app.jobs.mask_wire import mask_bits
from r2c2r_core.geometry.masks import pack_mask
from r2c2r_core.model.elevation import Elevation, Lines

FRAMES = (3, 0, 7)
OPENED = {
    "part": "",
    "kind": "revolute",
    "largest": 1.5,
    "source": "measured",
    "states": [
        {"frame": 0, "value": 0.01, "sigma": 0.01},
        {"frame": 3, "value": 0.7, "sigma": 0.05},
        {"frame": 7, "value": 1.5, "sigma": 0.02},
    ],
}
FOUND = [[0.6, 2.0, 0.8], [1.2, 2.0, 0.8], [1.2, 2.0, 0.2], [0.6, 2.0, 0.2]]  # of a clicked cabinet, with two faint edges
PROPOSED = (("front", "drawer", 0.95, 30.5), ("front", "drawer", 0.9, 60.5), ("thing", "bottle", 0.4, 100.5))


def say(**message: object) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def rectangle(x: float, y: float) -> dict[str, object]:
    mask = np.zeros((120, 160), bool)
    mask[max(int(y) - 5, 0) : int(y) + 5, max(int(x) - 5, 0) : int(x) + 5] = True
    return mask_bits(pack_mask(mask), 160)


def propose() -> None:
    found = [
        {
            "id": f"proposal{k}",
            "kind": kind,
            "category": category,
            "confidence": confidence,
            "frame": 3,
            "x": x,
            "y": 60.5,
            "size_m": [0.5, 0.58, 0.2],
            "outline": [[x - 5, 55.5], [x + 5, 55.5], [x + 5, 65.5], [x - 5, 65.5]],
            "handle": [],
            "mask": rectangle(x, 60.5),
        }
        for k, (kind, category, confidence, x) in enumerate(PROPOSED)
    ]
    say(proposals=found[:1], fraction=0.5)
    while Path(sys.argv[1], "propose_slowly").exists():
        time.sleep(0.02)
    say(proposals=found, fraction=1.0)


def elevation() -> Elevation:
    """A plane of 2.4 by 0.9 m with seams every 60 cm."""
    upright = np.zeros((9, 240), np.uint8)
    upright[:, 60::60] = 255
    return Elevation(
        picture=np.full((90, 240, 3), 230, np.uint8),
        cell_m=0.01,
        origin_capture=np.array([0.0, 2.0, 0.9]),
        right_capture=np.array([1.0, 0.0, 0.0]),
        down_capture=np.array([0.0, 0.0, -1.0]),
        top_m=0.9,
        upright=Lines(clarity=upright, block=10),
        level=Lines(clarity=np.zeros((24, 90), np.uint8), block=10),
        cells=((0.0, 10.0, 60.0, 80.0),),
    )


def superseded(commands: Queue, number: int, *, wait: bool) -> bool:
    """Whether a later command supersedes this one; commands read for the check stay in the queue, in order."""
    read, found = [], False
    while not found:
        try:
            read.append(commands.get(block=wait))
        except Empty:
            break
        found = read[-1] is None or read[-1].get("object") == number
    for command in read:
        commands.put(command)
    return found


def main() -> None:
    commands: Queue = Queue()

    def read() -> None:
        for line in sys.stdin:
            commands.put(json.loads(line))
        commands.put(None)

    threading.Thread(target=read, daemon=True).start()
    Path(sys.argv[1], "live_options.txt").write_text(" ".join(sys.argv[2:]))
    say(state="preparing", fraction=0.5, text="halfway")
    while Path(sys.argv[1], "prepare_slowly").exists():
        say(state="preparing", fraction=0.6, text="slowly")
        time.sleep(0.02)
    if "--elevations" in sys.argv:
        write_elevations(Path(sys.argv[sys.argv.index("--elevations") + 1]), [elevation()])
    say(state="ready", total=3)
    while (command := commands.get()) is not None:
        if command["cmd"] == "propose":
            propose()
        if command["cmd"] != "segment":
            continue
        number, key, prompt = command["object"], command["key"], command["prompt"]
        point = (prompt["points"] or [{"x": 80.5, "y": 60.5, "label": 1}])[0]
        front = {"corners_m": prompt["front"]["corners_m"], "handle": None} if "front" in prompt else None
        if front is None and prompt["category"] == "cabinet":
            front = {"corners_m": FOUND, "handle": None, "edges": [0.9, 0.1, 0.9, 0.2]}
        if front is None and prompt["category"] == "oven":
            front = {"corners_m": FOUND, "handle": None, "suggested": "wall_cabinet"}
        if point["label"] == 0:
            say(
                object=number,
                key=key,
                end="failed",
                error={"kind": "PromptError", "message": "nothing there", "hint": "click on it"},
            )
            continue
        missed = {point["frame"] for point in prompt["points"] if point["y"] >= 114}
        for frame in FRAMES:
            if frame in missed:
                continue
            say(object=number, key=key, frame=frame, confidence=0.9, area=0.005, mask=rectangle(point["x"], point["y"]))
            time.sleep(0.3 if point["x"] >= 150 else 0)
            if superseded(commands, number, wait=point["x"] >= 156):
                break
        else:
            say(object=number, key=key, end="done", front=front, motions=[OPENED] if prompt["category"] == "cabinet" else [])


main()
