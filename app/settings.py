"""Settings of the app at start."""

import getpass
import os
import re
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path

import app
from r2c2r_core.errors import InputError
from r2c2r_core.threads import usable_cores

BUSY_S = 10.0
MEBIBYTE = 1024 * 1024
MAX_UPLOAD_BYTES = 16 * 1024 * MEBIBYTE
DATABASE = "r2c2r.db"  # in the data folder, which it identifies
LOOPBACK = ("127.0.0.1", "localhost", "::1")
_IDENTITIES = {
    "proxy": re.compile(r"[A-Za-z0-9-]{1,80}"),
    "oidc": re.compile(r"https://[^\s/?#]+(/[^\s?#]*)?|http://(localhost|127\.0\.0\.1)(:\d+)?(/[^\s?#]*)?"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Quotas:
    """Quotas of one user; admins are exempt."""

    jobs: int = 20  # waiting or running
    uploads: int = 20  # announced and not finished
    upload_gb: int = 64  # of them
    samples: int = 20
    projects: int = 1000


def quotas_from(wishes: Sequence[str]) -> Quotas:
    """Quotas from `name=number`; raises InputError."""
    names = [each.name for each in fields(Quotas)]
    wanted: dict[str, int] = {}
    for wish in wishes:
        name, _, number = wish.partition("=")
        if name not in names or not number.isdecimal() or len(number) > 9:
            raise InputError(
                f"--quota {wish[:80]!r}: not NAME=N", hint=f"NAME is one of {', '.join(names)}; N is the limit per person"
            )
        wanted[name] = int(number)
    return Quotas(**wanted)


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """One running app. Paths are absolute; sizes in bytes; times in seconds."""

    data_dir: Path
    postgres: str = field(default_factory=lambda: os.environ.get("R2C2R_DATABASE", ""))  # address; empty: a SQLite file
    store: str = field(default_factory=lambda: os.environ.get("R2C2R_STORE", ""))  # of files; empty: the data folder
    cache_gb: str = field(
        default_factory=lambda: os.environ.get("R2C2R_CACHE_GB", "")
    )  # maximum size of a store's cache; empty: unlimited
    log: str = field(default_factory=lambda: os.environ.get("R2C2R_LOG", ""))  # "json": one object per line
    traces: str = field(default_factory=lambda: os.environ.get("R2C2R_TRACES", ""))  # "otlp": sent to a collector
    compute: str = field(default_factory=lambda: os.environ.get("R2C2R_COMPUTE", ""))  # ray; empty: this machine
    identity: str = field(default_factory=lambda: os.environ.get("R2C2R_IDENTITY", ""))  # proxy:HEADER or oidc:ISSUER
    oidc_client: str = field(default_factory=lambda: os.environ.get("R2C2R_OIDC_CLIENT", ""))
    oidc_secret: str = field(default_factory=lambda: os.environ.get("R2C2R_OIDC_SECRET", ""), repr=False)
    oidc_roles: str = field(default_factory=lambda: os.environ.get("R2C2R_OIDC_ROLES", ""))  # group=role,…
    default_role: str = field(default_factory=lambda: os.environ.get("R2C2R_DEFAULT_ROLE", "annotator"))  # on first use
    trusted_proxies: tuple[str, ...] = field(default_factory=lambda: _listed(os.environ.get("R2C2R_TRUSTED_PROXIES", "")))
    webhooks_to: str = field(default_factory=lambda: os.environ.get("R2C2R_WEBHOOKS_TO", ""))  # allowed private networks
    launch_token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    host: str = "127.0.0.1"
    allowed_hosts: tuple[str, ...] = LOOPBACK
    accounts_only: bool = False  # reachable by others: users sign in with accounts, there is no printed key
    import_roots: tuple[Path, ...] = ()
    max_upload_bytes: int = MAX_UPLOAD_BYTES
    upload_kept_s: float = 7 * 24 * 3600.0  # time within which an interrupted upload can be resumed
    max_unpacked_bytes: int = 64 * 1024 * MEBIBYTE
    max_unpacked_files: int = 200_000
    min_free_bytes: int = 512 * MEBIBYTE  # minimum left on the disk when anything starts
    job_memory_bytes: int = 2048 * MEBIBYTE  # minimum free before a job starts: the need of a recording of some minutes
    quotas: Quotas = Quotas()
    heavy_jobs: int = 1
    workers: int = 0  # parallel objects of a job; 0: as many as memory and its share of the cores allow
    job_attempts: int = 3  # tries of a job whose process vanishes without progress
    job_losses: int = 10  # the same when its server vanishes, which is rarely the job's fault
    sharing_costs_s: float = 6.0  # overhead of a stage shared by several seats: two process starts
    beat_s: float = 5.0  # heartbeat interval of a server that shares its database
    beats_missed_s: float = 60.0  # without a heartbeat, another server takes over its jobs
    kill_grace_s: float = 2.0  # between asking a worker to stop and killing it
    live_idle_s: float = 600.0
    viewer_idle_s: float = 600.0
    viewer_answer_s: float = 60.0  # timeout of an answer of the 3D view's process
    viewer_page_s: float = 10.0  # the same for a file of its page, and for its connection
    busy_s: float = BUSY_S  # maximum wait of a request for another writer, before it is refused
    run_jobs: bool = True  # False in tests that do not need the queue
    prepare_imports: bool = True  # prepare newly read recordings for the live segmenter; likewise
    preview_width: int = 960
    user: str = field(default_factory=lambda: _user_name())

    @property
    def workers_a_job(self) -> int:
        """Processes that one job may start; 0: determined by cores and memory."""
        if self.on_ray:  # which reserves this many cores for it
            return self.workers or 1
        shared = max(1, usable_cores() // max(1, self.heavy_jobs))
        return self.workers or (0 if self.heavy_jobs <= 1 else shared)

    @property
    def database(self) -> Path:
        """The SQLite file."""
        return self.data_dir / DATABASE

    @property
    def rows(self) -> Path | str:
        """Location of the rows: the address of a Postgres, or the SQLite file."""
        return self.postgres or self.database

    @property
    def cache_bytes(self) -> int | None:
        """Maximum size of the local cache of a store; None: unlimited. Raises InputError."""
        if self.cache_gb and not self.cache_gb.isdecimal():
            raise InputError(f"R2C2R_CACHE_GB {self.cache_gb[:40]!r}: no whole number", hint="gigabytes, or leave it out")
        return int(self.cache_gb) * 10**9 if self.cache_gb else None

    @property
    def on_ray(self) -> bool:
        """Whether jobs are computed by a Ray cluster; raises InputError."""
        if self.compute not in ("", "ray"):
            raise InputError(f"R2C2R_COMPUTE {self.compute[:40]!r}: not known", hint="ray, or leave it out")
        return self.compute == "ray"

    @property
    def identity_header(self) -> str:
        """The header in which a trusted proxy names the user; empty without one. Raises InputError."""
        return self._identity("proxy")

    @property
    def identity_issuer(self) -> str:
        """The OpenID provider for sign-in; empty for none. Raises InputError."""
        return self._identity("oidc")

    def _identity(self, wanted: str) -> str:
        kind, _, who = self.identity.partition(":")
        if self.identity and (kind not in _IDENTITIES or not _IDENTITIES[kind].fullmatch(who)):
            hint = "proxy:HEADER, such as X-Forwarded-User, or oidc:https://ISSUER"
            raise InputError(f"R2C2R_IDENTITY {self.identity[:80]!r}: not known", hint=hint)
        return who if kind == wanted else ""

    @property
    def uploads(self) -> Path:
        """Folder of unfinished uploads."""
        return self.data_dir / "uploads"

    @property
    def unknown(self) -> Path:
        """Folder of files without a database row, set aside for an admin."""
        return self.data_dir / "unknown"

    @property
    def roots(self) -> tuple[Path, ...]:
        """Folders from which a recording may be imported by path."""
        try:
            home = Path.home()
        except RuntimeError:  # this user has none
            home = self.data_dir
        of_service = home in (self.data_dir, Path(home.anchor))  # not the whole disk
        return self.import_roots or ((self.data_dir,) if of_service else (home, self.data_dir))


def shipped(name: str, marker: str) -> Path:
    """The folder `name` shipped with the app: beside `app/` in a checkout, `app/_<name>` in an installed wheel."""
    package = Path(app.__file__).resolve().parent
    for place in (package.parent / name, package / f"_{name}"):
        if (place / marker).is_file():
            return place
    raise FileNotFoundError(f"{name}/{marker} is neither beside {package} nor in it; reinstall r2c2r")


def _listed(text: str) -> tuple[str, ...]:
    """The comma-separated parts of a text."""
    return tuple(part.strip() for part in text.split(",") if part.strip())


def _user_name() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # a container's numeric user has no name
        return "local"
