"""Sign-in at a real local OpenID provider: only people it authenticates are admitted."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
from starlette.testclient import TestClient

from app.serve import serve
from app.services import accounts, audit, people
from app.services.oidc import roles_of_groups
from r2c2r_core.errors import InputError
from tests.app.conftest import COOKIE, FAKES, ORIGIN, Running
from tests.app.people import PASSWORD, browser
from tests.waiting import PATIENCE_S

REQUIRED = bool(os.environ.get("R2C2R_REQUIRE_ALL"))
if not REQUIRED:
    for name in ("authlib", "oidc_provider_mock"):
        if find_spec(name) is None:  # importing the second one emits a warning
            pytest.skip(f"no {name}: pip install --group dev", allow_module_level=True)

ROLES = "lab-admins=admin,cn=reviewers=reviewer,lab=annotator"
ANN = {"preferred_username": "Ann", "groups": ["lab", "lab-admins", "choir"]}


class Identities:
    """The provider, and its users."""

    def __init__(self, port: int) -> None:
        self.issuer = f"http://127.0.0.1:{port}"
        self.client = httpx.Client(base_url=self.issuer, trust_env=False, timeout=PATIENCE_S)

    def knows(self, subject: str, **claims: Any) -> None:
        assert self.client.put(f"/users/{subject}", json=claims).status_code == 204

    def bend(self, **claims: Any) -> None:
        """Falsify claims in its tokens."""
        assert self.client.put("/bend", json=claims).status_code == 200

    def lets_in(self, page: str, subject: str) -> str:
        """The redirect of a browser whose user signed in on the provider's page."""
        assert self.client.get(page).status_code == 200
        return str(self.client.post(page, data={"sub": subject}).headers["location"])


@pytest.fixture(scope="module")
def provider() -> Iterator[Identities]:
    known = {**os.environ, "AUTHLIB_INSECURE_TRANSPORT": "1", "PYTHONWARNINGS": "ignore"}
    pipe = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, str(FAKES / "oidc.py")], env=known, text=True, **pipe) as process:  # type: ignore[call-overload]
        try:
            yield Identities(int(process.stdout.readline()))
        finally:
            process.kill()


@pytest.fixture(autouse=True)
def unbent(provider: Identities) -> None:
    provider.bend()


@pytest.fixture
def web(start: Callable[..., Any], provider: Identities) -> Iterator[Running]:
    with start(**asking(provider)) as found:
        yield found


def asking(provider: Identities, **further: str) -> dict[str, Any]:
    settings = {"identity": f"oidc:{provider.issuer}", "oidc_client": "r2c2r", "oidc_secret": "not-a-secret"}
    return {"accounts_only": True, "oidc_roles": ROLES, "default_role": "annotator", **settings, **further}


def begin(web: Running, wanted: str = "/") -> tuple[TestClient, str]:
    """A client that started signing in, and the provider's page that it is redirected to."""
    client = browser(web)
    answer = client.get("/login/provider", params={"next": wanted}, follow_redirects=False)
    assert answer.status_code == 303, answer.text
    return client, answer.headers["location"]


def sign_in(web: Running, provider: Identities, subject: str, wanted: str = "/") -> tuple[TestClient, httpx.Response]:
    """A client that completed the sign-in, and the last response."""
    client, page = begin(web, wanted)
    back = provider.lets_in(page, subject)
    assert back.startswith(f"{ORIGIN}/login/provider/back?")
    answer: Any = client.get(back, follow_redirects=False)
    return client, answer


def refusal(web: Running) -> str:
    return next(line.detail for line in audit.entries(web.context.engine, None, 50).entries if line.action == "refused")


def test_a_provider_user_gets_the_highest_role_of_their_groups(web: Running, provider: Identities) -> None:
    provider.knows("1", **ANN)
    client, answer = sign_in(web, provider, "1", "/p/x/annotate?frame=3")
    assert (answer.status_code, answer.headers["location"]) == (303, f"{ORIGIN}/p/x/annotate?frame=3")
    said = client.get("/api/system").json()
    assert (said["user"], said["role"], said["account"]) == ("ann", "admin", True)
    lines = [(line.action, line.who, line.detail) for line in audit.entries(web.context.engine, None, 2).entries]
    assert lines == [("signed in", "ann", f"by {provider.issuer}"), ("added", provider.issuer, "admin")]


def test_the_sign_in_page_has_a_button_for_a_configured_provider(web: Running, provider: Identities) -> None:
    page = browser(web).get("/login").text
    assert f'href="/login/provider">Sign in at {urlsplit(provider.issuer).netloc}<' in page
    web.context.provider.issuer = "https://<b>"  # type: ignore[union-attr]
    assert "&lt;b&gt;" in browser(web).get("/login").text


