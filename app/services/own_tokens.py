"""Tokens as people make and revoke them on the server's pages and routes: their own, and an admin everybody's."""

from app import schemas
from app.errors import Forbidden
from app.services import tokens
from app.services.context import Context


def listed(context: Context) -> list[schemas.ApiToken]:
    """The tokens of who asks; an admin's list has everybody's."""
    return tokens.everyone(context.engine, of=_only(context))


def add(context: Context, body: schemas.ApiTokenIn) -> schemas.NewApiToken:
    """A token of who asks; raises Forbidden for a program: what it has been lent it lends nobody."""
    _require_in_person(context)
    owner = context.who if context.person.account else None
    secret, shape = tokens.add(context.engine, owner, body.name, body.scope, by=context.who)
    return schemas.NewApiToken(**shape.model_dump(), secret=secret)


def revoke(context: Context, number: int) -> None:
    """Revoke one's own, or as an admin anybody's; open connections with it end."""
    _require_in_person(context)
    tokens.revoke(context.engine, number, of=_only(context), by=context.who)
    context.people.look_again()


def _only(context: Context) -> str | None:
    """Whose tokens who asks may see; None: everybody's."""
    return None if context.person.may("admin") else context.who


def _require_in_person(context: Context) -> None:
    if context.person.scope is not None:
        raise Forbidden("a token makes and revokes none", hint="sign in, or r2c2r token on the server's machine")
