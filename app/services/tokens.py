"""API tokens: shown once, stored as a hash, limited to their user's rights, revocable.

A token acts for its account with the lesser of the account's current role and the token's scope, and appears in the history
under the account's name.
"""

import contextlib
import hashlib
import secrets
import time

from sqlalchemy import Engine
from sqlmodel import Session, col, select

from app import schemas
from app.db.engine import reading, writing
from app.db.tables import Account, ApiToken
from app.errors import Forbidden, NotFound
from app.security import ROLES, TOKEN_PREFIX, Person, Role, TokenScope
from app.services import accounts, audit
from app.settings import Settings
from r2c2r_core.errors import InputError, R2C2RError

SCOPES: tuple[TokenScope, ...] = ("metrics", "read", *ROLES)
USED_S = 60.0  # resolution of the last-used time
MOST = 50  # of one account


def add(
    engine: Engine, owner: str | None, name: str, scope: str, *, by: str = audit.COMMAND_LINE
) -> tuple[str, schemas.ApiToken]:
    """Create a token of an account, or, without one, of the user who starts the server; returns the secret only once.

    Raises InputError for an unknown scope or too many tokens, Forbidden for a scope beyond the account's role.
    """
    secret = TOKEN_PREFIX + secrets.token_urlsafe(32)
    with writing(engine) as session:
        account = accounts.row(session, owner) if owner is not None else None
        _check_scope(scope, account)
        account_id = account.id if account else None
        if len(session.exec(select(ApiToken.id).where(ApiToken.account_id == account_id)).all()) >= MOST:
            raise InputError(f"there are already {MOST} tokens", hint="revoke unused ones")
        row = ApiToken(digest=_digest(secret), account_id=account_id, name=name, scope=scope, created=time.time())
        session.add(row)
        session.flush()
        audit.note(session, "token made", account=account.name if account else "", who=by, detail=f"{name}: {scope}")
        return secret, _shape(row, account)


def everyone(engine: Engine, *, of: str | None = None) -> list[schemas.ApiToken]:
    """The tokens of an account, or of all, oldest first."""
    with reading(engine) as session:
        query = select(ApiToken, Account).join(Account, isouter=True).order_by(col(ApiToken.id))
        if of is not None:
            query = query.where(Account.name == of)
        return [_shape(row, account) for row, account in session.exec(query)]


def revoke(engine: Engine, number: int, *, of: str | None = None, by: str = audit.COMMAND_LINE) -> None:
    """Revoke a token; raises NotFound for an unknown one, or, with `of`, for another account's."""
    with writing(engine) as session:
        row = session.get(ApiToken, number)
        account = session.get(Account, row.account_id) if row is not None and row.account_id is not None else None
        if row is None or (of is not None and (account is None or account.name != of)):
            raise NotFound(f"no token {number}", hint="r2c2r token list")
        session.delete(row)
        audit.note(session, "token revoked", account=account.name if account else "", who=by, detail=f"{row.name}: {row.scope}")


def person_of(engine: Engine, settings: Settings, secret: str) -> Person | None:
    """The token's user with its scope; None for an invalid token."""
    with reading(engine) as session:
        query = select(ApiToken, Account).join(Account, isouter=True).where(ApiToken.digest == _digest(secret))
        found = session.exec(query).first()
    if found is None:
        return None
    token, account = found
    if account is None and settings.accounts_only:
        return None
    if time.time() - (token.used or 0.0) > USED_S:
        with contextlib.suppress(R2C2RError), writing(engine) as session:  # a full disk must not prevent access
            _note_used(session, token.id or 0)
    whole = accounts.person(account) if account else Person(settings.user, "admin")
    return _narrowed(whole, token.scope)


def _narrowed(person: Person, scope: str) -> Person:
    """The user with rights limited to the token's scope."""
    known, reach = _known(scope), _role_of(scope) or ROLES[0]
    return Person(person.name, min(person.role, reach, key=ROLES.index), account=person.account, scope=known)


def _check_scope(scope: str, account: Account | None) -> None:
    role, reach = accounts.person(account).role if account else ROLES[-1], _role_of(_known(scope))
    if reach is not None and ROLES.index(reach) > ROLES.index(role):
        raise Forbidden(f"the scope {scope} allows more than the role {role}", hint=f"at most {role}")
    if scope == "metrics" and role != "admin":
        raise Forbidden("only admins may read metrics", hint="ask an admin of this server")


def _known(scope: str) -> TokenScope:
    for known in SCOPES:
        if scope == known:
            return known
    raise InputError(f"{scope!r} is no scope", hint=f"one of {', '.join(SCOPES)}")


def _role_of(scope: str) -> Role | None:
    """The role of a scope, or None."""
    return next((role for role in ROLES if role == scope), None)


def _note_used(session: Session, number: int) -> None:
    row = session.get(ApiToken, number)
    if row is not None:
        row.used = time.time()
        session.add(row)


def _shape(row: ApiToken, account: Account | None) -> schemas.ApiToken:
    facts = row.model_dump(include={"id", "name", "scope", "created", "used"})
    return schemas.ApiToken(**facts, owner=account.name if account else "")


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()
