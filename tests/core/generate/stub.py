"""HTTP server on a thread with responses given by the test; it records the requests."""

import contextlib
import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import trimesh
from PIL import Image

from r2c2r_core.generate.exchange import Patience
from tests.waiting import PATIENCE_S

QUICK = Patience(connect_s=PATIENCE_S, answer_s=PATIENCE_S, leave_s=PATIENCE_S, tries=3, first_wait_s=0.05)


@contextlib.contextmanager
def serving(server):
    """Run the server; yields its base address."""
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextlib.contextmanager
def answering(answer):
    """Server whose `answer(method, path, headers, body)` gives (status, headers, body); yields its address and requests."""
    asked = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            asked.append((self.command, self.path, dict(self.headers), body))
            status, headers, content = answer(*asked[-1])
            self.send_response(status)
            for name, value in {"Content-Length": str(len(content)), **headers}.items():
                self.send_header(name, value)
            self.end_headers()
            with contextlib.suppress(OSError):
                self.wfile.write(content)

        do_GET = do_DELETE = do_POST  # noqa: N815  # the names http.server calls

        def log_message(self, *args):
            pass

    with serving(ThreadingHTTPServer(("127.0.0.1", 0), Handler)) as address:
        yield address, asked


def said(status, document, **headers):
    return status, headers, json.dumps(document).encode()


def box_glb(sides=(0.4, 0.3, 0.2)):
    """GLB as TRELLIS's post-processing returns it: one textured geometry, seams cut open, +Y up."""
    return textured_box(sides).export(file_type="glb")


def textured_box(sides=(0.4, 0.3, 0.2)):
    box = trimesh.creation.box(sides)
    box.unmerge_vertices()
    uv = np.tile([[0.1, 0.1], [0.9, 0.1], [0.9, 0.9]], (len(box.faces), 1))
    picture = np.zeros((32, 32, 3), np.uint8)
    picture[:, :16], picture[:, 16:] = (200, 10, 10), (10, 10, 200)
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(picture))
    box.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    return box
