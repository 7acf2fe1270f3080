"""Token management by users: their own tokens, and all tokens for admins."""

from app import schemas
from app.errors import Forbidden
from app.services import tokens
from app.services.context import Context


def listed(context: Context) -> list[schemas.ApiToken]:
    """The current user's tokens; for an admin, everyone's."""
    return tokens.everyone(context.engine, of=_only(context))


def add(context: Context, body: schemas.ApiTokenIn) -> schemas.NewApiToken:
    """Create a token of the current user; raises Forbidden for a token user, which may not delegate its rights."""
    _require_in_person(context)
    owner = context.who if context.person.account else None
    secret, shape = tokens.add(context.engine, owner, body.name, body.scope, by=context.who)
    return schemas.NewApiToken(**shape.model_dump(), secret=secret)


def revoke(context: Context, number: int) -> None:
    """Revoke one's own token, or any as an admin, and end its connections."""
    _require_in_person(context)
    tokens.revoke(context.engine, number, of=_only(context), by=context.who)
    context.people.look_again()


def _only(context: Context) -> str | None:
    """The user whose tokens are visible; None: everyone's."""
    return None if context.person.may("admin") else context.who


def _require_in_person(context: Context) -> None:
    if context.person.scope is not None:
        raise Forbidden("a token cannot make or revoke tokens", hint="sign in, or r2c2r token on the server's machine")
