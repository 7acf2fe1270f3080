"""Export stage: writes, certifies and packs a bundle; also certifies an existing bundle."""

import json
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.disk import explained_io
from r2c2r_core.errors import BundleError, ExportFailed
from r2c2r_core.export.archive import building_folder, opened_bundle, replace_folder, write_zip
from r2c2r_core.export.certify import certificate_to_json, certify
from r2c2r_core.export.gripping import SCENE, arm_tried, begin_gripping
from r2c2r_core.export.handles import with_handles
from r2c2r_core.export.lint import lint
from r2c2r_core.export.looks import looks_of
from r2c2r_core.export.manifest import manifest_of, with_blockers
from r2c2r_core.export.pictures import write_pictures
from r2c2r_core.export.plan import ASSETS, Plan, plan_bundle
from r2c2r_core.export.preview import preview_png
from r2c2r_core.export.readme import readme_text
from r2c2r_core.export.report import report_html, report_of
from r2c2r_core.export.review import review_html
from r2c2r_core.export.rules.table import UNSAFE
from r2c2r_core.export.scan_fit import ScanFit, scan_fits
from r2c2r_core.export.seal import check_seal, checksums
from r2c2r_core.export.seen import Seen, seen_sides
from r2c2r_core.export.simulate import compiled
from r2c2r_core.export.support import supported
from r2c2r_core.export.together import conflicts
from r2c2r_core.export.writers.meshes import write_body
from r2c2r_core.export.writers.table import formats, write_formats
from r2c2r_core.failing import apart
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.reconstruction import Reconstruction
from r2c2r_core.model.report import Certificate
from r2c2r_core.model.scene import ArticulatedScene
from r2c2r_core.pool import Pool
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.robot.arm_certificate import ArmCertificate, arm_to_json, certify_with_arm
from r2c2r_core.robot.certificate import GripperCertificate, certify_with_gripper, gripper_to_json
from r2c2r_core.schema.settings import setting

__all__ = [
    "ExportConfig",
    "arm_to_json",
    "certificate_to_json",
    "check_bundle",
    "grip_bundle",
    "gripper_to_json",
    "reach_bundle",
    "write_bundle",
]

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportConfig:
    """How a bundle is written."""

    texture_max_px: int = setting(2048, "longest side of a texture, in px: WebGL 2 guarantees no more", ge=16, le=16384)
    keep_folder: bool = setting(False, "whether to keep the unpacked bundle beside the zip, under its name without .zip")
    pictures: bool = setting(True, "whether report.html shows a photo beside the model for each object")
    gripper: bool = setting(True, "whether a gripper tries every joint and free object; report.html shows pictures of it")
    arm: bool = setting(
        False, "whether a Franka Panda tries every joint within reach; report.html shows its base positions (extra arm)"
    )


def write_bundle(
    reconstruction: Reconstruction,
    destination: Path,
    config: ExportConfig,
    pool: Pool | None = None,
    *,
    created: str | None = None,
    progress: Progress = SILENT,
) -> Certificate:
    """Write the certified bundle to `destination` (a .zip) and return its certificate, passed or not.

    The gripper trials run in the processes of `pool` (None: this one) in parallel with the other tests.

    The zip is written atomically, and equal inputs give equal bytes: `created` (ISO 8601) is the only time in it; None uses
    SOURCE_DATE_EPOCH, or omits it. Raises ExportFailed on a scene without objects and EnvironmentProblem on a full disk.
    """
    with building_folder(destination) as scratch:
        folder = scratch / "bundle"
        folder.mkdir()
        progress.at(0.0, "writing meshes")
        plan, lost = _with_meshes(reconstruction.scene, folder, config.texture_max_px)
        reconstruction = replace(
            reconstruction, scene=_without(reconstruction.scene, lost), failures=reconstruction.failures | lost
        )
        plan = write_scene(plan, folder)  # first, as the gripper trials need it
        gripped = begin_gripping(folder, pool or Pool(1), progress.part(0.7, 0.9)) if config.gripper else None
        write_formats(plan, folder, [entry for entry in formats() if entry.file != SCENE], progress=progress.part(0.05, 0.1))
        fits, seen, pictures = dict[str, ScanFit](), dict[str, Seen](), dict[str, str]()
        with apart("export", "measuring the fit to the scan", {}):
            looks = looks_of(reconstruction.capture, plan)
            seen = seen_sides(reconstruction, plan, looks)
            fits = scan_fits(reconstruction, plan, looks, progress=progress.part(0.1, 0.2))
        manifest = manifest_of(reconstruction, plan, created or _epoch_of_the_build(), fits, seen)
        _write_json(folder / "manifest.json", manifest)
        (folder / "README.txt").write_text(readme_text(plan))
        progress.at(0.2, "drawing the preview")
        with apart("export", "preview.png", {}):  # the certificate reports it as missing
            (folder / "preview.png").write_bytes(preview_png(plan, _filmed_from(reconstruction.capture)))
        with apart("export", "pictures", {}):
            if config.pictures:
                pictures = write_pictures(reconstruction, plan, folder, progress=progress.part(0.3, 0.4))
        certificate = certify(folder, progress=progress.part(0.4, 0.7))
        gripper = gripped() if gripped is not None else None
        arm = arm_tried(folder, progress.part(0.85, 0.9)) if config.arm else None
        manifest = with_blockers(manifest, plan, certificate.joints)
        _write_reports(folder, manifest, certificate, reconstruction.failures, pictures, gripper, arm)
        with apart("export", "review.html", {}):
            review = review_html(plan, certificate, _filmed_from(reconstruction.capture), seen)
            (folder / "review.html").write_text(review, encoding="utf-8")
        _write_json(
            folder / "manifest.json", manifest | {"files": checksums(folder)}
        )  # last, as it contains the other files' checksums
        progress.at(0.9, "packing")
        write_zip(folder, scratch / "bundle.zip")
        (scratch / "bundle.zip").replace(destination)
        if config.keep_folder:
            replace_folder(folder, destination.with_suffix(""))
    progress.at(1.0, "certified bundle" if certificate.passed else "bundle written, its certificate failed")
    return replace(certificate, left_out=lost)


