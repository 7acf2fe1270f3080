"""What the app is told when it starts."""

import getpass
import os
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path

import app
from r2c2r_core.errors import InputError

MEBIBYTE = 1024 * 1024
MAX_UPLOAD_BYTES = 16 * 1024 * MEBIBYTE
DATABASE = "r2c2r.db"  # in the data folder; by it the folder is known to be one
LOOPBACK = ("127.0.0.1", "localhost", "::1")


@dataclass(frozen=True, slots=True, kw_only=True)
class Quotas:
    """What one person may take at a time; admins take more."""

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
                f"--quota {wish[:80]!r}: not NAME=N", hint=f"NAME is one of {', '.join(names)}; N is what one may have"
            )
        wanted[name] = int(number)
    return Quotas(**wanted)


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """One running app. Paths are absolute; sizes in bytes; times in seconds."""

    data_dir: Path
    launch_token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    host: str = "127.0.0.1"
    allowed_hosts: tuple[str, ...] = LOOPBACK
    accounts_only: bool = False  # others can reach it: the printed key opens nothing, people sign in
    import_roots: tuple[Path, ...] = ()
    max_upload_bytes: int = MAX_UPLOAD_BYTES
    upload_kept_s: float = 7 * 24 * 3600.0  # an upload that stopped may go on for this long
    max_unpacked_bytes: int = 64 * 1024 * MEBIBYTE
    max_unpacked_files: int = 200_000
    min_free_bytes: int = 512 * MEBIBYTE  # left on the disk when anything starts
    job_memory_bytes: int = 2048 * MEBIBYTE  # free before a job starts: what a kitchen of a recording of minutes takes
    quotas: Quotas = Quotas()
    heavy_jobs: int = 1
    workers: int = 0  # objects of a job side by side; 0: as cores, shared by the heavy jobs, and memory allow
    job_attempts: int = 3  # how often a job whose process vanishes is begun without getting further
    job_losses: int = 10  # the same when its server vanishes, which is hardly the job's doing
    kill_grace_s: float = 2.0  # between asking a worker to stop and stopping it
    live_idle_s: float = 600.0
    viewer_idle_s: float = 600.0
    run_jobs: bool = True  # tests of other things leave the queue alone
    preview_width: int = 960
    user: str = field(default_factory=lambda: _user_name())

    @property
    def workers_a_job(self) -> int:
        """Processes that one job may start; 0 leaves it to the cores and the memory that are there."""
        shared = max(1, len(os.sched_getaffinity(0)) // self.heavy_jobs)
        return self.workers or (0 if self.heavy_jobs == 1 else shared)

    @property
    def database(self) -> Path:
        """The SQLite file."""
        return self.data_dir / DATABASE

    @property
    def uploads(self) -> Path:
        """Recordings on their way in."""
        return self.data_dir / "uploads"

    @property
    def unknown(self) -> Path:
        """What lay in the data folder without a row: set aside for an admin."""
        return self.data_dir / "unknown"

    @property
    def roots(self) -> tuple[Path, ...]:
        """Folders a recording may be taken from by path."""
        return self.import_roots or (Path.home(), self.data_dir)


def default_data_dir() -> Path:
    """Where projects live unless someone says otherwise; the command line says the same."""
    return Path(os.environ.get("R2C2R_DATA", Path.home() / ".local" / "share" / "r2c2r")).expanduser().resolve()


def shipped(name: str, marker: str) -> Path:
    """The folder `name` that travels with the app: beside `app/` in a checkout, `app/_<name>` in an installed wheel."""
    package = Path(app.__file__).resolve().parent
    for place in (package.parent / name, package / f"_{name}"):
        if (place / marker).is_file():
            return place
    raise FileNotFoundError(f"{name}/{marker} is neither beside {package} nor in it; reinstall r2c2r")


def _user_name() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # a container's numeric user has no name
        return "local"
