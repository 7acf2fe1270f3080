"""ROS 2 package of the bundle: build it with colcon; `ros2 launch <package> view.launch.py` shows it in RViz.

ros/scene.urdf is scene.urdf with `package://` paths and a frame for each handle (a link without mass, only for tf).
"""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from r2c2r_core.export.plan import WORLD, Plan
from r2c2r_core.export.writers.text import numbers, rpy_of
from r2c2r_core.export.writers.urdf import urdf_text

URDF = "ros/scene.urdf"


def write_ros(plan: Plan, path: Path) -> None:
    """Write package.xml and the package's other files."""
    package = package_name(plan.name)
    path.write_text(_PACKAGE.format(package=package))
    files = {"CMakeLists.txt": _CMAKE, URDF: ros_urdf_text(plan), "ros/view.launch.py": _LAUNCH, "ros/view.rviz": _RVIZ}
    for name, text in files.items():
        target = path.parent / name
        target.parent.mkdir(exist_ok=True)
        target.write_text(text.replace("@package@", package).replace("@root@", WORLD))


def package_name(name: str) -> str:
    """A valid ROS package name (REP 144): lower case, starting with a letter, single underscores."""
    word = re.sub(r"_+", "_", re.sub(r"[^a-z0-9]+", "_", name.lower())).strip("_")
    return word if len(word) > 1 and word[0].isalpha() else f"scene_{word}".rstrip("_")


def ros_urdf_text(plan: Plan) -> str:
    """scene.urdf adapted to ROS."""
    robot = ET.fromstring(urdf_text(plan))
    for mesh in robot.iter("mesh"):
        mesh.set("filename", f"package://{package_name(plan.name)}/{mesh.attrib['filename']}")
    for handle in plan.handles:
        pose = plan.body(handle.link).world_from_body.inverse @ handle.world_from_handle
        ET.SubElement(robot, "link", name=handle.name)
        joint = ET.SubElement(robot, "joint", name=f"{handle.name}_to_{handle.link}", type="fixed")
        ET.SubElement(joint, "origin", xyz=numbers(pose.translation), rpy=numbers(rpy_of(pose.rotation)))
        ET.SubElement(joint, "parent", link=handle.link)
        ET.SubElement(joint, "child", link=handle.name)
    ET.indent(robot)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


_PACKAGE = """\
<?xml version="1.0"?>
<package format="3">
  <name>{package}</name>
  <version>0.0.0</version>
  <description>A scanned scene that opens</description>
  <maintainer email="not-stated@recording.invalid">the owner of the recording</maintainer>
  <license file="README.txt">LicenseRef-README</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <exec_depend>robot_state_publisher</exec_depend>
  <exec_depend>joint_state_publisher_gui</exec_depend>
  <exec_depend>rviz2</exec_depend>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""

_CMAKE = """\
cmake_minimum_required(VERSION 3.8)
project(@package@ NONE)
find_package(ament_cmake REQUIRED)
install(DIRECTORY assets ros DESTINATION share/${PROJECT_NAME})
ament_package()
"""

_LAUNCH = '''\
"""Shows the scene in RViz, with a slider for each joint."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    ros = Path(get_package_share_directory("@package@")) / "ros"
    described = {"robot_description": (ros / "scene.urdf").read_text()}
    return LaunchDescription(
        [
            Node(package="robot_state_publisher", executable="robot_state_publisher", parameters=[described]),
            Node(package="joint_state_publisher_gui", executable="joint_state_publisher_gui"),
            Node(package="rviz2", executable="rviz2", arguments=["-d", str(ros / "view.rviz")]),
        ]
    )
'''

_RVIZ = """\
Visualization Manager:
  Class: ""
  Displays:
    - Class: rviz_default_plugins/Grid
      Name: Floor
      Enabled: true
      Value: true
    - Class: rviz_default_plugins/RobotModel
      Name: Scene
      Enabled: true
      Value: true
      Description Source: Topic
      Description Topic:
        Value: /robot_description
        Durability Policy: Transient Local
    - Class: rviz_default_plugins/TF
      Name: Frames
      Enabled: false
      Value: false
  Global Options:
    Fixed Frame: @root@
  Tools:
    - Class: rviz_default_plugins/MoveCamera
  Views:
    Current:
      Class: rviz_default_plugins/Orbit
      Distance: 4
      Target Frame: <Fixed Frame>
"""
