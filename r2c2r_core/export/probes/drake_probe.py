"""Load scene.sdf in Drake and write out its values: `python drake_probe.py scene.sdf answer.json`.

Runs in Drake's own environment, so it imports nothing from r2c2r but its neighbouring script. Every joint is released along
its travel. Drake has joint damping, but no dry friction.
"""

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from releasing import STEP_S, STEPS, release_everywhere  # type: ignore[import-not-found]  # the file beside this one


def read_back(scene: Path) -> dict[str, Any]:
    """Joints and bodies as stored by Drake, joints closed."""
    from pydrake.multibody.parsing import Parser  # type: ignore[import-not-found]  # lives in an environment of its own
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph  # type: ignore[import-not-found]
    from pydrake.systems.analysis import Simulator  # type: ignore[import-not-found]
    from pydrake.systems.framework import DiagramBuilder  # type: ignore[import-not-found]

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, STEP_S)
    parser = Parser(plant)  # the models are deleted with their parser
    parser.AddModels(str(scene))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    own = plant.GetMyContextFromRoot(context)
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    moving = [joint for joint in joints if joint.type_name() in _KINDS]
    links = [plant.get_body(index) for model in _models(plant) for index in plant.GetBodyIndices(model)]
    answer = {
        "version": f"Drake {version('drake')}",
        "joints": {joint.name(): _joint(joint, own) for joint in moving},
        "bodies": {body.name(): _body(plant, body, own) for body in links if body.name() != "floor_link"},
    }
    number = {joint.name(): joint.position_start() for joint in moving}

    def released(name: str, position: float) -> float:
        fresh = diagram.CreateDefaultContext()
        state = plant.GetMyMutableContextFromRoot(fresh)
        q = plant.GetPositions(state)
        q[number[name]] = position
        plant.SetPositions(state, q)
        Simulator(diagram, fresh).AdvanceTo(STEPS * STEP_S)
        q = plant.GetPositions(state)
        return float(q[number[name]]) if np.isfinite(q).all() else np.nan

    return answer | {"problem": release_everywhere({joint.name(): _limits(joint) for joint in moving}, released)}


_KINDS = {"revolute", "prismatic"}


def _models(plant: Any) -> list[Any]:
    from pydrake.multibody.tree import ModelInstanceIndex  # type: ignore[import-not-found]

    return [ModelInstanceIndex(number) for number in range(2, plant.num_model_instances())]  # 0 and 1: world and default


def _limits(joint: Any) -> tuple[float, float]:
    return float(joint.position_lower_limits()[0]), float(joint.position_upper_limits()[0])


def _joint(joint: Any, context: Any) -> dict[str, Any]:
    kind = joint.type_name()
    frame = joint.frame_on_child().CalcPoseInWorld(context)
    axis = joint.revolute_axis() if kind == "revolute" else joint.translation_axis()
    return {
        "type": kind,
        "axis_world": (frame.rotation().matrix() @ axis).tolist(),
        "origin_world": frame.translation().tolist(),
        "lower": _limits(joint)[0],
        "upper": _limits(joint)[1],
        "damping": float(joint.GetDampingVector(context)[0]),
        "velocity": float(joint.velocity_upper_limits()[0]),
    }


def _body(plant: Any, body: Any, context: Any) -> dict[str, Any]:
    pose = body.EvalPoseInWorld(context)
    inertia = body.CalcSpatialInertiaInBodyFrame(context)
    com = inertia.get_com()
    turn = pose.rotation().matrix()
    central = inertia.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
    return {
        "mass_kg": float(inertia.get_mass()),
        "com_world": (pose.translation() + turn @ com).tolist(),
        "inertia_world": (turn @ central @ turn.T).tolist(),
        "rotation_world": turn.tolist(),
        "origin_world": pose.translation().tolist(),
        "colliders": len(plant.GetCollisionGeometriesForBody(body)),
    }


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(json.dumps(read_back(Path(sys.argv[1]))))
