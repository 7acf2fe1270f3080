"""The formats of a bundle. A new one is a file here and a line in FORMATS; `lint.py` re-reads it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from r2c2r_core.export.plan import Plan
from r2c2r_core.export.writers.glb import write_glb
from r2c2r_core.export.writers.mjcf import write_mjcf
from r2c2r_core.export.writers.urdf import write_urdf
from r2c2r_core.export.writers.usd import write_usd


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One file of the bundle that carries the scene."""

    file: str
    write: Callable[[Plan, Path], None]
    loses: tuple[str, ...]  # what a reader of this file alone does not get


FORMATS = (
    Format(
        file="scene.urdf",
        write=write_urdf,
        loses=(
            "free-standing things are fixed where they stand (loaders disagree on floating joints)",
            "no floor, no contact exclusions, no surface friction and no joint armature (URDF has no words for them)",
            "SAPIEN's loader drops the friction, effort and velocity of joints: set them as README.txt says",
            "where each number comes from: see manifest.json",
        ),
    ),
    Format(
        file="scene.xml",
        write=write_mjcf,
        loses=("joint velocity limits (MuJoCo has none)", "where each number comes from: see manifest.json"),
    ),
    Format(
        file="scene.usda",
        write=write_usd,
        loses=(
            "fixtures without a joint are static: their mass is written, engines do not use it",
            "dry friction and largest velocity of joints are in PhysX's words; other engines see damping and effort only",
            "where each number comes from: see manifest.json",
        ),
    ),
    Format(
        file="scene.glb",
        write=write_glb,
        loses=(
            "masses, colliders and how joints resist: it is the scene to look at; joints are clips that open and close them",
        ),
    ),
)
