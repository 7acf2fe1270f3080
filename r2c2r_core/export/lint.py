"""The bundle's linter, with all rules here, as yourdfpy's `validate` finds 2 of the 27 defects of sim-ready.md.

It only reads files; tests in a simulator are in `certify.py`.
"""

from pathlib import Path

from r2c2r_core.export.reading import read_urdf
from r2c2r_core.export.rules.agreement import check_agreement
from r2c2r_core.export.rules.assets import check_assets
from r2c2r_core.export.rules.files import BundleFiles
from r2c2r_core.export.rules.inertia import check_inertia
from r2c2r_core.export.rules.joints import check_joints
from r2c2r_core.export.rules.likeness import check_likeness
from r2c2r_core.export.rules.meshes import check_meshes
from r2c2r_core.export.rules.structure import check_structure
from r2c2r_core.model.report import Finding


def lint(folder: Path) -> tuple[Finding, ...]:
    """All findings in a bundle's folder, errors first; raises BundleError when scene.urdf cannot be read at all."""
    urdf = read_urdf(folder / "scene.urdf")
    files = BundleFiles(folder=folder)
    findings = [
        *check_structure(urdf),
        *check_joints(urdf),
        *check_inertia(urdf, files),
        *check_meshes(urdf, files),
        *check_agreement(urdf, files),
        *check_assets(urdf, files),
        *check_likeness(files),
    ]
    return tuple(sorted(findings, key=lambda f: f.severity))
