"""The finished scene, its certificate and its bundles."""

from fastapi import APIRouter

from app import schemas
from app.deps import Ctx
from app.routes.numbers import OtherId, RowId
from app.services import bundle_inside, bundles, scenes

router = APIRouter(prefix="/api/projects/{project}", tags=["scenes"])


@router.get("/scene", operation_id="getScene")
def get_scene(context: Ctx, project: str) -> schemas.SceneSummary:
    """The finished scene as a table; 409 while there is none."""
    return scenes.summary(context, project)


@router.get("/certificate", operation_id="getCertificate")
def get_certificate(context: Ctx, project: str) -> schemas.Certificate:
    """The newest bundle's certificate; 409 while there is none."""
    return bundles.certificate(context, project)


@router.get("/bundles", operation_id="listBundles")
def list_bundles(context: Ctx, project: str) -> list[schemas.Bundle]:
    """All versions, newest first."""
    return bundles.list_bundles(context, project)


@router.get("/bundles/{version}/check", operation_id="checkBundle")
def check_bundle(context: Ctx, project: str, version: RowId) -> schemas.BundleCheck:
    """Check a bundle now: its bytes against its checksum, and the linter's findings."""
    return bundles.check(context, project, version)


@router.get("/bundles/{version}/inside", operation_id="bundleInside")
def bundle_inside_of(context: Ctx, project: str, version: RowId) -> schemas.BundleInside:
    """A bundle's content for robots: its single objects, robot trials, loading code for each simulator."""
    return bundle_inside.inside(context, project, version)


@router.get("/bundles/{version}/changes", operation_id="compareBundles")
def compare_bundles(context: Ctx, project: str, version: RowId, since: OtherId) -> list[schemas.BundleChange]:
    """Changes since another version."""
    return bundles.compare(context, project, since, version)
