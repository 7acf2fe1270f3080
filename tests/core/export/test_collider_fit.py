"""Distance between a link's collider and its visual mesh, for known offsets."""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.export.certify import FAR_COLLIDER_M, certify
from r2c2r_core.export.collider_fit import collider_fits
from r2c2r_core.export.reading import Urdf, UrdfLink, UrdfShape, read_urdf
from r2c2r_core.export.rules.files import BundleFiles
from r2c2r_core.geometry.transforms import Rigid3
from tests.core.export.conftest import write_folder
from tests.core.export.kitchen import kitchen

HERE = BundleFiles(folder=Path("nowhere"))


def box(kind: str, size: tuple[float, float, float], at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> UrdfShape:
    pose = Rigid3(np.eye(3), np.array(at))
    return UrdfShape(kind=kind, name="", link_from_shape=pose, mesh=None, scale=np.ones(3), box_m=np.array(size))


def urdf_of(*shapes: UrdfShape) -> Urdf:
    part = UrdfLink(name="part", shapes=shapes, inertial=None)
    return Urdf(name="one", links=(part,), joints=(), mujoco_compiler=None, malformed=())


def test_a_collider_identical_to_its_visual_has_zero_distance() -> None:
    (fit,) = collider_fits(urdf_of(box("visual", (0.4, 0.02, 0.5)), box("collision", (0.4, 0.02, 0.5))), HERE)
    assert fit.drawn_to_collider.most_m < 1e-5  # Open3D measures in single precision
    assert fit.collider_to_drawn.most_m < 1e-5


def test_both_directions_of_collider_distance_are_measured() -> None:
    """The collider covers half of a visual 0.4 m wide: visual to collider up to 0.2 m, collider to visual 5 mm."""
    (fit,) = collider_fits(urdf_of(box("visual", (0.4, 0.02, 0.5)), box("collision", (0.2, 0.01, 0.5), (-0.1, 0.0, 0.0))), HERE)
    assert fit.drawn_to_collider.most_m == pytest.approx(0.2, abs=0.01)
    assert fit.collider_to_drawn.median_m == pytest.approx(0.005, abs=1e-5)


def test_an_enclosed_collider_is_not_measured() -> None:
    drawn = box("visual", (0.4, 0.4, 0.4))
    inside = box("collision", (0.1, 0.1, 0.1))
    (fit,) = collider_fits(urdf_of(drawn, box("collision", (0.4, 0.4, 0.4)), inside), HERE)
    assert fit.collider_to_drawn.most_m < 1e-5


def test_a_link_without_a_collider_has_no_fit() -> None:
    assert collider_fits(urdf_of(box("visual", (0.4, 0.4, 0.4))), HERE) == ()


def test_the_certificate_warns_of_a_collider_far_from_its_visual(tmp_path: Path) -> None:
    folder = write_folder(kitchen(), tmp_path / "kitchen")
    assert {fit.link for fit in collider_fits(read_urdf(folder / "scene.urdf"), BundleFiles(folder=folder))} >= {
        "cabinet_1_door"
    }
    _edit_vertices(folder, lambda x, y, z: (x + 3 * FAR_COLLIDER_M, y, z))
    found = [f for f in certify(folder).findings if f.rule == "collider-far"]
    assert {f.where for f in found} == {"bottle_1_body"}
    assert {f.severity for f in found} == {"warning"}


def test_only_the_direction_in_which_a_collider_is_far_is_reported(tmp_path: Path) -> None:
    """A second collider in the air before a door: all that is drawn still has its own."""
    folder = write_folder(kitchen(), tmp_path / "kitchen")
    path = folder / "scene.urdf"
    tree = ET.parse(path)
    link = tree.find("./link[@name='cabinet_1_door']")
    assert link is not None
    second = ET.SubElement(link, "collision", name="second")
    ET.SubElement(second, "origin", xyz="0.25 -0.3 0.3", rpy="0 0 0")
    ET.SubElement(ET.SubElement(second, "geometry"), "box", size="0.3 0.02 0.3")
    tree.write(path)
    (found,) = [f for f in certify(folder).findings if f.rule == "collider-far"]
    assert found.where == "cabinet_1_door"
    assert found.message.startswith("5 % of its colliders' surface is more than ")
    assert found.message.endswith("mm from all that is visible: a hand stops before it")


def test_a_collider_around_its_visual_is_not_said_to_let_a_hand_through(tmp_path: Path) -> None:
    """A hull over a shape with a dent: a hand stops before what is visible."""
    folder = write_folder(kitchen(), tmp_path / "kitchen")
    _edit_vertices(folder, lambda x, y, z: (x, y, 0.2 * z))
    found = next(f for f in certify(folder).findings if f.message.startswith("5 % of its visible surface"))
    assert found.message.endswith("mm from every collider's: a hand passes through it or stops before it")


def _edit_vertices(folder: Path, moved: Callable[[float, float, float], tuple[float, float, float]]) -> None:
    """Move the vertices of the bottle's visual."""
    path = folder / "assets" / "bottle_1" / "meshes" / "bottle_1_body_vis.obj"
    lines = [line.split() for line in path.read_text().splitlines()]
    lines = [["v", *map(str, moved(*map(float, line[1:])))] if line[:1] == ["v"] else line for line in lines]
    path.write_text("\n".join(" ".join(line) for line in lines) + "\n")
