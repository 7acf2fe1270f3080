"""Loading recipes for each simulator: code to run in the bundle's folder."""

from dataclasses import dataclass, replace
from typing import Literal

from r2c2r_core.export.writers.ros import package_name


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """One simulator's loading recipe."""

    simulator: str
    install: str  # a shell command, or its source
    language: Literal["python", "shell"]
    code: str
    note: str = ""
    loader: str | None = None  # loader of the certificate that reads the same file


def recipes(scene: str, object_name: str) -> tuple[Recipe, ...]:
    """Recipes of all simulators, for a scene of this name with this object."""
    names = {"PACKAGE": package_name(scene), "OBJECT": object_name}

    def filled(text: str) -> str:
        for mark, name in names.items():
            text = text.replace(mark, name)
        return text

    return tuple(replace(recipe, code=filled(recipe.code), note=filled(recipe.note)) for recipe in _RECIPES)


_RECIPES = (
    Recipe(
        simulator="MuJoCo",
        install="pip install mujoco",
        language="python",
        code="""\
import mujoco
model = mujoco.MjModel.from_xml_path("scene.xml")
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key("open").id)  # or closed, ajar, JOINT_open
mujoco.mj_step(model, data)""",
        note="In open, joints that would overlap another open one stay closed; JOINT_open opens one joint alone, by its name. "
        "To look at it: python -m mujoco.viewer --mjcf=scene.xml",
        loader="MuJoCo (MJCF)",
    ),
    Recipe(
        simulator="MJX",
        install="pip install mujoco-mjx",
        language="python",
        code="""\
import jax, mujoco
from mujoco import mjx
model = mjx.put_model(mujoco.MjModel.from_xml_path("scene.xml"))
data = jax.jit(mjx.step)(model, mjx.make_data(model))""",
        loader="MJX",
    ),
    Recipe(
        simulator="MuJoCo Warp",
        install="pip install mujoco-warp",
        language="python",
        code="""\
import mujoco, mujoco_warp
model = mujoco.MjModel.from_xml_path("scene.xml")
on_device = mujoco_warp.put_model(model)
data = mujoco_warp.make_data(model, nworld=256, njmax=1024, nconmax=512)
mujoco_warp.step(on_device, data)""",
        note="Room for constraints and contacts is given by hand: sized by the first state, what comes later is dropped.",
        loader="MuJoCo Warp",
    ),
    Recipe(
        simulator="Newton",
        install="pip install 'newton[sim,importers]'",
        language="python",
        code="""\
import newton
from newton.usd import SchemaResolverNewton, SchemaResolverPhysx
builder = newton.ModelBuilder()
newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
builder.add_usd("scene.usda", schema_resolvers=[SchemaResolverNewton(), SchemaResolverPhysx()])
model = builder.finalize()
solver = newton.solvers.SolverMuJoCo(model)""",
        loader="Newton",
    ),
    Recipe(
        simulator="Genesis",
        install="pip install genesis-world torch",
        language="python",
        code="""\
import genesis as gs
gs.init(backend=gs.cpu)  # or gs.gpu
scene = gs.Scene(show_viewer=False)
kitchen = scene.add_entity(gs.morphs.MJCF(file="scene.xml", decimate=False))
scene.build()
scene.step()""",
        note="The first run compiles for minutes. decimate=False keeps the colliders as they are: simple and convex.",
        loader="Genesis",
    ),
    Recipe(
        simulator="Isaac Sim",
        install="Isaac Sim 5, its own Python",
        language="python",
        code="""\
from isaacsim.core.utils.stage import open_stage
open_stage("scene.usda")""",
        note='Or File > Open. add_reference_to_stage("scene.usda", "/World/Kitchen") adds the objects to a stage with its own '
        "floor, light and physics scene. Each fixture with joints is one articulation; the drives damp (stiffness 0): raise it "
        "to hold a position. Joint friction is in PhysxJointAxisAPI (PhysX 5.6).",
        loader="NVIDIA asset validator",
    ),
    Recipe(
        simulator="Isaac Lab",
        install="Isaac Lab, its own Python",
        language="python",
        code="""\
import isaaclab.sim as sim_utils
from isaaclab.actuators import ImplicitActuatorCfg
from isaaclab.assets import ArticulationCfg, AssetBaseCfg
from pxr import Usd, UsdPhysics
kitchen = AssetBaseCfg(prim_path="{ENV_REGEX_NS}/Kitchen", spawn=sim_utils.UsdFileCfg(usd_path="scene.usda"))
held = ImplicitActuatorCfg(joint_names_expr=[".*"], stiffness=None, damping=None)
units, stage = {}, Usd.Stage.Open("scene.usda")
for prim in stage.GetDefaultPrim().GetChildren():
    if prim.HasAPI(UsdPhysics.ArticulationRootAPI):  # spawned with the kitchen
        position, turn = (prim.GetAttribute(f"xformOp:{name}").Get() for name in ("translate", "orient"))
        start = ArticulationCfg.InitialStateCfg(pos=tuple(position), rot=(turn.GetReal(), *turn.GetImaginary()))
        path = "{ENV_REGEX_NS}/Kitchen/" + prim.GetName()
        units[prim.GetName()] = ArticulationCfg(prim_path=path, init_state=start, actuators={"joints": held})""",
        note="In the scene's configuration, list the kitchen before its units, and a floor and light of your own. One object "
        "alone: assets/OBJECT/OBJECT.usda as ArticulationCfg. rot is w, x, y, z (Isaac Lab 2).",
        loader="NVIDIA asset validator",
    ),
    Recipe(
        simulator="PyBullet",
        install="pip install pybullet",
        language="python",
        code="""\
import pybullet
pybullet.connect(pybullet.DIRECT)
kitchen = pybullet.loadURDF("scene.urdf", flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
for joint in range(pybullet.getNumJoints(kitchen)):  # its default motors brake
    pybullet.setJointMotorControl2(kitchen, joint, pybullet.VELOCITY_CONTROL, force=0)
pybullet.stepSimulation()""",
        note="Without that flag it makes up its own inertias. It holds still without useFixedBase. Add "
        "pybullet.URDF_USE_SELF_COLLISION to let doors touch their neighbours.",
        loader="PyBullet",
    ),
    Recipe(
        simulator="SAPIEN, ManiSkill",
        install="pip install sapien",
        language="python",
        code="""\
import sapien
scene = sapien.Scene()
loader = scene.create_urdf_loader()
loader.fix_root_link = True
kitchen = loader.load("scene.urdf")""",
        note="Without a Vulkan device: sapien.Scene([sapien.physx.PhysxCpuSystem()]), and remove the <visual> elements first. "
        "SAPIEN 3 drops the friction, effort and velocity of joints (its own friction is 0.05): call "
        "joint.set_friction(friction) and joint.set_drive_property(0, damping, effort) with the numbers of scene.urdf. "
        "A ManiSkill task loads it in _load_scene with self.scene.create_urdf_loader().",
        loader="SAPIEN",
    ),
    Recipe(
        simulator="Drake",
        install="pip install drake",
        language="python",
        code="""\
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.002)
parser = Parser(plant)
parser.AddModels("scene.sdf")
plant.Finalize()""",
        loader="Drake",
    ),
    Recipe(
        simulator="ROS 2",
        install="ROS 2 with robot_state_publisher and rviz2",
        language="shell",
        code="""\
mkdir -p ~/kitchen_ws/src && cp -r . ~/kitchen_ws/src/PACKAGE
cd ~/kitchen_ws && colcon build && . install/setup.sh
ros2 launch PACKAGE view.launch.py""",
        note="The folder is a package. MoveIt takes scene.srdf: pairs that never collide.",
    ),
    Recipe(
        simulator="Gazebo",
        install="Gazebo (gz-sim)",
        language="shell",
        code="gz sim scene.sdf",
    ),
)
