"""A bundle's content for robots: single objects, robot trials, and loading code for simulators."""

import io
import json
import zipfile
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote

from app import schemas
from app.errors import NotFound
from app.jobs.plain import plain
from app.services.bundles import BundleFile, file, kept_part, root_of
from app.services.context import Context
from app.services.scenes import manifest
from r2c2r_core.export.simulators import recipes
from r2c2r_core.robot.arms import MAP


def inside(context: Context, project_id: str, version: int) -> schemas.BundleInside:
    """Robot content of one version."""
    bundle = file(context, project_id, version).path
    said = manifest(bundle)
    with zipfile.ZipFile(bundle) as archive:
        names = archive.namelist()
        report = _report(archive)
    at = f"/media/{project_id}/bundles/{version}"
    objects = said.get("objects", [])
    assets = [_asset(entry, names, at) for entry in objects]
    first = next((asset.name for asset in assets if asset.formats), "OBJECT")
    robots = [trial("A parallel gripper", "gripper", report.get("gripper"), at), trial("An arm", "arm", report.get("arm"), at)]
    lines = recipes(said.get("capture", {}).get("name", ""), first)
    return schemas.BundleInside(
        version=version,
        assets=[asset for asset in assets if asset.formats],
        robots=[robot for robot in robots if robot is not None],
        simulators=[schemas.SimulatorLines.model_validate(plain(recipe)) for recipe in lines],
    )


def object_alone(context: Context, project_id: str, version: int, name: str) -> BundleFile:
    """A zip with one object's assets and meshes, created once."""
    whole = file(context, project_id, version)
    if name not in {entry["name"] for entry in manifest(whole.path).get("objects", [])}:
        raise NotFound(f"the bundle has no object {name[:60]!r}", hint="see its list of objects")
    return kept_part(context, project_id, whole, version, f"object-{name}", lambda: _only(whole.path, name))


def _only(bundle: Path, name: str) -> bytes:
    """Zip of the object's files, with relative paths preserved; bundles of older versions keep its meshes in meshes/."""
    made = io.BytesIO()
    with zipfile.ZipFile(bundle) as archive, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as out:
        top = root_of(archive)
        for entry in archive.infolist():
            if PurePosixPath(entry.filename.removeprefix(top)).parts[:2] in (("assets", name), ("meshes", name)):
                out.writestr(entry.filename.removeprefix(top), archive.read(entry))
    return made.getvalue()


def _asset(entry: dict[str, Any], names: list[str], at: str) -> schemas.ObjectAsset:
    name = entry["name"]
    own = [path for path in map(PurePosixPath, names) if path.parts[-3:-1] == ("assets", name) and path.stem == name]
    url = f"{at}/objects/{quote(name)}.zip"
    return schemas.ObjectAsset(name=name, category=entry["category"], formats=sorted(path.suffix for path in own), url=url)


def trial(name: str, folder: str, said: dict[str, Any] | None, at: str) -> schemas.RobotTrial | None:
    """A robot's trial, or the reason why it failed; None where none was requested or nothing moves."""
    if said and "why" in said:
        return schemas.RobotTrial(name=name, joints=0, joints_opened=0, grips=[], why=said["why"])
    if not said or not said.get("grips"):
        return None
    keys = ("kind", "name", "method", "passed", "grip_n", "opened", "why")

    def picture(film: str | None) -> str | None:
        return f"{at}/pictures/{folder}/{quote(film)}.jpg" if film else None

    return schemas.RobotTrial(
        name=said["arm"]["name"] if "arm" in said else name,
        joints=said["joints"],
        joints_opened=said["joints_opened"],
        grips=[
            schemas.RobotGrip(**{key: grip.get(key) for key in keys}, picture=picture(grip.get("film")))
            for grip in said["grips"]
        ],
        places=[
            schemas.StandingPlace(**{key: place[key] for key in ("x_m", "y_m", "lift_m", "joints")})
            for place in said.get("places", [])
        ],
        map=f"{at}/pictures/arm/{MAP}" if "places" in said else None,
    )


def _report(archive: zipfile.ZipFile) -> dict[str, Any]:
    try:
        found: dict[str, Any] = json.loads(archive.read(f"{root_of(archive)}report.json"))
    except (KeyError, ValueError):
        return {}
    return found