def test_without_a_provider_its_button_and_routes_are_absent(start: Callable[..., Any]) -> None:
    with start(accounts_only=True) as web:
        stranger = browser(web)
        assert 'href="/login/provider" hidden' in stranger.get("/login").text
        for path in ("/login/provider", "/login/provider/back?code=1&state=2", "/login/provider/out"):
            assert stranger.get(path, follow_redirects=False).status_code == 404


def test_each_sign_in_updates_the_role_and_a_renamed_user_keeps_the_account(web: Running, provider: Identities) -> None:
    for claims, role in (
        (ANN, "admin"),
        ({**ANN, "groups": ["cn=reviewers"]}, "reviewer"),
        ({**ANN, "groups": "lab"}, "annotator"),
    ):
        provider.knows("1", **{**claims, "preferred_username": f"ann-{role}"})
        client, _ = sign_in(web, provider, "1")
        said = client.get("/api/system").json()
        assert (said["user"], said["role"]) == ("ann-admin", role)
    assert len(accounts.everyone(web.context.engine)) == 1


@pytest.mark.parametrize("groups", [[], ["choir"], None, {"lab": 1}, [["lab"]]])
def test_a_user_without_an_allowed_group_is_refused_and_recorded(web: Running, provider: Identities, groups: Any) -> None:
    provider.knows("2", preferred_username="bob", groups=groups)
    client, answer = sign_in(web, provider, "2")
    assert (answer.status_code, COOKIE in client.cookies) == (403, False)
    assert "bob is in no group that may sign in" in answer.text
    assert "bob is in no group" in refusal(web)
    assert accounts.everyone(web.context.engine) == []


def test_the_default_role_is_assigned_only_at_the_first_sign_in(start: Callable[..., Any], provider: Identities) -> None:
    with start(**asking(provider, oidc_roles="", default_role="reviewer")) as web:
        provider.knows("3", email="Cleo@lab.example", email_verified=True)
        client, _ = sign_in(web, provider, "3")
        assert client.get("/api/system").json()["user"] == "cleo@lab.example"
        accounts.change(web.context.engine, "cleo@lab.example", role="admin")
        client, _ = sign_in(web, provider, "3")
        assert client.get("/api/system").json()["role"] == "admin"


@pytest.mark.parametrize("claims", [{}, {"email": "ann@lab.example"}, {"email": "a@b.c", "email_verified": "true"}])
def test_an_unverified_email_is_not_accepted_as_a_name(web: Running, provider: Identities, claims: dict[str, Any]) -> None:
    provider.knows("4", groups=["lab"], **claims)
    assert sign_in(web, provider, "4")[1].status_code == 403


def test_a_provider_user_cannot_take_over_an_account_by_its_name(web: Running, provider: Identities) -> None:
    accounts.add(web.context.engine, "root", "admin", PASSWORD)
    provider.knows("5", preferred_username="root", groups=["lab"])
    client, answer = sign_in(web, provider, "5")
    assert (answer.status_code, COOKIE in client.cookies) == (409, False)
    assert "the account root belongs to somebody else" in answer.text


def test_a_provider_response_is_valid_once_and_in_its_own_browser_only(web: Running, provider: Identities) -> None:
    provider.knows("1", **ANN)
    client, page = begin(web)
    back = provider.lets_in(page, "1")
    other, _ = begin(web)
    for stranger in (browser(web), other):
        answer = stranger.get(back, follow_redirects=False)
        assert (answer.status_code, COOKIE in stranger.cookies) == (401, False)
    assert "not started in this browser" in refusal(web)
    assert client.get(back, follow_redirects=False).status_code == 303
    assert client.get(back, follow_redirects=False).status_code == 401


def test_an_authorization_code_with_a_wrong_pkce_verifier_is_refused(web: Running, provider: Identities) -> None:
    provider.knows("1", **ANN)
    client, page = begin(web)
    assert parse_qs(urlsplit(page).query)["code_challenge_method"] == ["S256"]
    (name,) = (name for name in client.cookies if name.endswith("_begun"))
    state, nonce, _, wanted = client.cookies[name].split(".")
    client.cookies.clear()
    client.cookies.set(name, ".".join((state, nonce, "of-somebody-else", wanted)))
    answer = client.get(provider.lets_in(page, "1"), follow_redirects=False)
    assert (answer.status_code, "invalid_grant" in answer.text) == (401, True)


@pytest.mark.parametrize(
    ("claim", "value"),
    [("nonce", "another"), ("aud", "another-client"), ("iss", "https://evil.example"), ("exp", -1000), ("at_hash", "AAAA")],
)
def test_an_id_token_with_a_wrong_claim_is_refused(web: Running, provider: Identities, claim: str, value: Any) -> None:
    provider.knows("1", **ANN)
    client, page = begin(web)
    provider.bend(**{claim: value})
    answer = client.get(provider.lets_in(page, "1"), follow_redirects=False)
    assert (answer.status_code, COOKIE in client.cookies) == (401, False)
    assert "is not valid" in answer.text


