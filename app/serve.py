"""`r2c2r serve`: the app on a port, and finished workspaces as projects."""

import contextlib
import errno
import fcntl
import ipaddress
import json
import os
import socket
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import psutil
import uvicorn
from sqlmodel import select

from app.db.documents import inputs_key
from app.db.engine import open_engine, writing
from app.db.tables import Project
from app.files import project_files
from app.jobs.outcomes import adopt_bundle, adopt_capture, adopt_prompts
from app.main import create_app
from app.services import accounts
from app.services.projects import new_project
from app.settings import LOOPBACK, MAX_UPLOAD_BYTES, Settings
from r2c2r_core.errors import EnvironmentProblem, InputError


def serve(
    *,
    host: str,
    port: int,
    data_dir: Path,
    names: Sequence[str] = (),
    open_project: str | None = None,
    heavy_jobs: int = 1,
    max_upload_bytes: int = MAX_UPLOAD_BYTES,
) -> None:
    """Run the app until it is stopped; the address is printed first, with its key when only this machine reaches it.

    `names` are host names by which people reach it, where they differ from the address it listens on.
    """
    data_dir = data_dir.expanduser().resolve()
    settings = replace(_settings(data_dir, host, names), heavy_jobs=heavy_jobs, max_upload_bytes=max_upload_bytes)
    with _only_server(data_dir), _bound(host, port) as listening:
        if settings.accounts_only:
            _require_accounts(settings)
        address = f"http://{names[0] if names else _shown_host(host)}:{listening.getsockname()[1]}"
        page = f"/p/{open_project}" if open_project else "/"
        key = "" if settings.accounts_only else f"?token={settings.launch_token}"
        sys.stdout.write(f"r2c2r: {address}{page}{key}\n")
        sys.stdout.flush()
        config = uvicorn.Config(
            create_app(settings),
            log_level="warning",
            ws_per_message_deflate=False,  # scenes and masks are compressed or not compressible: it only costs time
            timeout_graceful_shutdown=3,
            server_header=False,
        )
        uvicorn.Server(config).run(sockets=[listening])


def register_finished(data_dir: Path, *, name: str, source: Path, prompts: Path, workdir: Path) -> str:
    """A finished workspace as a project, read where it is; the same workspace is the same project. Returns its id."""
    from app.jobs.ingest import describe
    from r2c2r_core.workspace import Workspace

    data_dir, workdir = data_dir.expanduser().resolve(), workdir.resolve()
    capture = Workspace(workdir).load_latest("ingest", "scene")
    if capture is None:
        raise InputError(f"{workdir}: holds no finished run", hint="run it first")
    settings = Settings(data_dir=data_dir)
    engine = open_engine(settings.database)
    try:
        with writing(engine) as session:
            found = session.exec(select(Project).where(Project.work_path == str(workdir))).first()
            project = found or new_project(session, name, source.name, source.resolve(), workdir)
            files = project_files(data_dir, project.id, project.work_path)
            files.root.mkdir(parents=True, exist_ok=True)
            describe(capture, files.root, source.resolve())
            document = json.loads(prompts.read_text())
            files.finished_prompts.write_text(json.dumps(document))
            adopt_capture(project, files)
            if found is None:
                adopt_prompts(session, project, document, settings.user)
            if (workdir / "bundle.zip").is_file():
                adopt_bundle(session, project, files, inputs_key(session, project.id))
            session.add(project)
            return project.id
    finally:
        engine.dispose()


def _settings(data_dir: Path, host: str, names: Sequence[str]) -> Settings:
    try:
        data_dir.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentProblem(f"{data_dir}: {error.strerror}", hint="choose another folder with --data") from error
    settings = Settings(data_dir=data_dir, host=host, allowed_hosts=(*LOOPBACK, *(name.lower() for name in names)))
    if _is_loopback(host) and not names:
        return settings
    reached = (*settings.allowed_hosts, host, socket.gethostname().lower(), *_own_addresses())
    return replace(settings, accounts_only=True, allowed_hosts=reached)


def _require_accounts(settings: Settings) -> None:
    engine = open_engine(settings.database)
    try:
        if not accounts.everyone(engine):
            raise EnvironmentProblem(
                "this address can be reached from other machines, and nobody has an account",
                hint="make one first: r2c2r user add NAME --role admin; or bind 127.0.0.1 and tunnel with ssh -L",
            )
    finally:
        engine.dispose()
    sys.stderr.write("r2c2r: passwords and scans cross the network as they are; put it behind a proxy that speaks TLS\n")


def _own_addresses() -> list[str]:
    """Addresses of this machine: who listens on all of them is called by any."""
    found = (address.address for addresses in psutil.net_if_addrs().values() for address in addresses)
    return [address.split("%")[0].lower() for address in found if address[:1].isalnum()]


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _shown_host(host: str) -> str:
    return f"[{host}]" if ":" in host else host


@contextlib.contextmanager
def _only_server(data_dir: Path) -> Iterator[None]:
    """Hold the data folder against a second server: two queues on one table would run jobs twice."""
    with (data_dir / "server.lock").open("a+") as handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            handle.seek(0)
            owner = handle.read(20).strip() or "unknown"
            raise EnvironmentProblem(
                f"{data_dir}: another r2c2r serves this folder (process {owner})", hint="use that one, or another --data"
            ) from error
        handle.truncate(0)
        handle.write(str(os.getpid()))
        handle.flush()
        yield


@contextlib.contextmanager
def _bound(host: str, port: int) -> Iterator[socket.socket]:
    """A listening socket; a taken port is said in one line."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        try:
            listening.bind((host, port))
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                hint = f"stop what uses it, or choose another one: --port {port + 1}"
                raise EnvironmentProblem(f"port {port} is taken", hint=hint) from error
            hint = "choose a port above 1023" if error.errno == errno.EACCES else "check --host and --port"
            raise EnvironmentProblem(f"cannot listen on {host}:{port}: {error.strerror}", hint=hint) from error
        listening.listen(128)
        listening.set_inheritable(False)
        yield listening
    finally:
        listening.close()
