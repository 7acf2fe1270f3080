"""Variants of a bundle for training: small MJCF files that share the meshes and textures of one copy of the bundle."""

import json
import shutil
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from r2c2r_core.disk import explained_io
from r2c2r_core.errors import BundleError, InputError, StageError
from r2c2r_core.export.archive import opened_bundle
from r2c2r_core.export.lint import lint
from r2c2r_core.export.rules.table import UNSAFE
from r2c2r_core.export.simulate import simulate
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.texts import fault_of
from r2c2r_core.variants.draw import NOT_VARIED, Variation, draw
from r2c2r_core.variants.judge import colliders_of, start_of, unfit
from r2c2r_core.variants.overlay import add_start, varied
from r2c2r_core.variants.textures import write_textures
from r2c2r_core.variants.wall import WALL, write_wall

VARIANTS_VERSION = 2
CERTIFIED = 20  # number of random variants that undergo the complete simulation tests
_ATTEMPTS = 40  # maximum draws per variant
_CERTIFIED_DRAWS = 5  # of them, maximum that undergo the complete tests
_FAILS = "it fails the certificate"


@dataclass(frozen=True, slots=True, kw_only=True)
class Variants:
    """The written variants."""

    folder: Path
    names: tuple[str, ...]
    rejected: dict[str, int]  # number of rejected draws by reason
    certified: dict[str, bool]  # results of the completely tested ones

    @property
    def wall(self) -> Path:
        """Picture of the first variants."""
        return self.folder / "wall.jpg"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Base:
    """The bundle to be varied."""

    folder: Path
    scene: ET.Element
    objects: tuple[dict[str, Any], ...]
    halves: dict[str, np.ndarray]  # half the sides of each object
    links: dict[str, str]  # object by body


def make_variants(bundle: Path, count: int, seed: int, folder: Path, *, progress: Progress = SILENT) -> Variants:
    """Write `count` variants of a bundle to a new folder; deterministic for a bundle and a seed.

    Raises BundleError on an incomplete bundle, and StageError where none of 40 draws is valid.
    """
    if folder.exists() and any(folder.iterdir()):
        raise InputError(f"{folder}: is not empty", hint="name a new folder")
    with explained_io(folder):
        base = _copied(bundle, folder / "base")
        write_textures(folder / "textures")
        (folder / "variants").mkdir()
        names = tuple(f"{index:05d}" for index in range(count))
        paths = [folder / "variants" / f"{name}.xml" for name in names]
        reasons: list[list[str]] = [[] for _ in names]  # why earlier draws of each were rejected
        indices = progress.part(0.0, 0.7).each(range(count), "variant")
        entries = [_fit_variant(base, seed, index, reasons[index], paths[index]) for index in indices]
        chosen = sorted(np.random.default_rng([seed, count]).permutation(count)[:CERTIFIED])
        certified = {}
        for index in progress.part(0.7, 0.95).each(chosen, "certifying variant"):
            while not (passed := _passes(paths[index])) and reasons[index].count(_FAILS) + 1 < _CERTIFIED_DRAWS:
                reasons[index].append(_FAILS)
                entries[index] = _fit_variant(base, seed, index, reasons[index], paths[index])
            certified[names[index]] = passed
        rejected = Counter(sorted(why for each in reasons for why in each))
        made = Variants(folder=folder, names=names, rejected=rejected, certified=certified)
        write_wall(paths[:WALL], made.wall)
        _write_manifest(made, seed, entries)
    progress.at(1.0, "variants")
    return made


def base_of(folder: Path) -> Base:
    """A bundle's folder, read for varying; raises BundleError where it lacks scene.xml or its manifest."""
    try:
        scene = ET.fromstring((folder / "scene.xml").read_text(encoding="utf-8"))
        objects = tuple(json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["objects"])
    except (OSError, ValueError, KeyError, ET.ParseError) as error:
        raise BundleError(f"{folder}: no bundle to vary ({fault_of(error)})", hint="give one that r2c2r run wrote") from error
    if any(each.get("randomize") is None for entry in objects for each in (entry, *entry["joints"])):
        raise BundleError(f"{folder}: its manifest states no ranges to vary within", hint="write the bundle again: r2c2r run")
    names = sorted((entry["name"] for entry in objects), key=len, reverse=True)
    links = {}
    for body in scene.iter("body"):
        owner = next((name for name in names if body.get("name", "").startswith(f"{name}_")), None)
        if owner is not None:
            links[body.get("name", "")] = owner
    halves = {entry["name"]: np.array(entry["dimensions_m"]) / 2 for entry in objects}
    return Base(folder=folder, scene=scene, objects=objects, halves=halves, links=links)


def _copied(bundle: Path, folder: Path) -> Base:
    if not bundle.exists():
        raise BundleError(f"{bundle}: there is no such file", hint="give a bundle: a .zip or its folder")
    with opened_bundle(bundle) as opened:
        unsafe = [found for found in lint(opened) if found.rule in UNSAFE]
        if unsafe:
            raise BundleError(f"{bundle}: {unsafe[0].message}", hint="give a bundle that refers to no files outside itself")
        shutil.copytree(opened, folder, ignore=lambda within, _: NOT_VARIED if Path(within) == opened else ())
    return base_of(folder)


def _fit_variant(base: Base, seed: int, index: int, reasons: list[str], path: Path) -> dict[str, Any]:
    """Write the first valid draw after those rejected for these reasons, which it completes; returns its manifest entry."""
    for attempt in range(len(reasons), _ATTEMPTS):
        variation = draw(np.random.default_rng([seed, index, attempt]), base.objects)
        root = varied(base.scene, variation, base.halves, base.links)
        model = colliders_of(root, base.folder)
        start = start_of(model, variation)
        ajar = {name: float(start[model.joint(name).qposadr[0]]) for name in variation.ajar}
        why = unfit(model, ajar)
        if why is None:
            add_start(root, start)
            path.write_text(ET.tostring(root, encoding="unicode") + "\n", encoding="utf-8")
            return {"name": path.stem, "draws": len(reasons) + 1, **_described(variation)}
        reasons.append(why)
    said = ", ".join(f"{count} times {why}" for why, count in Counter(reasons).most_common())
    raise StageError(f"variant {index}: none of {_ATTEMPTS} draws is valid ({said})", hint="check the bundle: r2c2r check")


def _passes(scene: Path) -> bool:
    """Whether the simulation certificate finds no error."""
    return not any(found.severity == "error" for found in simulate(scene).findings)


def _described(variation: Variation) -> dict[str, Any]:
    """The variation as JSON values, rounded for reading."""
    return json.loads(json.dumps(asdict(variation)), parse_float=lambda text: round(float(text), 5))


def _write_manifest(made: Variants, seed: int, entries: list[dict[str, Any]]) -> None:
    document = {
        "version": VARIANTS_VERSION,
        "seed": seed,
        "count": len(made.names),
        "base": "base",
        "rejected": made.rejected,
        "certified": made.certified,
        "variants": entries,
    }
    (made.folder / "variants.json").write_text(json.dumps(document) + "\n", encoding="utf-8")
