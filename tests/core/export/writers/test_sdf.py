"""scene.sdf beside scene.xml."""

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest

from r2c2r_core.export.writers.text import rotation_of


def test_light_and_camera_are_those_of_the_mjcf(good_folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(good_folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    world = ET.parse(good_folder / "scene.sdf").getroot()[0]

    def numbers(path: str) -> np.ndarray:
        return np.array([float(word) for word in (world.findtext(path) or "").split()])

    np.testing.assert_allclose(numbers("light[@name='sun']/direction"), model.light("sun").dir, atol=1e-6)
    np.testing.assert_allclose(numbers("light[@name='sun']/diffuse")[:3], model.light("sun").diffuse)
    np.testing.assert_allclose(numbers("scene/ambient")[:3], model.vis.headlight.ambient)
    floor, camera = numbers("model[@name='floor']/pose"), numbers(".//sensor[@name='front']/pose")
    np.testing.assert_allclose(floor[:3] + camera[:3], data.cam("front").xpos, atol=1e-6)
    right, up, backward = data.cam("front").xmat.reshape(3, 3).T
    np.testing.assert_allclose(rotation_of(camera[3:]), np.column_stack([-backward, -right, up]), atol=1e-6)  # SDF: x forward
    width, height = numbers(".//sensor/camera/image/width")[0], numbers(".//sensor/camera/image/height")[0]
    across = np.tan(numbers(".//sensor/camera/horizontal_fov")[0] / 2)
    assert np.degrees(2 * np.arctan(across * height / width)) == pytest.approx(model.cam("front").fovy[0])
