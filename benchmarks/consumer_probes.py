"""Probes of third-party programs that read a bundle: run by consumers.py in an environment that has that one program.

    python consumer_probes.py PROBE BUNDLE [DATASET]

Each probe imports only its own library, reads one file as that library's documentation shows, and returns counts. Nothing of
r2c2r is imported.
"""

import json
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

Counts = dict[str, int]


def urdf_parser_py(bundle: Path, _: Path) -> Counts:
    from urdf_parser_py.urdf import URDF

    robot = URDF.from_xml_file(str(bundle / "scene.urdf"))
    return {"joints": sum(joint.type != "fixed" for joint in robot.joints), "links": len(robot.links)}


def urchin(bundle: Path, _: Path) -> Counts:
    from urchin import URDF

    robot = URDF.load(str(bundle / "scene.urdf"))
    robot.collision_trimesh_fk()
    return {"joints": len(robot.actuated_joints), "links": len(robot.links)}


def pinocchio(bundle: Path, _: Path) -> Counts:
    import pinocchio

    urdf = str(bundle / "scene.urdf")
    model, colliders, visuals = pinocchio.buildModelsFromUrdf(urdf, [str(bundle)])
    pinocchio.forwardKinematics(model, model.createData(), pinocchio.neutral(model))
    return {"joints": model.nq, "colliders": colliders.ngeoms, "visuals": visuals.ngeoms}


def kinpy(bundle: Path, _: Path) -> Counts:
    import kinpy

    chain = kinpy.build_chain_from_urdf((bundle / "scene.urdf").read_bytes())
    return {"joints": len(chain.get_joint_parameter_names())}


def scikit_robot(bundle: Path, _: Path) -> Counts:
    from skrobot.models.urdf import RobotModelFromURDF

    robot = RobotModelFromURDF(urdf_file=str(bundle / "scene.urdf"))
    return {"joints": len(robot.joint_list), "links": len(robot.link_list)}


def compas_robots(bundle: Path, _: Path) -> Counts:
    from compas_robots import RobotModel
    from compas_robots.resources import DefaultMeshLoader

    robot = RobotModel.from_urdf_file(str(bundle / "scene.urdf"))
    robot.load_geometry(DefaultMeshLoader(basepath=str(bundle)))
    return {"joints": len(robot.get_configurable_joints()), "links": len(robot.links)}


def placo(bundle: Path, _: Path) -> Counts:
    import placo

    robot = placo.RobotWrapper(str(bundle / "scene.urdf"), placo.Flags.ignore_collisions)
    return {"joints": len(list(robot.joint_names()))}


def xacro(bundle: Path, _: Path) -> Counts:
    import xacro

    document = xacro.process_file(str(bundle / "scene.urdf"))
    return {"joints": sum(node.getAttribute("type") != "fixed" for node in document.getElementsByTagName("joint"))}


def dm_control(bundle: Path, _: Path) -> Counts:
    from dm_control import mjcf

    model = mjcf.from_path(str(bundle / "scene.xml"))
    physics = mjcf.Physics.from_mjcf_model(model)
    physics.step()
    return {"joints": sum(joint.tag == "joint" for joint in model.find_all("joint"))}


def mujoco_urdf(bundle: Path, _: Path) -> Counts:
    import mujoco

    return {"joints": mujoco.MjModel.from_xml_path(str(bundle / "scene.urdf")).njnt}


def rod(bundle: Path, _: Path) -> Counts:
    from rod import Sdf

    models = [model for world in Sdf.load(bundle / "scene.sdf").worlds() for model in world.models()]
    return {"joints": sum(joint.type != "fixed" for model in models for joint in model.joints())}


def pygltflib(bundle: Path, _: Path) -> Counts:
    from pygltflib import GLTF2

    scene = GLTF2().load(str(bundle / "scene.glb"))
    return {"joints": len({channel.target.node for clip in scene.animations for channel in clip.channels})}


def trimesh_glb(bundle: Path, _: Path) -> Counts:
    import trimesh

    return {"geometries": len(trimesh.load_scene(bundle / "scene.glb").geometry)}


def catkin_pkg(bundle: Path, _: Path) -> Counts:
    from catkin_pkg.package import parse_package

    package = parse_package(str(bundle))
    package.validate()
    return {"packages": 1}


def pycocotools(_: Path, dataset: Path) -> Counts:
    from pycocotools.coco import COCO

    labels = COCO(str(dataset / "annotations.json"))
    marked = sum(bool(labels.annToMask(annotation).any()) for annotation in labels.loadAnns(labels.getAnnIds()))
    return {"masks": marked}


def supervision(_: Path, dataset: Path) -> Counts:
    from supervision import DetectionDataset

    labels = DetectionDataset.from_coco(str(dataset), str(dataset / "annotations.json"), force_masks=True)
    return {"masks": sum(len(found) for _, _, found in labels)}


def datumaro(_: Path, dataset: Path) -> Counts:
    from datumaro.components.annotation import AnnotationType
    from datumaro.components.dataset import Dataset

    with tempfile.TemporaryDirectory() as scratch:  # the library reads COCO in COCO's own folder layout only
        (folder := Path(scratch) / "annotations").mkdir()
        shutil.copy(dataset / "annotations.json", folder / "instances_default.json")
        (Path(scratch) / "images").symlink_to(dataset / "images")
        labels = Dataset.import_from(scratch, "coco_instances")
        kinds = (AnnotationType.mask, AnnotationType.polygon)
        return {"masks": sum(annotation.type in kinds for item in labels for annotation in item.annotations)}


def torchvision(_: Path, dataset: Path) -> Counts:
    from torchvision.datasets import CocoDetection

    labels = CocoDetection(str(dataset), str(dataset / "annotations.json"))
    return {"masks": sum(len(labels[k][1]) for k in range(len(labels)))}


PROBES: dict[str, Callable[[Path, Path], Counts]] = {
    probe.__name__: probe
    for probe in (
        urdf_parser_py,
        urchin,
        pinocchio,
        kinpy,
        scikit_robot,
        compas_robots,
        placo,
        xacro,
        dm_control,
        mujoco_urdf,
        rod,
        pygltflib,
        trimesh_glb,
        catkin_pkg,
        pycocotools,
        supervision,
        datumaro,
        torchvision,
    )
}


def main(arguments: list[str]) -> int:
    """Run one probe and print its counts as JSON on the last line."""
    name, bundle, dataset = arguments
    counts: dict[str, Any] = PROBES[name](Path(bundle), Path(dataset))
    print(json.dumps(counts))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
