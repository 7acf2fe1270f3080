"""Stand-in viewer with an echoing upstream; views not open are an error.

Opacity 0.123 kills it, 0.321 blocks it for ever, 0.222 delays the answer until after the next one.
"""

import json
import signal
import sys
import threading
from http import HTTPStatus
from typing import Any

from websockets.datastructures import Headers
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection, serve

KEY = json.loads(sys.stdin.readline())["key"]
PAGE = b"<html><head><title>3D</title></head><body><canvas></canvas></body></html>"


def page(connection: ServerConnection, request: Request) -> Response | None:
    if request.headers.get("X-R2C2R-Key") != KEY:
        return Response(HTTPStatus.FORBIDDEN, "Forbidden", Headers({"Content-Length": "0"}), b"")
    if request.headers.get("Upgrade") == "websocket":
        return None
    headers = Headers({"Content-Type": "text/html", "Content-Length": str(len(PAGE)), "Connection": "close"})
    return Response(HTTPStatus.OK, "OK", headers, PAGE)


def echo(connection: ServerConnection) -> None:
    for message in connection:
        connection.send(message)


def choose(_: ServerConnection, offered: Any) -> Any:
    return offered[0] if offered else None


server = serve(echo, "127.0.0.1", 0, process_request=page, select_subprotocol=choose, compression=None)
threading.Thread(target=server.serve_forever, daemon=True).start()
port = server.socket.getsockname()[1]
shown: dict[str, int] = {}  # number of times, by view
opened: set[str] = set()
answers: list[dict[str, Any]] = []  # not sent yet
for line in sys.stdin:
    command = json.loads(line)
    if command.get("opacity") == 0.123:
        sys.exit(1)
    if command.get("opacity") == 0.321:
        signal.pause()
    if command["cmd"] == "open":
        opened.add(command["view"])
    elif command["view"] not in opened:
        error = {"kind": "NotOpen", "message": "the 3D view of this project is not open", "hint": "open it first"}
        sys.stdout.write(json.dumps({"id": command["id"], "error": error}) + "\n")
        sys.stdout.flush()
        continue
    if command["cmd"] == "close":
        opened.discard(command["view"])
    answer: dict[str, Any] = {"port": port}
    if command["cmd"] == "show":
        shown[command["view"]] = shown.get(command["view"], 0) + 1
        answer = {"mode": command["mode"], "text": f"shown {shown[command['view']]} times", "joints": []}
    if command["cmd"] == "joints":
        joints = [{"name": name, "lower": 0.0, "upper": 1.0, "value": value} for name, value in command["values"].items()]
        answer = {"mode": "scene", "text": "moved", "joints": joints}
    if command["cmd"] == "place":
        answer = {"pose": command["pose"]}
    if command["cmd"] == "picked":
        answer = {"number": 1, "name": "drawer_1", "point": [0.0, 0.0, 1.0]}
    if command["cmd"] == "camera":
        answer = {"position": [0.0, -2.0, 1.5], "target": [0.0, 0.0, 1.0]}
    answers.append({"id": command["id"], "ok": answer})
    if command.get("opacity") != 0.222:
        for each in reversed(answers):
            sys.stdout.write(json.dumps(each) + "\n")
        sys.stdout.flush()
        answers.clear()
