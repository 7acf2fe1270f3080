"""Sessions of signed-in browsers, by printed key, password, proxy or identity provider."""

import asyncio
import contextlib
import hashlib
import logging
import secrets
import threading
import time
from collections.abc import Callable

import anyio
from sqlalchemy import Engine
from sqlmodel import Session, col, delete, select

from app.db.engine import reading, writing
from app.db.tables import Account, SignIn
from app.errors import Conflict, Forbidden, Unauthorised
from app.gates import Gate
from app.security import TOKEN_PREFIX, Person
from app.services import accounts, audit, launch_keys, tokens
from app.services.attempts import Attempts
from app.services.oidc import Named
from app.settings import Settings
from r2c2r_core.errors import R2C2RError

_log = logging.getLogger(__name__)

KEPT_S = 30 * 24 * 3600.0  # since last use
PROVIDED_S = 24 * 3600.0  # sign-in at the provider is repeated daily, to exclude former members
REMEMBERED_S = 2.0  # cache time of users, as `r2c2r user` changes the file from another process
KEY_REFUSAL_S = 10.0  # minimum interval of recorded wrong keys, which cost their sender nothing
BY_PROXY = "a trusted proxy"
LOOK_UPS = 4  # concurrent, in separate threads, as slow requests occupy the request threads


