"""A project as a run leaves it, with the small kitchen as the exporter writes it."""

import shutil
from pathlib import Path
from typing import Any

from app.db.engine import writing
from app.db.queries import project_row
from app.jobs.outcomes import adopt_bundle
from r2c2r_core.model.report import Certificate
from r2c2r_core.workspace import Workspace
from tests.app.conftest import Running
from tests.core.export.kitchen import reconstruction


def finished_kitchen(web: Running, certificate: Certificate, *bundles: Path) -> str:
    """A project with the small kitchen's nouns and these bundles, oldest first; its id."""
    project = web.sample()
    with writing(web.context.engine) as session:
        row = project_row(session, project)
        files = web.context.files(row)
        keep_nouns(files.work, certificate)
        for bundle in bundles:
            shutil.copyfile(bundle, files.work / "bundle.zip")
            adopt_bundle(session, row, files, "inputs")
    return project


def keep_nouns(work: Path, certificate: Certificate) -> None:
    """The nouns a run leaves behind."""
    Workspace(work).save("ingest", "scene", reconstruction().capture, {"key": "k", "seconds": 1.0})
    keep_results(work, certificate)


def keep_results(work: Path, certificate: Certificate) -> None:
    """The same but for the recording, which stays what it is."""
    run, space = reconstruction(), Workspace(work)
    nouns: list[tuple[str, str, Any]] = [("warp", "scene", run.scene)]
    nouns += [("segment", track.name, track) for track in run.tracks]
    nouns += [("generate", found.object_name, found) for found in run.candidates]
    nouns += [("align", placed.object_name, placed) for placed in run.placements]
    for at, name, noun in [*nouns, ("export", "scene", certificate)]:
        space.save(at, name, noun, {"key": "k", "seconds": 1.0})
