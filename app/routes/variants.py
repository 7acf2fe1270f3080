"""Variants of bundles for training."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.services import jobs, variants

router = APIRouter(prefix="/api/projects/{project}/variants", tags=["variants"])


@router.get("", operation_id="listVariants")
def list_variants(context: Ctx, project: str) -> schemas.Variants:
    """All sets of variants, newest first, and the disk space that variants of the newest bundle would take."""
    return variants.list_variants(context, project)


@router.post("", operation_id="makeVariants", status_code=202)
def make_variants(context: Ctx, project: str, body: schemas.VariantsIn) -> schemas.Job:
    """Make variants of a bundle: the same bundle, count and seed give the same ones."""
    return jobs.get_job(context, variants.make(context, project, body))


@router.delete("/{variants_name}", operation_id="deleteVariants")
def delete_variants(context: Ctx, project: str, variants_name: schemas.VariantsName) -> schemas.Variants:
    """Delete variants. Idempotent; the same seed makes them again."""
    return variants.delete(context, project, variants_name)
