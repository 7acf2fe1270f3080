"""Capabilities of this app, and folders from which a recording may be imported."""

from fastapi import APIRouter

from app import schemas
from app.deps import AdminCtx, Ctx
from app.services import system

router = APIRouter(prefix="/api", tags=["system"])


@router.get("/health", operation_id="health")
async def health() -> dict[str, str]:
    """Alive; waits for nothing."""
    return {"state": "ok"}


@router.get("/system", operation_id="getSystem")
def get_system(context: Ctx) -> schemas.SystemInfo:
    """Limits, categories, palette, free space."""
    return system.describe(context)


@router.get("/browse", operation_id="browse")
def browse(context: AdminCtx, path: str | None = None) -> schemas.FolderListing:
    """A folder on the server's machine, below an allowed root; without a path, the roots."""
    return system.browse(context, path)
