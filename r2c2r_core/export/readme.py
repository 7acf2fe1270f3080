"""README.txt of a bundle: how to load it where, what each file leaves out, and what may be done with it."""

from r2c2r_core.export.manifest import tool_version
from r2c2r_core.export.plan import Plan
from r2c2r_core.export.writers.table import formats


def readme_text(plan: Plan) -> str:
    """The text, wrapped for a terminal."""
    losses = "\n".join(f"{entry.file}\n" + "\n".join(f"  - {line}" for line in entry.loses) for entry in formats())
    joints = [body.joint_name for body in plan.bodies if body.joint is not None]
    example = joints[0] if joints else "JOINT"
    return _TEMPLATE.format(name=plan.name, version=tool_version(), joints=len(joints), losses=losses, example=example)


_TEMPLATE = """\
{name}: a scanned scene that opens ({joints} joints), written by r2c2r {version}
Metres, kilograms, radians, +Z up. Every joint is closed at 0 and opens towards its upper limit.

FILES
  scene.urdf     yourdfpy, PyBullet, SAPIEN, ROS, MuJoCo        scene.xml   MuJoCo
  scene.usda     Isaac Sim, Omniverse, anything that reads USD  preview.png
  scene.glb      web viewers, Blender (+Y up, as glTF demands)  review.html the scene to open and turn, in any browser
  manifest.json  where every number comes from                  report.html the certificate, for reading
  meshes/        textured OBJ to see (_vis), convex OBJ to touch (_col_); boxes stand in scene.urdf and scene.xml

LOADING  (unpack first; run in the bundle's folder)
  MuJoCo     python -m mujoco.viewer --mjcf=scene.xml
  PyBullet   pybullet.loadURDF("scene.urdf", flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
             Without that flag PyBullet makes up its own inertias. The scene holds still without useFixedBase.
             Add pybullet.URDF_USE_SELF_COLLISION to let doors touch their neighbours. Switch each joint's
             default motor off before pushing: setJointMotorControl2(..., VELOCITY_CONTROL, force=0).
  SAPIEN     loader = scene.create_urdf_loader(); loader.fix_root_link = True; loader.load("scene.urdf")
             Without a Vulkan GPU remove the <visual> elements first. SAPIEN 3 drops the friction, effort and
             velocity of joints (its own friction is 0.05): call joint.set_friction(friction) and
             joint.set_drive_property(0, damping, effort) with the numbers of scene.urdf.
  Isaac Sim  File > Open scene.usda, or add it as a reference. Each fixture with joints is one articulation; the drives damp
             (stiffness 0): raise stiffness to hold a position. Joint friction is in PhysxJointAxisAPI (Isaac Sim 5, PhysX 5.6).
  ROS        give the text of scene.urdf to robot_state_publisher as robot_description. RViz wants absolute mesh paths:
             prefix the file names with file://<this folder>/ or package://<your package>/.
  Python     yourdfpy.URDF.load("scene.urdf").show()
  A joint    model.joint("{example}")

WHAT EACH FILE LEAVES OUT
{losses}

LICENCE
  The bundle is made from your recording and is yours; r2c2r (Apache-2.0) claims no right in it. If a mesh came from a
  learned generator (manifest.json, candidates), that model's licence may limit what you do with it.
"""
