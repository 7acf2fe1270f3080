"""Reading of overrides.json, the manual corrections saved beside the recording; absent keys are computed."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from r2c2r_core.documents import read_json
from r2c2r_core.errors import OverrideError
from r2c2r_core.model.inputs import Overrides, Prompts
from r2c2r_core.schema.document import checked
from r2c2r_core.schema.overrides import OverridesFile

NO_OVERRIDES = Overrides(objects={})
_HINT = "see `r2c2r schema overrides`"


def read_overrides(path: Path) -> Overrides:
    """Corrections from a file (`r2c2r schema overrides` describes it); raises OverrideError."""
    return overrides_from(read_json(path, OverrideError, hint=_HINT), path)


def overrides_from(document: Any, path: Path) -> Overrides:
    """Corrections from a parsed document; `path` names it in errors and anchors relative mesh files."""
    file = checked(OverridesFile, document, str(path), OverrideError, hint=_HINT)
    return file.room({name: entry.override(_found(entry.candidate, path.parent)) for name, entry in file.objects.items()})


def with_drawn_hinges(overrides: Overrides, prompts: Prompts) -> Overrides:
    """The corrections with the hinge sides of drawn fronts added where not corrected."""
    drawn = {item.name: item.front.hinge for item in prompts.objects if item.front is not None and item.front.hinge is not None}
    said = {name: overrides.of(name) for name in drawn}
    hinges = {name: replace(said[name], hinge=said[name].hinge or side) for name, side in drawn.items()}
    return replace(overrides, objects={**overrides.objects, **hinges})


def unused_corrections(overrides: Overrides, prompts: Prompts) -> list[str]:
    """A line for every corrected object that the prompts do not name, such as a misspelt one."""
    names = {item.name for item in prompts.objects}
    return [
        f"{name} is corrected but not in the prompts: its correction is ignored"
        for name in sorted(overrides.objects.keys() - names)
    ]


def _found(candidate: str | None, folder: Path) -> str | None:
    """Path of the mesh file if it exists, else the candidate's id."""
    if candidate is None:
        return None
    try:
        return str((folder / candidate).resolve()) if (folder / candidate).is_file() else candidate
    except (OSError, ValueError):  # no file can have that name
        return candidate
