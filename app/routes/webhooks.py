"""Webhooks, called when a run ends or a project's review state changes."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.routes.numbers import RowId
from app.services import webhooks

router = APIRouter(prefix="/api/webhooks", tags=["people"])


@router.get("", operation_id="listWebhooks")
def list_webhooks(context: Ctx) -> list[schemas.Webhook]:
    """Your webhooks; an admin sees everybody's."""
    return webhooks.listed(context)


@router.post("", operation_id="addWebhook", status_code=201)
def add_webhook(context: Ctx, body: schemas.WebhookIn) -> schemas.NewWebhook:
    """Add an address; X-R2C2R-Signature is `sha256=` and the HMAC of `timestamp.body` with the secret shown only here."""
    return webhooks.add(context, body)


@router.delete("/{webhook}", operation_id="removeWebhook", status_code=204)
def remove_webhook(context: Ctx, webhook: RowId) -> None:
    """Remove a webhook."""
    webhooks.remove(context, webhook)


@router.post("/{webhook}/test", operation_id="testWebhook", status_code=201)
def test_webhook(context: Ctx, webhook: RowId) -> schemas.Delivery:
    """Post {"event": "test"} to it, once; the answer appears in its deliveries within seconds."""
    return webhooks.test(context, webhook)


@router.get("/{webhook}/deliveries", operation_id="listDeliveries")
def list_deliveries(context: Ctx, webhook: RowId) -> list[schemas.Delivery]:
    """Past and pending deliveries with their answers, newest first."""
    return webhooks.deliveries(context, webhook)
