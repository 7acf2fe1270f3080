r"""Serve any generator of this project over HTTP, for the `remote` generator of another machine.

On the machine with the GPU, in the model's own Python environment with this package beside it:

    pip install --no-deps r2c2r && pip install numpy scipy opencv-python-headless trimesh open3d-cpu manifold3d \
        scikit-image fast-simplification xatlas pillow jaxtyping networkx
    hf download microsoft/TRELLIS-image-large
    export R2C2R_WORKER_TOKEN=$(openssl rand -hex 16)
    SPCONV_ALGO=native python -m r2c2r_core.generate.serve_worker --generator trellis --host 0.0.0.0 --port 9000

and where the pipeline runs:

    export R2C2R_GENERATOR_URL=http://gpu-machine:9000/v1/mesh R2C2R_GENERATOR_TOKEN=…the same…
    r2c2r run scan.r3d --prompts prompts.json --generator remote -o kitchen.zip

The protocol is in remote.py, the request in wire.py. The model is loaded before the port opens; one mesh is made at a
time, up to 32 requests wait. Without a token only 127.0.0.1 is served. The traffic is plain HTTP: put a TLS proxy or a
tunnel before it on a network you do not own.
"""

import argparse
import hmac
import json
import logging
import os
import sys
from collections.abc import Callable, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from r2c2r_core.errors import EnvironmentProblem, InputError, R2C2RError
from r2c2r_core.generate.jobs import Jobs, Make
from r2c2r_core.generate.stage import GENERATORS, GenerateConfig, load_generator
from r2c2r_core.generate.wire import decode_wish

log = logging.getLogger(__name__)

MOST_REQUEST_BYTES = 400_000_000  # 20 views of 1024 px with their depth are some 40 MB
_LOCAL = ("127.0.0.1", "localhost", "::1")
_SILENT_AFTER_S = 60.0  # a client that stops sending is dropped


def main(arguments: Sequence[str] | None = None) -> int:
    """Load the generator and serve until interrupted; 0 done, 1 failed, 2 wrong usage."""
    parser = argparse.ArgumentParser(prog="r2c2r_core.generate.serve_worker", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--generator", required=True, choices=[b.name for b in GENERATORS.backends if b.name != "remote"])
    parser.add_argument("--weights", default="", help="folder or hub id, for a generator with weights")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9000)
    options = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(message)s")
    try:
        backend = load_generator(options.generator, GenerateConfig(weights=options.weights))
        server = open_server(
            lambda wish, progress: backend.make(*wish),
            name=options.generator,
            address=(options.host, options.port),
            token=os.environ.get("R2C2R_WORKER_TOKEN", ""),
        )
    except R2C2RError as error:
        sys.stderr.write(f"serve_worker: {error}\n")
        return error.exit_code
    log.info(
        "%s (%s) at http://%s:%s/v1/mesh", options.generator, GENERATORS.get(options.generator).licence, *server.server_address
    )
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        server.server_close()
    return 0


def open_server(make: Make, *, name: str, address: tuple[str, int], token: str) -> ThreadingHTTPServer:
    """A bound server, not yet serving.

    Raises InputError for an address open to others without a token, EnvironmentProblem for a taken one.
    """
    if not token and address[0] not in _LOCAL:
        raise InputError(f"{address[0]} is open to others and there is no token", hint="set R2C2R_WORKER_TOKEN")
    jobs = Jobs(make)

    class Bound(_Handler):
        pass

    Bound.jobs, Bound.token, Bound.generator = jobs, token, name
    try:
        return ThreadingHTTPServer(address, Bound)
    except OSError as error:
        raise EnvironmentProblem(
            f"{address[0]}:{address[1]}: {error.strerror or error}", hint="choose another --port"
        ) from error


class _Handler(BaseHTTPRequestHandler):
    """Handler of one request, subclassed with the worker's jobs and token, as http.server creates a handler per connection."""

    jobs: Jobs
    token: str
    generator: str
    timeout = _SILENT_AFTER_S

    def do_GET(self) -> None:  # the name http.server calls
        self._answer(self._get)

    def do_POST(self) -> None:
        self._answer(self._post)

    def do_DELETE(self) -> None:
        self._answer(self._delete)

    def log_message(self, format: str, *args: Any) -> None:  # the base class's signature
        log.info("%s %s", self.address_string(), format % args)

    def _answer(self, serve: Callable[[], None]) -> None:
        given = self.headers.get("Authorization", "")
        if self.token and not hmac.compare_digest(given.encode(), f"Bearer {self.token}".encode()):
            self._say(401, {"error": "a bearer token is expected"})
            return
        serve()

    def _get(self) -> None:
        if self.path == "/v1/health":
            self._say(200, {"generator": self.generator, "licence": GENERATORS.get(self.generator).licence, "version": 1})
            return
        identity, _, rest = self.path.removeprefix("/v1/jobs/").partition("/")
        job = self.jobs.find(identity) if self.path.startswith("/v1/jobs/") else None
        if job is None or rest not in ("", "artifacts/0"):
            self._say(404, {"error": "no such job"})
        elif not rest:
            self._say(200, job.to_json())
        elif job.glb:
            self._send(200, "model/gltf-binary", job.glb)
        else:
            self._say(404, {"error": f"the job is {job.state}"})

    def _post(self) -> None:
        if self.path != "/v1/mesh":
            self._say(404, {"error": "POST /v1/mesh expected"})
            return
        length = self.headers.get("Content-Length", "")
        if not length.isdigit():
            self._say(411, {"error": "a Content-Length is expected"})
            return
        if int(length) > MOST_REQUEST_BYTES:
            self._say(413, {"error": f"{int(length)} bytes, at most {MOST_REQUEST_BYTES} expected"})
            return
        try:
            wish = decode_wish(self.headers.get("Content-Type", ""), self.rfile.read(int(length)))
        except InputError as error:
            self._say(422, {"error": str(error)})
            return
        identity = self.jobs.add(wish)
        if identity is None:
            self._say(503, {"error": "too many requests wait"}, retry_after=10)
        else:
            self._say(202, {"job": identity})

    def _delete(self) -> None:
        known = self.path.startswith("/v1/jobs/") and self.jobs.cancel(self.path.removeprefix("/v1/jobs/"))
        self._say(200 if known else 404, {"cancelled": known})

    def _say(self, status: int, document: dict[str, Any], *, retry_after: int | None = None) -> None:
        self._send(status, "application/json", json.dumps(document).encode(), retry_after=retry_after)

    def _send(self, status: int, kind: str, content: bytes, *, retry_after: int | None = None) -> None:
        self.close_connection = True  # also where a body was refused unread
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        if retry_after is not None:
            self.send_header("Retry-After", str(retry_after))
        self.end_headers()
        self.wfile.write(content)


if __name__ == "__main__":
    sys.exit(main())
