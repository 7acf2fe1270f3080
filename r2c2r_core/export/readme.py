"""README.txt of a bundle: how to load it in each simulator, what each file omits, and terms of use."""

from textwrap import indent, wrap

from r2c2r_core.export.manifest import tool_version
from r2c2r_core.export.plan import Plan
from r2c2r_core.export.simulators import Recipe, recipes
from r2c2r_core.export.writers.table import formats


def readme_text(plan: Plan) -> str:
    """The text, wrapped for a terminal."""
    losses = "\n".join(f"{entry.file}\n" + "\n".join(f"  - {line}" for line in entry.loses) for entry in formats())
    joints = [body.joint_name for body in plan.bodies if body.joint is not None]
    example = joints[0] if joints else "JOINT"
    base = plan.bodies[0]
    return _TEMPLATE.format(
        name=plan.name,
        version=tool_version(),
        joints=len(joints),
        losses=losses,
        example=example,
        object=base.object_name,
        simulators="\n".join(_recipe_lines(recipe) for recipe in recipes(plan.name, base.object_name)),
        body=base.name.removeprefix(f"{base.object_name}_"),
    )


def _recipe_lines(recipe: Recipe) -> str:
    note = "\n".join(wrap(recipe.note, _WIDTH - 4))
    return "\n".join(
        [f"  {recipe.simulator} ({recipe.install})", *(indent(text, "    ") for text in (recipe.code, note) if text)]
    )


_WIDTH = 120
_TEMPLATE = """\
{name}: a scanned scene that opens ({joints} joints), written by r2c2r {version}
Metres, kilograms, radians, +Z up. Every joint is closed at 0 and opens towards its upper limit.

FILES
  scene.urdf     yourdfpy, PyBullet, SAPIEN, ROS, MuJoCo        scene.xml   MuJoCo
  scene.usda     Isaac Sim, Omniverse, anything that reads USD  scene.usdz  the same in one file
  scene.sdf      Gazebo, Drake                                  scene.srdf  MoveIt, SAPIEN: pairs that never collide
  package.xml    the folder as a ROS 2 package; ros/ has RViz's view and the URDF with package:// paths and handle frames
  scene.glb      web viewers, Blender (+Y up, as glTF demands)  review.html the scene to open and turn, in any browser
  manifest.json  where every number comes from                  report.html the certificate, for reading
  gripper/ arm/  a sheet of pictures of a gripper, and of an arm with the places where it stands, at every joint they tried
  assets/        each object alone (.urdf .xml .usda .glb): origin under the middle of its foot, front at -Y, closed, no floor,
                 no gravity, each folder complete in itself; the scene's files use the same meshes:
    OBJECT/meshes/  textured OBJ to see (_vis), convex OBJ to touch (_col_); boxes stand in scene.urdf and scene.xml
  preview.png    the scene

LOADING  (unpack first; run in the bundle's folder)
{simulators}
  An object  MuJoCo  <model name="a" file="assets/{object}/{object}.xml"/> among the assets, then
                     <frame pos="1 0 0"><attach model="a" body="{body}" prefix="{object}_"/></frame> in the world;
                     names in the file lack {object}_, which the prefix adds: all formats then agree
             USD     prim.GetReferences().AddReference("assets/{object}/{object}.usda")
  Handles    each is a site (scene.xml), a prim (scene.usda), a node (scene.glb) and an <r2c2r><handle> (scene.urdf), in the
             frame of a gripper that holds it: x along the grip, y the way fingers close, z into the front. manifest.json has
             its size, protrusion, free room and opening direction. A front without a handle has a point to push.
  Labels     category, part and disposition (openable, graspable, pushable) of every part: UsdSemantics.LabelsAPI in USD, a
             <custom><text> named as the body or site in MJCF, node extras in GLB, <r2c2r><labels> in URDF
  Contents   a thing in a drawer is a free body in scene.xml, scene.sdf and scene.usda, and a child of the drawer in scene.urdf
             and scene.glb, which have no free bodies; manifest.json names the drawer (carried_by), <custom><text> in MJCF too
  Python     yourdfpy.URDF.load("scene.urdf").show()
  A joint    model.joint("{example}")

WHAT EACH FILE LEAVES OUT
{losses}

LICENCE
  The bundle is made from your recording and is yours; r2c2r (Apache-2.0) claims no right in it. If a mesh came from a
  learned generator (manifest.json, candidates), that model's licence may limit what you do with it.
"""
