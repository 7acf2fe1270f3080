"""Projects as a run leaves them, with the small kitchen as exported."""

import atexit
import shutil
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from sqlmodel import select

from app.db.engine import opened, writing
from app.db.queries import project_row
from app.db.tables import Job, Project
from app.jobs.outcomes import adopt_bundle, keep_bundle
from app.settings import DATABASE
from r2c2r_core.model.report import Certificate
from r2c2r_core.workspace import Workspace
from tests.app.conftest import Running, running
from tests.app.nouns import finish
from tests.core.export.kitchen import reconstruction


def copy_finished(data: Path) -> str:
    """Fill a data folder with a sample that was run and whose drawer_1 is finished; return the project."""
    made, project = _finished_sample()
    shutil.copytree(made, data)
    with opened(data / DATABASE) as engine, writing(engine) as session:
        for row in session.exec(select(Project)):
            row.source_path = _moved(row.source_path, made, data)
        for job in session.exec(select(Job)):
            job.log_path = _moved(job.log_path, made, data)
    return project


@cache
def _finished_sample() -> tuple[Path, str]:
    """Built once per process."""
    folder = Path(tempfile.mkdtemp(prefix="r2c2r-finished-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    with running(folder / "data") as web:
        project = web.sample()
        web.job(web.post(f"/api/projects/{project}/run", {}, 202)["id"], "done")
        finish(web.settings.data_dir / "projects" / project / "work")
    return folder / "data", project


def _moved(path: str | None, made: Path, data: Path) -> str | None:
    """A path within the copied folder, mapped to its copy."""
    return path and path.replace(str(made), str(data), 1)


def finished_kitchen(web: Running, certificate: Certificate, *bundles: Path) -> str:
    """Project with the small kitchen's nouns and these bundles, oldest first; its id."""
    project = web.sample()
    with writing(web.context.engine) as session:
        row = project_row(session, project)
        files = web.context.files(row)
        keep_nouns(files.work, certificate)
        for bundle in bundles:
            shutil.copyfile(bundle, files.work / "bundle.zip")
            adopt_bundle(session, row, "inputs", keep_bundle(session, row, files))
    return project


def keep_nouns(work: Path, certificate: Certificate) -> None:
    """Store the nouns that a run leaves."""
    Workspace(work).save("ingest", "scene", reconstruction().capture, {"key": "k", "seconds": 1.0})
    keep_results(work, certificate)


def keep_results(work: Path, certificate: Certificate) -> None:
    """Store the same nouns without the recording's; the scene has a warning."""
    run, space = reconstruction(), Workspace(work)
    scene = replace(run.scene, warnings=("cabinet_1 and bottle_1 still overlap by 12 mm: correct a size or a pose",))
    nouns: list[tuple[str, str, Any]] = [("warp", "scene", scene)]
    nouns += [("segment", track.name, track) for track in run.tracks]
    nouns += [("generate", found.object_name, found) for found in run.candidates]
    nouns += [("align", placed.object_name, placed) for placed in run.placements]
    for at, name, noun in [*nouns, ("export", "scene", certificate)]:
        space.save(at, name, noun, {"key": "k", "seconds": 1.0})