def test_symmetric_and_none_signing_algorithms_are_not_accepted(web: Running, provider: Identities) -> None:
    begin(web)
    offered = web.context.provider._app.server_metadata  # type: ignore[union-attr]
    offered["id_token_signing_alg_values_supported"] = ["none", "HS256", "RS256"]
    begin(web)
    assert offered["id_token_signing_alg_values_supported"] == ["RS256"]


@pytest.mark.parametrize("said", ["error=access_denied", "iss=https://evil.example&code=x"])
def test_provider_errors_and_foreign_issuers_do_not_sign_in(web: Running, said: str) -> None:
    client, page = begin(web)
    state = parse_qs(urlsplit(page).query)["state"][0]
    answer = client.get(f"/login/provider/back?{said}&state={state}", follow_redirects=False)
    assert answer.status_code in (401, 403)
    assert 'role="alert" id="refused">' in answer.text


@pytest.mark.parametrize(
    "wanted", ["https://evil.example/", "//evil.example/", "/\\evil.example", "javascript:1", "/" + "a" * 2000]
)
def test_sign_in_redirects_stay_on_this_site(web: Running, provider: Identities, wanted: str) -> None:
    provider.knows("1", **ANN)
    _, answer = sign_in(web, provider, "1", wanted)
    assert answer.headers["location"].startswith(f"{ORIGIN}/")


def test_signing_out_ends_the_session_here_and_at_the_provider(web: Running, provider: Identities) -> None:
    provider.knows("1", **ANN)
    client, _ = sign_in(web, provider, "1")
    session, page = client.cookies[COOKIE], client.get("/api/system").json()["sign_out"]
    assert client.post("/api/logout").status_code == 204
    client.cookies.set(COOKIE, session)
    assert client.get("/api/projects").status_code == 401
    there = client.get(page, follow_redirects=False).headers["location"]
    assert there.startswith(f"{provider.issuer}/oauth2/end_session?")
    assert parse_qs(urlsplit(there).query) == {"client_id": ["r2c2r"], "post_logout_redirect_uri": [f"{ORIGIN}/login"]}
    assert provider.client.get(there).status_code == 200


def test_provider_sessions_expire_before_password_sessions(
    web: Running, provider: Identities, monkeypatch: pytest.MonkeyPatch
) -> None:
    provider.knows("1", **ANN)
    ann, _ = sign_in(web, provider, "1")
    accounts.add(web.context.engine, "bob", "annotator", PASSWORD)
    bob = browser(web)
    assert bob.post("/api/login", json={"name": "bob", "password": PASSWORD}).status_code == 204
    monkeypatch.setattr(people, "PROVIDED_S", -1.0)
    web.context.people.look_again()
    assert (ann.get("/api/projects").status_code, bob.get("/api/projects").status_code) == (401, 200)


def test_an_unreachable_provider_is_reported_on_the_page(start: Callable[..., Any], provider: Identities) -> None:
    with start(**asking(provider, identity="oidc:http://127.0.0.1:9")) as web:
        answer = browser(web).get("/login/provider", follow_redirects=False)
        assert (answer.status_code, "http://127.0.0.1:9 does not answer" in answer.text) == (503, True)


def test_a_provider_with_a_different_issuer_is_refused(start: Callable[..., Any], provider: Identities) -> None:
    with start(**asking(provider, identity=f"oidc:{provider.issuer.replace('127.0.0.1', 'localhost')}")) as web:
        web.context.provider._app._server_metadata_url = f"{provider.issuer}/.well-known/openid-configuration"
        answer = browser(web).get("/login/provider", follow_redirects=False)
        assert (answer.status_code, "calls itself" in answer.text) == (503, True)


@pytest.mark.parametrize("text", ["lab", "=admin", "lab=owner"])
def test_an_invalid_mapping_of_groups_to_roles_raises(text: str) -> None:
    with pytest.raises(InputError):
        roles_of_groups(text)


@pytest.mark.parametrize(
    "issuer", ["", "http://id.lab.example", "https://", "ftp://id.lab.example", "https://id.lab.example?x"]
)
def test_an_issuer_without_tls_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, issuer: str) -> None:
    monkeypatch.setenv("R2C2R_IDENTITY", f"oidc:{issuer}")
    with pytest.raises(InputError, match="R2C2R_IDENTITY"):
        serve(host="127.0.0.1", port=0, data_dir=tmp_path / "data")


def test_a_missing_oidc_client_id_is_refused_before_the_server_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("R2C2R_IDENTITY", "oidc:https://id.lab.example")
    with pytest.raises(InputError, match="R2C2R_OIDC_CLIENT"):
        serve(host="127.0.0.1", port=0, data_dir=tmp_path / "data")
