"""Who is here: the browsers that were let in, by the printed key or by a password."""

import asyncio
import contextlib
import hashlib
import hmac
import secrets
import time

import anyio
from sqlalchemy import Engine
from sqlmodel import col, delete, select

from app.db.engine import reading, writing
from app.db.tables import Account, SignIn
from app.errors import Conflict, Forbidden, Unauthorised
from app.security import Person
from app.services import accounts
from app.services.attempts import Attempts
from app.settings import Settings
from r2c2r_core.errors import R2C2RError

KEPT_S = 30 * 24 * 3600.0  # since it was last used
REMEMBERED_S = 2.0  # a person is looked up again after this: `r2c2r user` changes the file from another process
LOOK_UPS = 4  # at a time, in threads of their own: slow requests take those of requests


class People:
    """Signs in, signs out, and knows whose a session is. Every method may be called from any thread."""

    def __init__(self, engine: Engine, settings: Settings) -> None:
        self._engine, self._settings = engine, settings
        self._attempts = Attempts()
        self._known: dict[str, tuple[float, Person]] = {}
        self._threads = anyio.CapacityLimiter(LOOK_UPS)
        self._changes = 0  # so that what was read before a change is not remembered after it
        self._waiting: set[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = set()

    async def of(self, session_id: str) -> Person | None:
        """Whose session it is; None when nobody's. Nobody else waits for the database meanwhile."""
        found = self._known.get(session_id)
        if found is not None and time.monotonic() < found[0]:
            return found[1]
        return await anyio.to_thread.run_sync(self._look_up, session_id, limiter=self._threads)

    async def until_other(self, session_id: str, person: Person) -> Person | None:
        """Wait until the session is not that person's any more: then whose it is, such as the same one's with another role.

        What this process did is noticed at once, what another did (`r2c2r user`) after REMEMBERED_S.
        """
        woken = asyncio.Event()
        waiting = (asyncio.get_running_loop(), woken)
        self._waiting.add(waiting)
        try:
            while (found := await self.of(session_id)) == person:
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(woken.wait(), REMEMBERED_S)
                woken.clear()
            return found
        finally:
            self._waiting.discard(waiting)

    def look_again(self) -> None:
        """Accounts or sessions changed: nobody is taken for who they were, on open connections neither."""
        self._changes += 1
        self._known.clear()
        for loop, woken in tuple(self._waiting):
            with contextlib.suppress(RuntimeError):  # its loop is gone
                loop.call_soon_threadsafe(woken.set)

    def enter_with_key(self, key: str) -> str:
        """A new session of whoever started the server; raises Unauthorised for a wrong key."""
        if self._settings.accounts_only or not hmac.compare_digest(key.encode(), self._settings.launch_token.encode()):
            raise Unauthorised("the key in this address is not valid any more", hint="open the address that r2c2r printed last")
        return self._begin(None)

    def sign_in(self, name: str, password: str, client: str) -> str:
        """A new session; raises Unauthorised for a wrong name or password, TooMany after too many of them."""
        self._attempts.check(name, client)
        account = accounts.verified(self._engine, name, password)
        if account is None:
            self._attempts.failed(name, client)
            raise Unauthorised("the name or the password is wrong", hint="an admin can set a new one: r2c2r user password NAME")
        self._attempts.succeeded(name, client)
        return self._begin(account.id)

    def sign_out(self, session_id: str) -> None:
        """The session is nobody's any more."""
        with writing(self._engine) as session:
            session.exec(delete(SignIn).where(col(SignIn.digest) == _digest(session_id)))
        self.look_again()

    def change_password(self, person: Person, old: str, new: str, client: str) -> str:
        """The person's own password; every session of theirs ends, and a new one is returned."""
        if not person.account:
            raise Conflict("who started the server has no password", hint="make an account: r2c2r user add NAME --role admin")
        self._attempts.check(person.name, client)
        account = accounts.verified(self._engine, person.name, old)
        if account is None:
            self._attempts.failed(person.name, client)
            raise Forbidden("the present password is wrong", hint="an admin can set a new one")
        accounts.set_password(self._engine, person.name, new)
        self.look_again()
        return self._begin(account.id)

    def _begin(self, account_id: int | None) -> str:
        session_id, now = secrets.token_urlsafe(32), time.time()
        with writing(self._engine) as session:
            session.exec(delete(SignIn).where(col(SignIn.used) < now - KEPT_S))
            session.add(SignIn(digest=_digest(session_id), account_id=account_id, created=now, used=now))
        return session_id

    def _look_up(self, session_id: str) -> Person | None:
        """Whose session it is, as stored, and remembered for a moment."""
        until, changes = time.monotonic() + REMEMBERED_S, self._changes
        person = self._stored(session_id)
        if person is None:
            self._known.pop(session_id, None)
        elif changes == self._changes:
            self._known[session_id] = (until, person)
        return person

    def _stored(self, session_id: str) -> Person | None:
        now = time.time()
        with reading(self._engine) as session:
            query = select(SignIn, Account).join(Account, isouter=True).where(SignIn.digest == _digest(session_id))
            found = session.exec(query).first()
        if found is None or found[0].used < now - KEPT_S:
            return None
        sign_in, account = found
        if account is None and self._settings.accounts_only:
            return None
        if now - sign_in.used > 3600.0:
            with contextlib.suppress(R2C2RError), writing(self._engine) as session:  # a full disk keeps nobody out
                sign_in.used = now
                session.merge(sign_in)
        return accounts.person(account) if account else Person(self._settings.user, "admin")


def _digest(session_id: str) -> str:
    return hashlib.sha256(session_id.encode()).hexdigest()
