"""API tokens."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.routes.numbers import RowId
from app.services import own_tokens

router = APIRouter(prefix="/api/tokens", tags=["people"])


@router.get("", operation_id="listTokens")
def list_tokens(context: Ctx) -> list[schemas.ApiToken]:
    """Your tokens; an admin sees everybody's."""
    return own_tokens.listed(context)


@router.post("", operation_id="addToken", status_code=201)
def add_token(context: Ctx, body: schemas.ApiTokenIn) -> schemas.NewApiToken:
    """A token for a program, which sends `Authorization: Bearer SECRET`; its secret is shown only once."""
    return own_tokens.add(context, body)


@router.delete("/{token}", operation_id="revokeToken", status_code=204)
def revoke_token(context: Ctx, token: RowId) -> None:
    """Revoke a token."""
    own_tokens.revoke(context, token)
