"""`r2c2r serve`: runs the app on a port, and registers finished workspaces as projects."""

import contextlib
import errno
import gc
import ipaddress
import json
import socket
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import psutil
import uvicorn
from fastapi import FastAPI
from sqlalchemy import Engine
from sqlmodel import select
from uvicorn.config import LOGGING_CONFIG

from app.db import queries
from app.db.engine import opened, reading, writing
from app.db.tables import Project
from app.db.usable import require_projects_known
from app.files import folder_bytes, only_server, project_files, running_server
from app.jobs.outcomes import adopt_bundle, adopt_capture, adopt_prompts, keep_bundle
from app.logs import log_as
from app.main import create_app, let_go
from app.services import accounts, launch_keys
from app.services.adopting import adopt_all
from app.services.oidc import Provider
from app.services.projects import new_project
from app.settings import DATABASE, LOOPBACK, MAX_UPLOAD_BYTES, Quotas, Settings
from app.store.usable import require_store
from r2c2r_core.disk import keep_private, resolved
from r2c2r_core.errors import EnvironmentProblem, InputError


def serve(
    *,
    host: str,
    port: int,
    data_dir: Path,
    names: Sequence[str] = (),
    open_project: str | None = None,
    heavy_jobs: int = 1,
    workers: int = 0,
    max_upload_bytes: int = MAX_UPLOAD_BYTES,
    behind_proxy: Sequence[str] = (),
    quotas: Quotas = Quotas(),  # frozen
    adopt: bool = False,
    import_from: Sequence[Path] = (),
) -> None:
    """Run the app until it is stopped; the address is printed first, with a key if it is only reachable from this machine.

    `names` are host names of the server, where they differ from its listening address; `behind_proxy` are addresses or
    networks of proxies trusted for the client address, the user and TLS. `adopt` makes projects of folders that are not in
    the database, and a new database where there is none. `import_from` are folders from which recordings may be imported by
    path, in addition to the home folder.
    """
    data_dir = resolved(data_dir)
    proxies = tuple(_network(address) for address in (*behind_proxy, *Settings(data_dir=data_dir).trusted_proxies))
    settings = _settings(data_dir, host, names, proxies)
    _check_identity(settings)
    settings = replace(settings, heavy_jobs=heavy_jobs, workers=workers, max_upload_bytes=max_upload_bytes, quotas=quotas)
    settings = replace(settings, import_roots=(*settings.roots, *(resolved(folder) for folder in import_from)))
    if heavy_jobs == 0 and not settings.postgres:
        raise InputError(
            "--jobs 0: other machines cannot take jobs from a SQLite file", hint="leave it out, or set R2C2R_DATABASE"
        )
    if settings.log:
        log_as(settings.log)
    require_store(settings)
    keep_private(data_dir, DATABASE)
    with only_server(data_dir) as announce, _bound(host, port) as listening:
        with opened(settings.rows, anew=adopt) as engine:  # errors in it are reported before the address is printed
            if adopt:
                sys.stderr.writelines(f"r2c2r: {line}\n" for line in adopt_all(engine, data_dir, settings.user))
            elif settings.postgres:
                require_projects_known(engine, data_dir)
            if settings.accounts_only and not settings.identity:
                _require_accounts(engine, proxies)
            launch_keys.forget(engine)
        address = f"http://{names[0] if names else _shown_host(host)}:{listening.getsockname()[1]}"
        announce({"address": address, "accounts_only": settings.accounts_only})
        page = f"/p/{open_project}" if open_project else "/"
        key = "" if settings.accounts_only else f"?token={settings.launch_token}"
        sys.stdout.write(f"r2c2r: {address}{page}{key}\n")
        sys.stdout.flush()
        app = create_app(settings)
        config = uvicorn.Config(
            app,
            log_level="warning",
            ws_per_message_deflate=False,  # scenes and masks are compressed or incompressible, so it would only cost time
            timeout_graceful_shutdown=3,
            server_header=False,
            proxy_headers=False,  # the app handles trusted proxies itself
            log_config=None if settings.log else LOGGING_CONFIG,  # None: its loggers use the same handler as all others
        )
        _Server(config, app).run(sockets=[listening])


class _Server(uvicorn.Server):
    """Server that ends the waits of its requests before waiting for the requests."""

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        super().__init__(config)
        self._app = app

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start serving."""
        await super().startup(sockets)
        keep_what_started()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop within seconds."""
        await let_go(self._app)
        await super().shutdown(sockets)


