"""Sign-in at an identity provider: OpenID Connect's code flow with PKCE, by authlib.

State, nonce and verifier of a sign-in are stored in the browser's cookie, so that any of several servers can complete it.
"""

import hmac
from collections.abc import Awaitable, Mapping
from typing import Any, NamedTuple, TypeVar
from urllib.parse import quote, unquote, urlencode

from app.errors import Forbidden, Unauthorised, Unavailable
from app.security import ROLES, Role
from app.services.accounts import known_role
from app.settings import Settings
from r2c2r_core.errors import EnvironmentProblem, InputError

TIMEOUT_S = 10.0  # of each request to the provider
SIGNED_BY = ("RS", "PS", "ES", "Ed")  # algorithms with a public key; a provider may offer "none" as well
BEGIN = "start again at the sign-in page"
Result = TypeVar("Result")


class Begun(NamedTuple):
    """A sign-in in progress."""

    state: str
    nonce: str
    verifier: str
    wanted: str  # the originally requested path

    def cookie(self) -> str:
        """Cookie value."""
        return ".".join((self.state, self.nonce, self.verifier, quote(self.wanted, safe="")))


class Named(NamedTuple):
    """Identity from the provider."""

    subject: str  # never reassigned
    name: str
    role: Role | None  # by groups; None if none is mapped


