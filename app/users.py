"""`r2c2r user`: accounts, from the command line of the machine that serves them."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Engine

from app.db.engine import open_engine
from app.services import accounts
from app.settings import Settings


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
        accounts.set_role(engine, name, role)


def set_password(data_dir: Path, name: str, password: str) -> None:
    """Another password; the account's sessions end."""
    with _engine(data_dir) as engine:
        accounts.set_password(engine, name, password)


@contextmanager
def _engine(data_dir: Path) -> Iterator[Engine]:
    engine = open_engine(Settings(data_dir=data_dir.expanduser().resolve()).database)
    try:
        yield engine
    finally:
        engine.dispose()
