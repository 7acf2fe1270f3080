"""`r2c2r user`: accounts, from the command line of the machine that serves them."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Engine

from app.db.engine import opened
from app.services import accounts
from app.settings import DATABASE, Settings
from r2c2r_core.disk import keep_private, resolved


def add(data_dir: Path, name: str, role: str, password: str) -> None:
    """A new account."""
    with _engine(data_dir) as engine:
        accounts.add(engine, name, role, password)


def everyone(data_dir: Path) -> list[tuple[str, str]]:
    """(name, role) of all accounts."""
    with _engine(data_dir) as engine:
        return [(person.name, person.role) for person in accounts.everyone(engine)]


def remove(data_dir: Path, name: str) -> None:
    """Delete an account and end its sessions."""
    with _engine(data_dir) as engine:
        accounts.remove(engine, name)


def set_role(data_dir: Path, name: str, role: str) -> None:
    """Another role."""
    with _engine(data_dir) as engine:
        accounts.change(engine, name, role=role)


def set_password(data_dir: Path, name: str, password: str) -> None:
    """Another password; the account's sessions end."""
    with _engine(data_dir) as engine:
        accounts.change(engine, name, password=password)


@contextmanager
def _engine(data_dir: Path) -> Iterator[Engine]:
    settings = Settings(data_dir=resolved(data_dir))
    keep_private(settings.data_dir, DATABASE)
    with opened(settings.database) as engine:
        yield engine
