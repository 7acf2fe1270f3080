"""OpenID provider on a free port, which it prints: oidc-provider-mock, extended to enforce PKCE.

Its tokens are issued for the subject described by `PUT /users/SUB`. `PUT /bend` with {"claim": value} falsifies claims.
"""

import base64
import hashlib
import sys
import threading
from typing import Any
from urllib.parse import parse_qs, urlsplit

import flask
import werkzeug.serving
from oidc_provider_mock import _app

BENT: dict[str, Any] = {}
CHALLENGES: dict[str, str] = {}  # by authorisation code
provider = _app.app(require_nonce=True)
_jwt_config = _app.OpenIDCode.get_jwt_config


def bent_config(self: Any, grant: Any, client: Any = None) -> dict[str, Any]:
    return {**_jwt_config(self, grant, client), **{name: BENT[name] for name in ("iss", "exp") if name in BENT}}


def bent_info(self: Any, user: Any, scope: str) -> dict[str, Any]:
    bent = {name: value for name, value in BENT.items() if name not in ("iss", "exp")}
    return {**_app._user_claims_for_scope(user, scope), **bent}


_app.OpenIDCode.get_jwt_config = bent_config
_app.OpenIDCode.generate_user_info = bent_info


@provider.put("/bend")
def bend() -> str:
    BENT.clear()
    BENT.update(flask.request.json or {})
    return ""


@provider.after_request
def note_challenge(answer: flask.Response) -> flask.Response:
    asked, code = flask.request.args, parse_qs(urlsplit(answer.location or "").query).get("code", [])
    if flask.request.path == "/oauth2/authorize" and code and asked.get("code_challenge_method") == "S256":
        CHALLENGES[code[0]] = asked["code_challenge"]
    return answer


@provider.before_request
def check_verifier() -> tuple[dict[str, str], int] | None:
    if flask.request.path != "/oauth2/token":
        return None
    said = flask.request.form
    digest = hashlib.sha256(said.get("code_verifier", "").encode()).digest()
    if CHALLENGES.get(said["code"]) == base64.urlsafe_b64encode(digest).rstrip(b"=").decode():
        return None
    return {"error": "invalid_grant"}, 400


server = werkzeug.serving.make_server("127.0.0.1", 0, provider, threaded=True)
threading.Thread(target=lambda: (sys.stdin.read(), server.shutdown()), daemon=True).start()  # ends with the tests
sys.stdout.write(f"{server.server_port}\n")
sys.stdout.flush()
server.serve_forever()
