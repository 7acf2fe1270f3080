"""Serialisation of a project's rows to the `project.json` of its folder, and back."""

import json
from collections import defaultdict
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from sqlmodel import Session, col, select

from app.db import queries
from app.db.tables import Bundle, Comment, Event, Override, Project, SceneObject, TrueLength, Verdict
from app.files import ProjectFiles
from app.schemas.description import DescribedObject, DescribedPoint, Description
from r2c2r_core.errors import InputError

_OF_ACCOUNTS = {"owner_id", "assignee_id"}  # described by name, as account numbers differ between databases
_UNDESCRIBED = {"project_id", "version", "masks_key", "inputs"}  # of an object: derived, or given by the database
_DERIVED = {"certificate"}  # stored in the bundle itself


def describe(session: Session, project: Project, files: ProjectFiles) -> Description:
    """Description of all user-made content of the project, in a fixed number of queries."""
    of_project = SceneObject.project_id == project.id
    objects = session.exec(select(SceneObject).where(of_project).order_by(col(SceneObject.id))).all()
    points: dict[int, list[DescribedPoint]] = defaultdict(list)
    for number, clicks in queries.clicks_by_object(session, project.id).items():
        points[number] = [DescribedPoint.model_construct(frame=c.frame, x=c.x, y=c.y, label=c.label) for c in clicks]
    verdicts: dict[int, list[dict[str, Any]]] = defaultdict(list)
    for verdict in session.exec(select(Verdict).join(SceneObject).where(of_project).order_by(col(Verdict.id))):
        verdicts[verdict.object_id].append(verdict.model_dump(exclude={"id", "object_id"}))
    overrides = {row.object_id: row.data for row in session.exec(select(Override).where(Override.project_id == project.id))}
    comments = session.exec(select(Comment).where(Comment.project_id == project.id).order_by(col(Comment.id)))
    lengths = session.exec(select(TrueLength).where(TrueLength.project_id == project.id).order_by(col(TrueLength.id)))
    bundles = session.exec(select(Bundle).where(Bundle.project_id == project.id).order_by(col(Bundle.version)))
    owner = queries.owner(session, project)
    return Description(
        id=project.id,
        changed=changed(session, project),
        project=relative(project.model_dump(exclude=_OF_ACCOUNTS), files.root),
        owner=owner,
        assignee=queries.account_name(session, project.assignee_id),
        members=sorted(queries.who_sees(session, project) - {owner}),
        objects=[
            DescribedObject(
                **item.model_dump(exclude=_UNDESCRIBED),
                points=points[item.id or 0],
                override=relative(overrides.get(item.id, {}), files.root),
                verdicts=verdicts[item.id or 0],
            )
            for item in objects
        ],
        comments=[row.model_dump(exclude={"id", "project_id"}) for row in comments],
        true_lengths=[row.model_dump(exclude={"id", "project_id"}) for row in lengths],
        bundles=[row.model_dump(exclude={"id", "project_id", *_DERIVED}) for row in bundles],
    )


def changed(session: Session, project: Project) -> float:
    """Time of the last change of the project."""
    last = session.exec(select(Event.at).where(Event.project_id == project.id).order_by(col(Event.id).desc())).first()
    return max(project.updated, last or 0.0)


def read_description(path: Path) -> Description:
    """Read a project.json; raises InputError for an invalid file, FileNotFoundError for a missing one."""
    try:
        return Description.model_validate_json(path.read_bytes())
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        raise InputError(f"{path}: {where}: {first['msg']}", hint="expected a project.json of version 1") from error


def relative(row: dict[str, Any], root: Path) -> dict[str, Any]:
    """The row with paths below `root` made relative to it, as a folder may be moved."""
    inside = f"{root}/"
    return {key: v.removeprefix(inside) if isinstance(v, str) else v for key, v in row.items()}


def placed(row: dict[str, Any], root: Path, *names: str) -> dict[str, Any]:
    """The row with these path fields made absolute below `root`, where such a file exists."""
    found = {name: str(root / row[name]) for name in names if isinstance(row.get(name), str) and (root / row[name]).exists()}
    return {**row, **found}


def written(description: Description) -> bytes:
    """The file's content."""
    return json.dumps(description.model_dump(), separators=(",", ":")).encode()
