"""Table of the bundle's formats. A new one needs a file here and a line in FORMATS, read by linter, reports and app."""

import logging
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from r2c2r_core.export.plan import Plan
from r2c2r_core.export.writers.glb import check_glb, write_glb
from r2c2r_core.export.writers.mjcf import write_mjcf
from r2c2r_core.export.writers.ros import write_ros
from r2c2r_core.export.writers.sdf import write_sdf
from r2c2r_core.export.writers.urdf import write_urdf
from r2c2r_core.export.writers.usd import write_usd
from r2c2r_core.failing import OBJECT_FAILS
from r2c2r_core.plugins import added
from r2c2r_core.progress import SILENT, Progress

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One file format of the scene in the bundle."""

    name: str
    file: str
    opened_by: str
    reads_meshes: bool  # also uses the meshes below assets/
    write: Callable[[Plan, Path], None]
    loses: tuple[str, ...]  # information that this file does not contain
    others: tuple[str, ...] = ()  # further files and folders of this format, in the bundle
    assets: str | None = None  # suffix of its file for each object below assets/
    required: bool = True  # a bundle without it is incomplete; older bundles lack some formats
    check: Callable[[Path], Iterable[str]] | None = None  # errors in a written file, one line each

    def owns(self, path: str) -> bool:
        """Whether a file of the bundle belongs to this format: its scene, its assets, or its other files."""
        own = path == self.file or any(path == other or path.startswith(f"{other}/") for other in self.others)
        return own or (path.startswith("assets/") and PurePosixPath(path).suffix == self.assets)


FORMATS: tuple[Format, ...] = (
    Format(
        name="urdf",
        assets=".urdf",
        file="scene.urdf",
        opened_by="ROS, PyBullet, SAPIEN, MuJoCo, Isaac's importer",
        reads_meshes=True,
        write=write_urdf,
        loses=(
            "free-standing things are fixed where they stand (loaders disagree on floating joints)",
            "no floor, no contact exclusions, no surface friction, no joint armature, no stays: flaps sink when let go "
            "(URDF cannot express them)",
            "SAPIEN's loader drops the friction, effort and velocity of joints: set them as README.txt says",
            "where each number comes from: see manifest.json",
        ),
        others=("scene.srdf",),
    ),
    Format(
        name="mjcf",
        assets=".xml",
        file="scene.xml",
        opened_by="MuJoCo, with textures",
        reads_meshes=True,
        write=write_mjcf,
        loses=("joint velocity limits (MuJoCo has none)", "where each number comes from: see manifest.json"),
    ),
    Format(
        name="usd",
        assets=".usda",
        file="scene.usda",
        opened_by="Isaac Sim, Omniverse",
        reads_meshes=True,
        write=write_usd,
        loses=(
            "fixtures without a joint are static: their mass is written, but engines ignore it",
            "dry friction and maximum velocity of joints, and stays of flaps, are PhysX attributes; other engines lack them",
            "where each number comes from: see manifest.json",
        ),
        others=("scene.usdz",),
    ),
    Format(
        name="glb",
        assets=".glb",
        file="scene.glb",
        opened_by="the web, editors",
        reads_meshes=False,
        write=write_glb,
        check=check_glb,
        loses=("masses, colliders and joint dynamics: it is for viewing; joints are animation clips that open and close them",),
    ),
    Format(
        name="sdf",
        file="scene.sdf",
        opened_by="Gazebo, Drake",
        reads_meshes=True,
        write=write_sdf,
        required=False,
        loses=("no joint armature, no contact exclusions, no handles and labels (SDF cannot express them)",),
    ),
    Format(
        name="ros",
        file="package.xml",
        opened_by="ROS 2: colcon build, then ros2 launch; RViz",
        reads_meshes=True,
        write=write_ros,
        required=False,
        others=("CMakeLists.txt", "ros"),
        loses=("as scene.urdf; its handles are frames",),
    ),
)
"""The project's own, in every bundle; `formats()` also has those of other packages."""


def formats() -> tuple[Format, ...]:
    """All formats, the project's own first; an added format cannot replace an existing file."""
    taken = {entry.file for entry in FORMATS}
    return (*FORMATS, *(entry for entry in added("r2c2r.formats", Format) if entry.file not in taken))


def write_formats(plan: Plan, folder: Path, wanted: Collection[Format], *, progress: Progress = SILENT) -> None:
    """Write each wanted format; one that fails is skipped with a logged warning and reported missing in the certificate.

    scene.urdf, the reference of the tests, must be written; failures independent of the scene (a full disk) end the export.
    """
    for entry in progress.each(wanted, "writing"):
        try:
            entry.write(plan, folder / entry.file)
        except Exception as error:
            if entry in FORMATS and (entry.name == "urdf" or not isinstance(error, OBJECT_FAILS)):
                raise
            (folder / entry.file).unlink(missing_ok=True)
            _LOG.warning("%s is left out of the bundle: %s: %s", entry.file, type(error).__name__, error)