def write_scene(plan: Plan, folder: Path) -> Plan:
    """Write scene.xml; returns the plan with the joints that cannot be open at once, which takes a first one to find."""
    entries = [entry for entry in formats() if entry.file == SCENE]
    write_formats(plan, folder, entries)
    if (folder / SCENE).is_file():
        with apart("export", "which joints can be open at once", {}):
            plan = replace(plan, conflicts=conflicts(compiled(folder / SCENE, strict=True, keep_free=True)))
            write_formats(plan, folder, entries)
    return plan


def _with_meshes(scene: ArticulatedScene, folder: Path, texture_max_px: int) -> tuple[Plan, dict[str, str]]:
    """Write the meshes; returns the plan of the written objects, and the reason for each object left out."""
    lost: dict[str, str] = {}
    for item in scene.objects:
        with apart("export", item.name, lost):
            plan_bundle(replace(scene, objects=(item,)))
    plan = plan_bundle(_without(scene, lost))
    for item in scene.objects:
        with apart("export", item.name, lost):
            for body in plan.of(item.name):
                write_body(body, folder, texture_max_px)
    for name in lost:
        shutil.rmtree(folder / ASSETS / name, ignore_errors=True)
    written = replace(plan, bodies=tuple(body for body in plan.bodies if body.object_name not in lost))
    return with_handles(supported(written)), lost


def _without(scene: ArticulatedScene, lost: Mapping[str, str]) -> ArticulatedScene:
    left = tuple(item for item in scene.objects if item.name not in lost)
    if scene.objects and not left:
        raise ExportFailed("no object can be written", hint="; ".join(lost.values()))
    return replace(scene, objects=left)


def check_bundle(path: Path, *, sapien_python: str | None = None, progress: Progress = SILENT) -> Certificate:
    """Certify an existing bundle, zip or folder, including its files' checksums.

    Raises BundleError on a foreign, truncated or unsafe one.
    """
    with opened_bundle(path) as folder, explained_io(path):
        differences = check_seal(folder)
        certificate = certify(folder, sapien_python=sapien_python, progress=progress)
    changed = any(found.severity == "error" for found in differences)
    findings = sorted((*certificate.findings, *differences), key=lambda found: found.severity)
    return replace(certificate, passed=certificate.passed and not changed, findings=tuple(findings))


def grip_bundle(path: Path, films: Path | None = None, *, progress: Progress = SILENT) -> GripperCertificate:
    """Let the gripper open every joint of a bundle, zip or folder, and move its free objects; films go to the folder `films`.

    Raises BundleError on a foreign, truncated or unsafe one, and on one without a readable scene.xml.
    """
    return _tried(path, lambda scene: certify_with_gripper(scene, films, progress=progress))


def reach_bundle(path: Path, films: Path | None = None, *, progress: Progress = SILENT) -> ArmCertificate:
    """Let an arm open every reachable joint of a bundle; films and the map of its base positions go to `films`.

    Raises as grip_bundle does, and BackendUnavailable without the arm's extra.
    """
    return _tried(path, lambda scene: certify_with_arm(scene, films, progress=progress))


def _tried(path: Path, certified: Callable[[Path], T]) -> T:
    with opened_bundle(path) as folder, explained_io(path):
        unsafe = [found for found in lint(folder) if found.rule in UNSAFE]
        if unsafe:
            raise BundleError(
                f"{path}: {unsafe[0].message}", hint="bundles that refer to files outside themselves are not simulated"
            )
        try:
            return certified(folder / SCENE)
        except ValueError as error:
            why = str(error).partition("\n")[0]
            raise BundleError(f"{path}: MuJoCo cannot load scene.xml ({why})", hint="see r2c2r check") from error


def _write_reports(
    folder: Path,
    manifest: dict[str, Any],
    certificate: Certificate,
    failures: dict[str, str],
    pictures: dict[str, str],
    gripper: dict[str, Any] | None,
    arm: dict[str, Any] | None,
) -> None:
    report = report_of(manifest, certificate, failures, gripper, arm)
    _write_json(folder / "report.json", report)
    (folder / "report.html").write_text(report_html(manifest, report, pictures), encoding="utf-8")


def _write_json(path: Path, document: dict[str, Any]) -> None:
    path.write_text(json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8")


def _filmed_from(capture: Capture) -> Vector3 | None:
    """The middle of the camera's path, in the world."""
    if not capture.frames:
        return None
    return np.asarray(np.mean([frame.world_from_camera.translation for frame in capture.frames], axis=0))


def _epoch_of_the_build() -> str | None:
    """SOURCE_DATE_EPOCH as ISO 8601 (reproducible-builds.org), or None."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH", "")
    return datetime.fromtimestamp(int(seconds), UTC).isoformat() if seconds.isdigit() else None
