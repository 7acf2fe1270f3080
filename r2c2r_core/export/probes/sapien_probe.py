"""Load a URDF in SAPIEN and write what it holds: `python sapien_probe.py scene.urdf answer.json`.

Runs in SAPIEN's own environment, so it imports nothing of r2c2r. Visuals are stripped first: SAPIEN 3 needs a Vulkan GPU for
them even to load.
"""

import json
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path


def read_back(urdf: Path) -> dict[str, object]:
    """Joints, masses and colliders as SAPIEN holds them."""
    import sapien  # type: ignore[import-not-found]  # lives in an environment of its own
    from sapien import physx

    scene = sapien.Scene([physx.PhysxCpuSystem()])
    loader = scene.create_urdf_loader()
    loader.fix_root_link = True
    with tempfile.TemporaryDirectory() as scratch:
        robot = loader.load(str(without_visuals(urdf, Path(scratch))))
    joints = {}
    for joint in robot.get_active_joints():
        lower, upper = joint.get_limits()[0]
        joints[joint.name] = (joint.type.removesuffix("_unwrapped"), float(lower), float(upper))
    links = [link for link in robot.get_links() if link.name != "world"]
    return {
        "version": f"SAPIEN {sapien.__version__}",
        "joints": joints,
        "masses": {link.name: float(link.mass) for link in links},
        "colliders": {link.name: len(link.collision_shapes) for link in links if len(link.collision_shapes)},
    }


def without_visuals(urdf: Path, scratch: Path) -> Path:
    """A copy of the URDF without <visual>, its mesh paths made absolute."""
    document = ET.parse(urdf)
    for link in document.getroot().iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    for mesh in document.getroot().iter("mesh"):
        mesh.set("filename", str(urdf.parent / mesh.get("filename", "")))
    stripped = scratch / "stripped.urdf"
    document.write(stripped)
    return stripped


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(Path(sys.argv[1]).resolve())))