def keep_what_started() -> None:
    """Freeze existing objects out of garbage collection, which otherwise takes 0.1 s of a request, and collect less often."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000)  # new objects, not 700: saves a sixth of the processor time of the app's tests


def new_address(data_dir: Path) -> str:
    """A new one-time sign-in address of the server running on this folder."""
    data_dir = resolved(data_dir)
    running = running_server(data_dir)
    if running is None:
        raise EnvironmentProblem(f"{data_dir}: no r2c2r serves this folder", hint="r2c2r serve prints an address")
    if running["accounts_only"]:
        hint = "open its address and sign in; r2c2r user password NAME sets a new password"
        raise EnvironmentProblem("people sign in to this server by name and password", hint=hint)
    with opened(Settings(data_dir=data_dir).rows) as engine:
        return f"{running['address']}/?token={launch_keys.new(engine)}"


def register_finished(data_dir: Path, *, name: str, source: Path, prompts: Path, workdir: Path) -> str:
    """Register a finished workspace as a project, in place and only once, and return its id."""
    from app.jobs.ingest import describe
    from r2c2r_core.segment.prompts import checked_prompts
    from r2c2r_core.workspace import Workspace, write_atomically

    data_dir, workdir = resolved(data_dir), resolved(workdir)
    capture = Workspace(workdir).load_latest("ingest", "scene")
    if capture is None:
        raise InputError(f"{workdir}: holds no finished run", hint="run it first")
    settings = Settings(data_dir=data_dir)
    with opened(settings.rows) as engine:
        with writing(engine) as session:
            found = session.exec(select(Project).where(Project.work_path == str(workdir))).first()
            project = found or new_project(session, name, source.name, source.resolve(), workdir)
            project.trashed = None
            files = project_files(data_dir, project.id, project.work_path)
            files.root.mkdir(parents=True, exist_ok=True)
            describe(capture, files.root, source.resolve())
            document = json.loads(prompts.read_text())
            write_atomically(files.finished_prompts, json.dumps(document).encode())
            adopt_capture(project, files)
            if found is None:
                adopt_prompts(session, project, checked_prompts(document), settings.user)
            session.add(project)
        if (workdir / "bundle.zip").is_file():
            with reading(engine) as session:
                kept = keep_bundle(session, project, files)
            with writing(engine) as session:
                adopt_bundle(session, session.get_one(Project, project.id), project.inputs, kept)
        with writing(engine) as session:
            queries.note_size(session, project.id, folder_bytes(files.root))
    return project.id


def require_database(data_dir: Path) -> None:
    """Raise DatabaseUnusable for an unusable database, before long computations start."""
    settings = Settings(data_dir=resolved(data_dir))
    keep_private(settings.data_dir, DATABASE)
    with opened(settings.rows):
        pass


def _settings(data_dir: Path, host: str, names: Sequence[str], proxies: tuple[str, ...]) -> Settings:
    called = (*LOOPBACK, *(name.lower() for name in names))
    settings = Settings(data_dir=data_dir, host=host, allowed_hosts=called, trusted_proxies=proxies)
    if _is_loopback(host) and not names and not proxies:
        return settings
    reached = (*settings.allowed_hosts, host, socket.gethostname().lower(), *_own_addresses())
    return replace(settings, accounts_only=True, allowed_hosts=reached)


def _check_identity(settings: Settings) -> None:
    """Raise InputError where no proxy could be trusted to identify users, or no role assigned."""
    if settings.identity_header and not settings.trusted_proxies:
        hint = "name the proxy with R2C2R_TRUSTED_PROXIES=ADDRESS or --behind-proxy ADDRESS"
        raise InputError(f"R2C2R_IDENTITY {settings.identity}: no proxy is trusted", hint=hint)
    accounts.known_role(settings.default_role)
    if settings.identity_issuer:
        Provider(settings)


def _require_accounts(engine: Engine, proxies: Sequence[str]) -> None:
    if not accounts.everyone(engine):
        raise EnvironmentProblem(
            "this address can be reached from other machines, and nobody has an account",
            hint="make one first: r2c2r user add NAME --role admin; or bind 127.0.0.1 and tunnel with ssh -L",
        )
    if not proxies:
        sys.stderr.write(
            "r2c2r: passwords and scans cross the network unencrypted; put the server behind a TLS proxy and name it with "
            "--behind-proxy ADDRESS, otherwise all requests seem to come from one address\n"
        )


def _own_addresses() -> list[str]:
    """All addresses of this machine, for a server listening on all of them."""
    found = (address.address for addresses in psutil.net_if_addrs().values() for address in addresses)
    return [address.split("%")[0].lower() for address in found if address[:1].isalnum()]


def _network(address: str) -> str:
    """A proxy's address or network, validated and unchanged."""
    try:
        return str(ipaddress.ip_network(address) if "/" in address else ipaddress.ip_address(address))
    except ValueError as error:
        raise InputError(
            f"--behind-proxy or R2C2R_TRUSTED_PROXIES {address}: {error}",
            hint="the address from which the proxy connects: 127.0.0.1",
        ) from error


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _shown_host(host: str) -> str:
    return f"[{host}]" if ":" in host else host


@contextlib.contextmanager
def _bound(host: str, port: int) -> Iterator[socket.socket]:
    """A listening socket; a taken port gives a one-line error."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        try:
            listening.bind((host, port))
        except (TypeError, UnicodeError) as error:  # a name that IDNA cannot encode
            raise EnvironmentProblem(
                f"cannot listen on {host[:60]!r}: not a host name or address", hint="check --host"
            ) from error
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                hint = f"stop the program that uses it, or choose another port: --port {port + 1}"
                raise EnvironmentProblem(f"port {port} is taken", hint=hint) from error
            hint = "choose a port above 1023" if error.errno == errno.EACCES else "check --host and --port"
            raise EnvironmentProblem(f"cannot listen on {host}:{port}: {error.strerror}", hint=hint) from error
        listening.listen(128)
        listening.set_inheritable(False)
        yield listening
    finally:
        listening.close()