class Provider:
    """The configured OpenID provider. Raises Unavailable where it does not answer."""

    def __init__(self, settings: Settings) -> None:
        try:
            from authlib.integrations.starlette_client import StarletteOAuth2App
        except ImportError as error:
            raise EnvironmentProblem("R2C2R_IDENTITY oidc: authlib is missing", hint="pip install 'r2c2r[oidc]'") from error
        if not settings.oidc_client:
            raise InputError("R2C2R_OIDC_CLIENT is empty", hint="the client id that the provider gave this server")
        self.issuer, self._roles = settings.identity_issuer, roles_of_groups(settings.oidc_roles)
        self._client_id = settings.oidc_client
        self._app: Any = StarletteOAuth2App(
            None,
            client_id=settings.oidc_client,
            client_secret=settings.oidc_secret or None,
            server_metadata_url=f"{self.issuer}/.well-known/openid-configuration",
            client_kwargs={"code_challenge_method": "S256", "timeout": TIMEOUT_S},
        )

    async def begin(self, back: str, wanted: str) -> tuple[str, Begun]:
        """The provider's sign-in page, which redirects to `back`, and the state to verify afterwards."""
        metadata = await self._metadata()
        scope = " ".join(["openid", "profile", "email", *({"groups"} & set(metadata.get("scopes_supported", ())))])
        made = await self._asked(self._app.create_authorization_url(back, scope=scope))
        return made["url"], Begun(made["state"], made["nonce"], made["code_verifier"], wanted)

    async def end(self, back: str, said: Mapping[str, str], begun: Begun | None) -> Named:
        """Complete a sign-in; raises Unauthorised for an answer that does not match it, Forbidden for users without access."""
        if begun is None or not hmac.compare_digest(said.get("state", "").encode(), begun.state.encode()):
            raise Unauthorised("this sign-in was not started in this browser, or is more than ten minutes old", hint=BEGIN)
        if said.get("iss", self.issuer) != self.issuer:
            raise Unauthorised(f"the answer is of {said['iss'][:80]}, not of {self.issuer}", hint=BEGIN)
        if "code" not in said:
            raise Forbidden(f"{self.issuer} says: {said.get('error', 'nothing')[:80]}", hint=BEGIN)
        await self._metadata()
        asked = {"redirect_uri": back, "code": said["code"], "code_verifier": begun.verifier}
        token = await self._asked(self._app.fetch_access_token(**asked))
        expected = {"iss": self.issuer, "aud": self._client_id}
        options = {name: {"essential": True, "value": value} for name, value in expected.items()}
        claims = await self._asked(self._app.parse_id_token(token, begun.nonce, claims_options=options))
        if claims is None:
            raise Unauthorised(f"{self.issuer} sent no identity", hint="ask for the scope openid at the provider")
        return self._named(await self._whole(token, claims))

    async def leave(self, back: str) -> str:
        """The provider's sign-out page, which redirects to `back`, or `back` itself without one."""
        page = (await self._metadata()).get("end_session_endpoint")
        said = urlencode({"client_id": self._client_id, "post_logout_redirect_uri": back})
        return f"{page}{'&' if '?' in page else '?'}{said}" if page else back

    async def _metadata(self) -> dict[str, Any]:
        found: dict[str, Any] = await self._asked(self._app.load_server_metadata())
        if found.get("issuer") != self.issuer:
            raise Unavailable(
                f"{self.issuer} calls itself {found.get('issuer')}", hint="R2C2R_IDENTITY=oidc:ISSUER, as it does"
            )
        offered = found.get("id_token_signing_alg_values_supported") or ["RS256"]
        found["id_token_signing_alg_values_supported"] = [name for name in offered if name.startswith(SIGNED_BY)]
        return found

    async def _whole(self, token: dict[str, Any], claims: dict[str, Any]) -> dict[str, Any]:
        """The claims completed from the provider's userinfo endpoint."""
        if {"preferred_username", "groups"} <= claims.keys() or "userinfo_endpoint" not in await self._metadata():
            return claims
        further = await self._asked(self._app.userinfo(token=token))
        if further.get("sub") != claims["sub"]:
            raise Unauthorised(f"{self.issuer} answered for another person", hint=BEGIN)
        return {**further, **claims}

    def _named(self, claims: Mapping[str, Any]) -> Named:
        name = claims.get("preferred_username") or (claims.get("email") if claims.get("email_verified") is True else None)
        if not isinstance(name, str):
            raise Forbidden(f"{self.issuer} sent no user name", hint="preferred_username, or an email that is verified")
        return Named(f"{self.issuer} {claims['sub']}", name, self._role(name, claims.get("groups")))

    def _role(self, name: str, groups: Any) -> Role | None:
        if not self._roles:
            return None
        theirs = [groups] if isinstance(groups, str) else groups if isinstance(groups, list) else []
        reached = [self._roles[group] for group in theirs if isinstance(group, str) and group in self._roles]
        if not reached:
            raise Forbidden(f"{name} is in no group that may sign in", hint="ask the administrator of the groups")
        return max(reached, key=ROLES.index)

    async def _asked(self, answer: Awaitable[Result]) -> Result:
        """The provider's answer, with all failures turned into one-line errors."""
        import httpx2
        from authlib.integrations.base_client import OAuthError
        from joserfc.errors import JoseError

        try:
            return await answer
        except OAuthError as error:
            raise Unauthorised(f"{self.issuer} says: {str(error)[:200]}", hint=BEGIN) from error
        except JoseError as error:
            raise Unauthorised(f"what {self.issuer} sent is not valid: {str(error)[:200]}", hint=BEGIN) from error
        except (httpx2.HTTPError, ValueError) as error:
            raise Unavailable(
                f"{self.issuer} does not answer as expected: {str(error)[:200]}", hint="try again later"
            ) from error


def begun(cookie: str) -> Begun | None:
    """The sign-in stored in a cookie, or None."""
    match cookie.split(".", 3):
        case [state, nonce, verifier, wanted] if state and nonce and verifier:
            return Begun(state, nonce, verifier, unquote(wanted))
    return None


def roles_of_groups(text: str) -> dict[str, Role]:
    """Roles by group, from `group=role,…`; raises InputError."""
    found: dict[str, Role] = {}
    for part in filter(None, map(str.strip, text.split(","))):
        group, _, role = part.rpartition("=")
        if not group:
            raise InputError(f"R2C2R_OIDC_ROLES {part[:80]!r}: not GROUP=ROLE", hint="lab-admins=admin,lab=annotator")
        found[group] = known_role(role)
    return found