class People:
    """Sign-in, sign-out, and lookup of sessions. Non-coroutine methods are thread-safe."""

    def __init__(self, engine: Engine, settings: Settings, passwords: Gate) -> None:
        self._engine, self._settings, self._passwords = engine, settings, passwords
        self._attempts = Attempts()
        self._known: dict[str, tuple[float, Person]] = {}
        self._threads = anyio.CapacityLimiter(LOOK_UPS)
        self._changes = 0  # to avoid caching data read before a change
        self._waiting: set[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = set()
        self._ended: dict[str, tuple[str, str]] = {}  # digests of ended sessions that may still be stored: user, client
        self._key_refused = -KEY_REFUSAL_S
        self._proxied: dict[str, str] = {}  # sessions of users named by a trusted proxy
        self._proxied_lock = threading.Lock()
        if not settings.accounts_only:
            launch_keys.keep(engine, settings.launch_token)

    async def of(self, session_id: str) -> Person | None:
        """The session's user, or None, without blocking other requests on the database."""
        found = self._known.get(session_id)
        if found is not None and time.monotonic() < found[0]:
            return found[1]
        return await anyio.to_thread.run_sync(self.look_up, session_id, limiter=self._threads)

    async def named_by_proxy(self, name: str, client: str) -> str:
        """The session of a user named by a trusted proxy, with an account created on first use. Raises InputError."""
        found = self._proxied.get(name)
        if found is None or await self.of(found) is None:
            found = await anyio.to_thread.run_sync(self._enter_by_proxy, name, client, limiter=self._threads)
        return found

    async def until_other(self, session_id: str, person: Person) -> Person | None:
        """Wait until the session's user or role changes, and return the new one.

        Changes by this process are detected at once, others (`r2c2r user`) after REMEMBERED_S.
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
        """Invalidate cached users after changes of accounts or sessions, also for open connections."""
        self._changes += 1
        self._known.clear()
        for loop, woken in tuple(self._waiting):
            with contextlib.suppress(RuntimeError):  # its loop is closed
                loop.call_soon_threadsafe(woken.set)

    def enter_with_key(self, key: str, client: str) -> str:
        """A new session of the user who started the server; raises Unauthorised for a wrong or used key."""
        with writing(self._engine) as session:
            if not self._settings.accounts_only and launch_keys.use(session, key):
                return self._begin(session, None, self._settings.user, client, "by a printed address")
        if time.monotonic() - self._key_refused > KEY_REFUSAL_S:
            self._key_refused = time.monotonic()
            audit.note_refusal(self._engine, "", client, "a printed address that was used or is not this server's")
        raise Unauthorised("the key in this address is no longer valid", hint="r2c2r key prints a new address")

    async def sign_in(self, name: str, password: str, client: str) -> str:
        """A new session; raises Unauthorised for a wrong name or password, TooMany while too many attempts are waiting."""
        return await self._guess(name, client, self._signed_in, name, password, client)

    async def change_password(self, person: Person, old: str, new: str, client: str) -> str:
        """Change one's own password, end all own sessions, and return a new one."""
        if not person.account:
            raise Conflict("who started the server has no password", hint="make an account: r2c2r user add NAME --role admin")
        return await self._guess(person.name, client, self._changed_password, person.name, old, new, client)

    def enter_by_provider(self, named: Named, issuer: str, client: str) -> str:
        """A new session of a user named by the identity provider; raises Conflict, InputError."""
        with writing(self._engine) as session:
            given = (named.subject, named.name, named.role, self._settings.default_role)
            account = accounts.of_subject(session, *given, by=issuer)
            entered = self._begin(session, account.id, account.name, client, f"by {issuer}")
        self.look_again()
        return entered

    def note_refusal(self, client: str, said: str) -> None:
        """Record the refusal of a user accepted by the identity provider."""
        audit.note_refusal(self._engine, "", client, said[:300])

    def sign_out(self, session_id: str, who: str, client: str) -> None:
        """End the session, even if a full disk prevents its deletion."""
        self._ended[_digest(session_id)] = (who, client)
        self.look_again()
        self.forget_ended()

    def forget_ended(self) -> None:
        """Delete ended sessions; failures are retried."""
        ended = dict(self._ended)
        if not ended:
            return
        try:
            with writing(self._engine) as session:
                session.exec(delete(SignIn).where(col(SignIn.digest).in_(ended)))
                for who, client in ended.values():
                    audit.note(session, "signed out", account=who, who=who, client=client)
        except R2C2RError as error:
            _log.warning("ended sessions are still stored: %s", error)
            return
        for digest in ended:
            del self._ended[digest]

    async def _guess(self, name: str, client: str, look: Callable[..., str], *arguments: str) -> str:
        """Result of `look` for a correct password; the attempt is counted first, and its delay blocks no thread."""
        self._passwords.check(client)
        await pause(self._attempts.take(name, client))
        session_id = await self._passwords.run(client, look, *arguments)
        self._attempts.succeeded(name, client)
        return session_id

    def _signed_in(self, name: str, password: str, client: str) -> str:
        account = accounts.verified(self._engine, name, password)
        if account is None:
            audit.note_refusal(self._engine, name, client, "a wrong name or password")
            raise Unauthorised("the name or the password is wrong", hint="an admin can set a new one: r2c2r user password NAME")
        with writing(self._engine) as session:
            return self._begin(session, account.id, account.name, client, "by password")

    def _enter_by_proxy(self, name: str, client: str) -> str:
        with self._proxied_lock:  # a page's first requests are concurrent
            found = self._proxied.get(name)
            if found is None or self.look_up(found) is None:
                with writing(self._engine) as session:
                    account = accounts.seen(session, name, self._settings.default_role, by=BY_PROXY)
                    found = self._begin(session, account.id, account.name, client, f"by {BY_PROXY}")
                self._proxied[name] = found
            return found

    def _changed_password(self, name: str, old: str, new: str, client: str) -> str:
        account = accounts.verified(self._engine, name, old)
        if account is None:
            audit.note_refusal(self._engine, name, client, "a wrong password, to change it")
            raise Forbidden("the present password is wrong", hint="an admin can set a new one")
        accounts.change(self._engine, name, password=new, by=name)
        self.look_again()
        with writing(self._engine) as session:
            return self._begin(session, account.id, name, client, "after a new password")

    def _begin(self, session: Session, account_id: int | None, who: str, client: str, detail: str) -> str:
        session_id, now = secrets.token_urlsafe(32), time.time()
        session.exec(delete(SignIn).where(col(SignIn.used) < now - KEPT_S))
        session.add(SignIn(digest=_digest(session_id), account_id=account_id, created=now, used=now))
        audit.note(session, "signed in", account=who if account_id is not None else "", who=who, client=client, detail=detail)
        return session_id

    def look_up(self, session_id: str) -> Person | None:
        """The session's user from the database, cached briefly."""
        until, changes = time.monotonic() + REMEMBERED_S, self._changes
        person = self._stored(session_id)
        if person is None:
            self._known.pop(session_id, None)
        elif changes == self._changes:
            self._known[session_id] = (until, person)
        return person

    def _stored(self, session_id: str) -> Person | None:
        if session_id.startswith(TOKEN_PREFIX):
            return tokens.person_of(self._engine, self._settings, session_id)
        now = time.time()
        with reading(self._engine) as session:
            query = select(SignIn, Account).join(Account, isouter=True).where(SignIn.digest == _digest(session_id))
            found = session.exec(query).first()
        if found is None or found[0].used < now - KEPT_S or found[0].digest in self._ended:
            return None
        sign_in, account = found
        if account is None and self._settings.accounts_only:
            return None
        if account is not None and account.subject is not None and sign_in.created < now - PROVIDED_S:
            return None
        if now - sign_in.used > 3600.0:
            with contextlib.suppress(R2C2RError), writing(self._engine) as session:  # a full disk must not prevent access
                sign_in.used = now
                session.merge(sign_in)
        return accounts.person(account) if account else Person(self._settings.user, "admin")


pause = anyio.sleep


def _digest(session_id: str) -> str:
    return hashlib.sha256(session_id.encode()).hexdigest()
