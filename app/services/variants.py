"""Variants of bundles for training: size estimates, creation by a job, and self-describing files."""

import json
import tempfile
import zipfile
from pathlib import Path
from typing import NamedTuple

from sqlmodel import Session, col, select

from app import schemas
from app.db import queries
from app.db.engine import reading, writing
from app.db.tables import Job, Project
from app.errors import Conflict, NotFound
from app.files import ProjectFiles, VariantFiles, delete_folder, free_bytes, require_free
from app.services import bundles, projects
from app.services.bundles import BundleFile, root_of
from app.services.context import Context
from app.services.imports import queue_job
from r2c2r_core.errors import BundleError
from r2c2r_core.variants.draw import NOT_VARIED

_SURFACES_BYTES = 900_000  # of the procedural textures, compressed or not (benchmarks/variants.json)
_TOLD = (
    1.45  # size of a variant with its entry in variants.json, relative to its scene: 1.26 unpacked, 1.43 packed, on the sample
)


class _Takes(NamedTuple):
    """Bytes shared by all variants, and bytes of each."""

    shared: int
    each: int

    def of(self, count: int) -> int:
        return self.shared + count * self.each


def list_variants(context: Context, project_id: str) -> schemas.Variants:
    """Existing variants, and the estimated size of variants of the newest bundle."""
    with reading(context.engine) as session:
        project = queries.project_row(session, project_id)
        newest = queries.newest_bundle(session, project_id)
        files = context.files(project)
    found = [VariantFiles(facts.parent) for facts in files.variants.glob("*/facts.json")]
    sets = sorted((_shape(project, made) for made in found), key=lambda made: -made.created)
    takes = _takes(files.bundles / newest.path) if newest else None
    if newest is None or takes is None:
        return schemas.Variants(offer=None, sets=sets)
    packed, unpacked = takes
    offer = schemas.VariantsOffer(
        version=newest.version,
        most=schemas.MOST_VARIANTS,
        zip_bytes=packed.shared,
        each_zip_bytes=packed.each,
        disk_bytes=unpacked.shared,
        each_disk_bytes=unpacked.each,
        free_bytes=max(free_bytes(files.root) - context.settings.min_free_bytes, 0),
    )
    return schemas.Variants(offer=offer, sets=sets)


def make(context: Context, project_id: str, body: schemas.VariantsIn) -> int:
    """Queue a job that creates them and return its number; an active job for the same variants is reused."""
    bundle = bundles.file(context, project_id, body.version).path
    takes = _takes(bundle)
    if takes is None:
        raise BundleError(f"bundle {body.version} has no scene.xml", hint="run the project again, and vary that bundle")
    packed, unpacked = (each.of(body.count) for each in takes)
    with writing(context.engine) as session:
        project = queries.project_row(session, project_id)
        files = context.files(project)
        require_free(files.root, packed, context.settings.min_free_bytes)
        require_free(Path(tempfile.gettempdir()), packed + unpacked, context.settings.min_free_bytes)
        name = f"v{body.version}-n{body.count}-s{body.seed}"
        if VariantFiles(files.variants / name).facts.exists():
            raise Conflict(
                f"{body.count} variants of seed {body.seed} already exist", hint="download them, or give another seed"
            )
        payload = {"bundle": bundle.name, "name": name, "count": body.count, "seed": body.seed}
        job = _under_way(session, project_id, name) or queue_job(context, session, project, "vary", payload)
        number = job.id or 0
    context.runner.queued(number)
    projects.tell(context, project_id)
    return number


def delete(context: Context, project_id: str, name: str) -> schemas.Variants:
    """Delete existing variants; the same seed recreates them."""
    delete_folder(context.files(_project(context, project_id)).variants / name)
    projects.tell(context, project_id)
    return list_variants(context, project_id)


def archive(context: Context, project_id: str, name: str) -> BundleFile:
    """The zip of existing variants."""
    project = _project(context, project_id)
    made = _made(context.files(project), name)
    shape = _shape(project, made)
    return BundleFile(made.archive, shape.file_name, shape.sha256)


def wall(context: Context, project_id: str, name: str) -> Path:
    """Picture of the first variants."""
    return _made(context.files(_project(context, project_id)), name).wall


def _project(context: Context, project_id: str) -> Project:
    with reading(context.engine) as session:
        return queries.project_row(session, project_id)


def _made(files: ProjectFiles, name: str) -> VariantFiles:
    found = VariantFiles(files.variants / name)
    if not found.facts.exists():
        raise NotFound(f"no variants {name}", hint="see the list of those that were made")
    return found


def _under_way(session: Session, project_id: str, name: str) -> Job | None:
    """The active job that creates them, or None."""
    active = select(Job).where(Job.project_id == project_id, Job.kind == "vary", col(Job.state).in_(("queued", "running")))
    return next((job for job in session.exec(active) if job.payload["name"] == name), None)


def _takes(bundle: Path) -> tuple[_Takes, _Takes] | None:
    """Approximate size of the bundle's variants as a zip, and unpacked; None without a scene to vary.

    The shared part is the bundle without its result pictures; each variant is its scene with other values.
    """
    with zipfile.ZipFile(bundle) as archive:
        top = root_of(archive)
        members = {entry.filename.removeprefix(top): entry for entry in archive.infolist()}
    scene = members.get("scene.xml")
    if scene is None:
        return None
    kept = [entry for name, entry in members.items() if name.split("/")[0] not in NOT_VARIED]
    return (
        _Takes(sum(entry.compress_size for entry in kept) + _SURFACES_BYTES, int(_TOLD * scene.compress_size)),
        _Takes(sum(entry.file_size for entry in kept) + _SURFACES_BYTES, int(_TOLD * scene.file_size)),
    )


def _shape(project: Project, made: VariantFiles) -> schemas.VariantSet:
    said, name = json.loads(made.facts.read_text()), made.folder.name
    version = int(name.split("-")[0].removeprefix("v"))
    at = f"/media/{project.id}/variants/{name}"
    return schemas.VariantSet(
        **said,
        name=name,
        version=version,
        url=f"{at}.zip",
        wall=f"{at}.jpg?v={said['sha256'][:8]}",
        file_name=f"{queries.plain_name(project.name)}-{name}-variants.zip",
    )
