"""The viewer's process: `python -m app.viewer.worker`, one viser server per open view, controlled by JSON lines.

Reads {"id", "cmd": "open" | "show" | "joints" | "place" | "picked" | "camera" | "close", "view", …} and prints
{"id", "ok": {…}} or {"id", "error": {…}}. The first line is the key that the app's proxy will show. End of input ends it.
"""

import json
import sys
import threading
import traceback
import zlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import told
from app.viewer import contract
from app.viewer.scene import View
from r2c2r_core.errors import InputError, R2C2RError
from r2c2r_core.limits import limit_this_process, memory_met
from r2c2r_core.workspace import Workspace

AMBIENT = 1.6  # textures already contain the room's light: darker than the scan beside them, they look wrong


LANES = 8  # threads that answer: a large scene delays only the views that share its thread
_SAYING = threading.Lock()
BACKGROUND = ((176, 186, 198), (226, 231, 236))  # RGB, upper and lower: a white kitchen stands out from both


class NotOpen(InputError):
    """The view was closed; the caller opens it and repeats the command."""


def main() -> int:
    """Answer commands until the input ends."""
    key = json.loads(sys.stdin.readline())["key"]
    views: dict[str, View] = {}
    lanes = [ThreadPoolExecutor(1) for _ in range(LANES)]  # the commands of one view stay in order
    for line in sys.stdin:
        command = json.loads(line)
        lanes[zlib.crc32(command["view"].encode()) % LANES].submit(_answer, views, key, command)
    for lane in lanes:
        lane.shutdown()
    for view in views.values():
        view.server.stop()
    return 0


def _answer(views: dict[str, View], key: str, command: dict[str, Any]) -> None:
    try:
        answer: dict[str, Any] = {"ok": _COMMANDS[command["cmd"]](views, key, command)}
    except R2C2RError as error:
        answer = {"error": told(error)}
    except MemoryError:
        traceback.print_exc()
        answer = {"error": told(memory_met())}
    except Exception as error:  # one command must not end all views
        traceback.print_exc()
        answer = {"error": {"kind": "internal", "message": f"unexpected: {error}", "hint": "see the viewer's log"}}
    with _SAYING:
        sys.stdout.write(json.dumps({"id": command["id"], **answer}) + "\n")
        sys.stdout.flush()


def _open(views: dict[str, View], key: str, command: dict[str, Any]) -> dict[str, Any]:
    name = command["view"]
    if name not in views:
        views[name] = View(_prepared(contract.open_server(key)), Workspace(Path(command["workdir"])))
    return {"port": views[name].server.get_port()}


def _show(views: dict[str, View], key: str, command: dict[str, Any]) -> dict[str, Any]:
    view = _view(views, command)
    view.show(command)
    return _state(view)


def _joints(views: dict[str, View], key: str, command: dict[str, Any]) -> dict[str, Any]:
    view = _view(views, command)
    view.move(command["values"])
    return _state(view)


def _place(views: dict[str, View], key: str, command: dict[str, Any]) -> dict[str, Any]:
    view = _view(views, command)
    if command["pose"] is not None:
        view.place(np.asarray(command["pose"], dtype=np.float64))
    return {"pose": view.pose}


def _picked(views: dict[str, View], key: str, command: dict[str, Any]) -> dict[str, Any]:
    return asdict(_view(views, command).picked)


def _camera(views: dict[str, View], key: str, command: dict[str, Any]) -> dict[str, Any]:
    position, target = _view(views, command).lens.pose
    return {"position": position, "target": target}


def _close(views: dict[str, View], key: str, command: dict[str, Any]) -> dict[str, Any]:
    view = views.pop(command["view"], None)
    if view is not None:
        view.server.stop()
    return {}


def _view(views: dict[str, View], command: dict[str, Any]) -> View:
    if command["view"] not in views:
        raise NotOpen("the 3D view of this project is not open", hint="open it first")
    return views[command["view"]]


def _state(view: View) -> dict[str, Any]:
    joints = [asdict(joint) for joint in view.joints]
    shown = {"mode": view.mode, "text": view.text, "reduced": view.reduced, "joints": joints, "preview": view.preview}
    return shown | {"span_m": view.span_m, "part": view.part_of(view.chosen)}


def _prepared(server: Any) -> Any:
    server.scene.set_up_direction("+z")
    server.scene.configure_default_lights(cast_shadow=False)
    server.initial_camera.position = server.initial_camera.position  # set explicitly: otherwise each page has its own position
    server.scene.add_light_ambient("/light", intensity=AMBIENT)
    shades = np.linspace(*BACKGROUND, 256).round().astype(np.uint8)[:, None]
    server.scene.set_background_image(np.tile(shades, (1, 8, 1)), format="png")
    server.scene.add_grid(
        "/floor",
        infinite_grid=True,
        cell_size=0.25,
        section_size=1.0,
        cell_color=(196, 202, 210),
        section_color=(150, 158, 170),
        fade_distance=12.0,
    )
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    return server


_COMMANDS: dict[str, Callable[[dict[str, View], str, dict[str, Any]], dict[str, Any]]] = {
    "open": _open,
    "show": _show,
    "joints": _joints,
    "place": _place,
    "picked": _picked,
    "camera": _camera,
    "close": _close,
}

if __name__ == "__main__":
    limit_this_process()
    sys.exit(main())
