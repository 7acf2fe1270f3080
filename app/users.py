"""`r2c2r user` and `r2c2r token`: accounts and tokens from the server's command line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Engine

from app import schemas
from app.db.engine import opened
from app.services import accounts, tokens
from app.settings import DATABASE, Settings
from r2c2r_core.disk import keep_private, resolved


def add(data_dir: Path, name: str, role: str, password: str) -> None:
    """Add an account."""
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
    """Change an account's role."""
    with _engine(data_dir) as engine:
        accounts.change(engine, name, role=role)


def set_password(data_dir: Path, name: str, password: str) -> None:
    """Change an account's password and end its sessions."""
    with _engine(data_dir) as engine:
        accounts.change(engine, name, password=password)


def add_token(data_dir: Path, owner: str | None, name: str, scope: str) -> str:
    """Create a token and return its secret."""
    with _engine(data_dir) as engine:
        return tokens.add(engine, owner, name, scope)[0]


def tokens_of(data_dir: Path) -> list[schemas.ApiToken]:
    """Tokens of all users."""
    with _engine(data_dir) as engine:
        return tokens.everyone(engine)


def revoke_token(data_dir: Path, number: int) -> None:
    """Revoke a token."""
    with _engine(data_dir) as engine:
        tokens.revoke(engine, number)


@contextmanager
def _engine(data_dir: Path) -> Iterator[Engine]:
    settings = Settings(data_dir=resolved(data_dir))
    keep_private(settings.data_dir, DATABASE)
    with opened(settings.rows) as engine:
        yield engine
