"""scene.usda: USD with UsdPhysics, for Isaac Sim, Omniverse and other readers of USD; +Z up, metres, kilograms.

The default prim holds the objects, each a reference to its own layer, `assets/<object>/<object>.usda`; gravity, floor, light
and camera are beside it, so that a stage that references the scene keeps its own. scene.usdz is all of it in one file.
One articulation per object with joints, its root on the object's own prim (never on a body, never nested); bodies are
siblings, joints beside them. A base is fixed to the object's prim and not to the world, so that it moves with the asset.
UsdPhysics uses degrees: limits, damping and velocities of hinges are converted. Quantities that UsdPhysics lacks (dry
friction, armature, maximum velocity) are in PhysX's schema PhysxJointAxisAPI, as plain attributes, so that no NVIDIA library
is needed to write or to read them.
"""

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from r2c2r_core.export.assets import asset_file, assets_of, object_names, world_from_asset
from r2c2r_core.export.labels import labels_of, labels_of_handle
from r2c2r_core.export.plan import WORLD, Body, Plan
from r2c2r_core.export.writers.meshes import convex_hull
from r2c2r_core.export.writers.stand import AMBIENT, CAMERA, FOVY_DEG, PICTURE, SUN, SUNLIGHT, view_of
from r2c2r_core.export.writers.text import quat_wxyz_of
from r2c2r_core.geometry.transforms import Rigid3, rotation_between
from r2c2r_core.model.handle import Handle
from r2c2r_core.model.materials import ARMATURE, SURFACE_FRICTION
from r2c2r_core.model.scene import Joint

ROOT = "/Scene"
_FLOOR_M = 20.0
_NITS = 1000.0  # luminance of the ambient light: own choice, not tried in Isaac Sim
_FILM_MM = 24.0  # a full-frame sensor's height: any value gives the same picture
_FIRST_DAY = 1 << 5 | 1  # 1 January 1980 as a DOS date
_X = np.array([1.0, 0.0, 0.0])
_SOLREF_LIMIT = (0.02, 1.0)  # MuJoCo's default time constant (s) and damping ratio of joint limits, which scene.xml uses


def write_usd(plan: Plan, path: Path) -> None:
    """Write the scene's layer, a layer for each object, and scene.usdz; paths are relative to their layer."""
    from pxr import Sdf, UsdUtils

    for asset in assets_of(plan):
        file = path.parent / asset_file(asset.name, ".usda")
        file.parent.mkdir(parents=True, exist_ok=True)
        stage = _asset_stage(asset)  # a layer lives as long as its stage does
        stage.GetRootLayer().Export(str(file))
    layer, stage = Sdf.Layer.CreateAnonymous(), _scene_stage(plan)
    layer.TransferContent(stage.GetRootLayer())
    for name in object_names(plan):  # not on the stage: an in-memory one tries to resolve relative paths, and warns
        layer.GetPrimAtPath(f"{ROOT}/{name}").referenceList.prependedItems.append(
            Sdf.Reference(f"./{asset_file(name, '.usda')}")
        )
    layer.Export(str(path))
    package = path.with_suffix(".usdz")
    package.unlink(missing_ok=True)
    UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(path)), str(package))
    _undate(package)


def _undate(package: Path) -> None:
    """Set every file's time to the earliest zip date, so that equal scenes give equal bytes."""
    content = bytearray(package.read_bytes())
    with ZipFile(package) as archive:
        entry = archive.start_dir
        for info in archive.infolist():
            struct.pack_into("<HH", content, info.header_offset + 10, 0, _FIRST_DAY)
            struct.pack_into("<HH", content, entry + 12, 0, _FIRST_DAY)
            name, extra, comment = struct.unpack_from("<HHH", content, entry + 28)
            entry += 46 + name + extra + comment
    package.write_bytes(content)


def _new_stage(root: str, kind: str) -> Any:
    """A stage in memory, with the default prim of a kind."""
    from pxr import Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    prim = UsdGeom.Xform.Define(stage, root).GetPrim()
    stage.SetDefaultPrim(prim)
    Usd.ModelAPI(prim).SetKind(kind)
    return stage


def _asset_stage(plan: Plan) -> Any:
    """Stage of one object and its materials, without the rest of the scene."""
    root = f"/{plan.name}"
    stage = _new_stage(root, "component")
    _write_touch(stage, root)
    looks = _write_looks(stage, plan, root)
    _write_object(stage, root, plan.bodies, looks)
    for handle in plan.handles:
        _write_handle(stage, root, handle, plan.body(handle.link))
    return stage


def _scene_stage(plan: Plan) -> Any:
    """Stage with a placed prim for each object, support plates, and the surroundings beside them."""
    from pxr import UsdGeom

    stage = _new_stage(ROOT, "assembly")
    _write_surroundings(stage, plan, _write_touch(stage, ROOT))
    for body in plan.bodies:
        if body.is_support:
            _write_body(stage, f"{ROOT}/{body.name}", body, {}, ROOT, dynamic=False)
    for name in object_names(plan):
        _place(UsdGeom.Xform.Define(stage, f"{ROOT}/{name}"), world_from_asset(plan, name))
    return stage


def _write_surroundings(stage: Any, plan: Plan, touch: Any) -> None:
    """Write gravity, floor, light and camera outside the default prim.

    Light in the proportions of scene.xml: a white face is as bright under a dome of luminance L as facing a sun of
    illuminance pi L.
    """
    from pxr import Gf, UsdGeom, UsdLux, UsdPhysics

    scene = UsdPhysics.Scene.Define(stage, "/physics")
    scene.CreateGravityDirectionAttr(Gf.Vec3f(0, 0, -1))
    scene.CreateGravityMagnitudeAttr(9.81)
    floor = UsdGeom.Plane.Define(stage, "/floor")
    floor.CreateAxisAttr(UsdGeom.Tokens.z)
    floor.CreateWidthAttr(_FLOOR_M)
    floor.CreateLengthAttr(_FLOOR_M)
    floor.CreateDisplayColorAttr([Gf.Vec3f(0.75, 0.74, 0.72)])
    floor.AddTranslateOp().Set(Gf.Vec3d(0, 0, plan.floor_z_m))
    UsdPhysics.CollisionAPI.Apply(floor.GetPrim())
    _bind(floor.GetPrim(), touch, purpose="physics")
    view = view_of(plan)
    UsdLux.DomeLight.Define(stage, "/ambient").CreateIntensityAttr(_NITS)
    sun = UsdLux.DistantLight.Define(stage, f"/{SUN}")
    sun.CreateIntensityAttr(np.pi * _NITS * SUNLIGHT / AMBIENT)
    sun.CreateNormalizeAttr(True)  # intensity is an illuminance
    _place(sun, Rigid3(rotation_between(np.array([0.0, 0.0, 1.0]), view.sun), view.centre + view.radius_m * view.sun))
    camera = UsdGeom.Camera.Define(stage, f"/{CAMERA}")
    camera.CreateHorizontalApertureAttr(_FILM_MM * PICTURE[0] / PICTURE[1])
    camera.CreateVerticalApertureAttr(_FILM_MM)
    camera.CreateFocalLengthAttr(_FILM_MM / 2 / np.tan(np.radians(FOVY_DEG) / 2))
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.01, 100.0))
    _place(camera, view.world_from_camera)


def _write_touch(stage: Any, root: str) -> Any:
    """Write the physics material of contacts."""
    from pxr import UsdPhysics, UsdShade

    touch = UsdShade.Material.Define(stage, f"{root}/touch")
    surface = UsdPhysics.MaterialAPI.Apply(touch.GetPrim())
    surface.CreateStaticFrictionAttr(SURFACE_FRICTION)
    surface.CreateDynamicFrictionAttr(SURFACE_FRICTION)
    surface.CreateRestitutionAttr(0.0)
    return touch


def _write_looks(stage: Any, plan: Plan, root: str) -> dict[str, Any]:
    """Write a preview material per texture; bodies of one object share it."""
    from pxr import Sdf, UsdGeom, UsdShade

    UsdGeom.Scope.Define(stage, f"{root}/looks")
    looks: dict[str, Any] = {}
    for body in plan.bodies:
        if body.visual_file is None or body.texture_file is None or body.texture_file in looks:
            continue
        material = UsdShade.Material.Define(stage, f"{root}/looks/{body.name}_look")
        base = str(material.GetPath())
        uv = UsdShade.Shader.Define(stage, f"{base}/uv")
        uv.CreateIdAttr("UsdPrimvarReader_float2")
        uv.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        picture = UsdShade.Shader.Define(stage, f"{base}/picture")
        picture.CreateIdAttr("UsdUVTexture")
        picture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(f"./{body.texture_file}")
        picture.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB")
        picture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(
            uv.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        )
        shader = UsdShade.Shader.Define(stage, f"{base}/surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.9)
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(
            picture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
        )
        material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
        looks[body.texture_file] = material
    return looks


def _write_object(stage: Any, path: str, bodies: Sequence[Body], looks: dict[str, Any]) -> None:
    """Write an object's bodies and joints; without joints it is a free body or a static part of the scene."""
    from pxr import UsdGeom, UsdPhysics

    prim = stage.GetPrimAtPath(path)
    said = [labels_of(body) for body in bodies]
    every = dict.fromkeys(word for labels in said for word in labels.disposition)
    _label(prim, category=[said[0].category], disposition=[*every])
    articulated = any(body.joint is not None for body in bodies)
    if articulated:
        UsdPhysics.ArticulationRootAPI.Apply(prim)
        UsdGeom.Scope.Define(stage, f"{path}/joints")
    for body in bodies:
        _write_body(stage, f"{path}/{body.name}", body, looks, path, dynamic=articulated or body.free)
        if articulated and not body.free:
            _write_joint(stage, path, body)


def _write_body(stage: Any, path: str, body: Body, looks: dict[str, Any], root: str, *, dynamic: bool) -> None:
    from pxr import Gf, Sdf, UsdGeom, UsdPhysics

    xform = UsdGeom.Xform.Define(stage, path)
    _place(xform, body.world_from_body)
    labels = labels_of(body)
    _label(xform.GetPrim(), part=[labels.part], disposition=labels.disposition)
    if dynamic:
        UsdPhysics.RigidBodyAPI.Apply(xform.GetPrim())
    if body.joint is not None and body.joint.has_stay:
        xform.GetPrim().AddAppliedSchema("PhysxRigidBodyAPI")
        xform.GetPrim().CreateAttribute("physxRigidBody:disableGravity", Sdf.ValueTypeNames.Bool, custom=False).Set(True)
    inertial = body.link.inertial
    moments, axes = _principal(inertial.inertia)
    mass = UsdPhysics.MassAPI.Apply(xform.GetPrim())
    mass.CreateMassAttr(float(inertial.mass_kg))
    mass.CreateCenterOfMassAttr(Gf.Vec3f(*map(float, inertial.com_link)))
    mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*map(float, moments)))
    mass.CreatePrincipalAxesAttr(_quatf(axes))
    _write_visuals(stage, path, body, looks)
    _write_colliders(stage, path, body, root)


def _write_visuals(stage: Any, path: str, body: Body, looks: dict[str, Any]) -> None:
    from pxr import Gf, Sdf, UsdGeom, Vt

    visual = body.link.visual
    if visual is None:
        for number, box in enumerate(body.link.boxes):
            cube = _cube(stage, f"{path}/visual_{number}", box.link_from_box, box.size_m)
            cube.CreateDisplayColorAttr([Gf.Vec3f(*map(float, body.link.colour))])
            if box.role == "handle":
                _label(cube.GetPrim(), part=["handle"])
        return
    mesh = _mesh(stage, f"{path}/visual", visual.vertices, visual.faces)
    mesh.CreateDoubleSidedAttr(True)
    uv = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex)
    uv.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(visual.uv, dtype=np.float32)))
    if body.texture_file is not None:
        _bind(mesh.GetPrim(), looks[body.texture_file])


def _write_colliders(stage: Any, path: str, body: Body, root: str) -> None:
    """Write convex pieces and panels as guides: engines collide with them, renderers skip them."""
    from pxr import UsdGeom, UsdPhysics, UsdShade

    shapes = [
        _mesh(stage, f"{path}/collision_{k}", *convex_hull(p.vertices_link, f"{body.name}: {p.name}"))
        for k, p in enumerate(body.link.pieces)
    ]
    for shape in shapes:
        UsdPhysics.MeshCollisionAPI.Apply(shape.GetPrim()).CreateApproximationAttr(UsdPhysics.Tokens.convexHull)
    for number, box in enumerate(body.link.boxes, start=len(shapes)):
        shapes.append(_cube(stage, f"{path}/collision_{number}", box.link_from_box, box.size_m))
    touch = UsdShade.Material.Get(stage, f"{root}/touch")
    for shape in shapes:
        shape.CreatePurposeAttr(UsdGeom.Tokens.guide)
        UsdPhysics.CollisionAPI.Apply(shape.GetPrim())
        _bind(shape.GetPrim(), touch, purpose="physics")


def _write_handle(stage: Any, root: str, handle: Handle, body: Body) -> None:
    """Write a frame at the handle, z into the front, x along the grip; data without a schema go into r2c2r attributes."""
    from pxr import Gf, Sdf, UsdGeom

    xform = UsdGeom.Xform.Define(stage, f"{root}/{body.name}/{handle.name}")
    labels = labels_of_handle(handle, body)
    _label(xform.GetPrim(), part=[labels.part], disposition=labels.disposition)
    _place(xform, body.world_from_body.inverse @ handle.world_from_handle)
    prim = xform.GetPrim()
    prim.CreateAttribute("r2c2r:handle:kind", Sdf.ValueTypeNames.Token).Set(handle.kind)
    prim.CreateAttribute("r2c2r:handle:joint", Sdf.ValueTypeNames.Token).Set(handle.joint)
    prim.CreateAttribute("r2c2r:handle:size", Sdf.ValueTypeNames.Float3).Set(Gf.Vec3f(*map(float, handle.size_m)))


def _write_joint(stage: Any, object_path: str, body: Body) -> None:
    """Write the joint between a body and its parent; a base is fixed to the object's prim, which is not a body."""
    from pxr import Gf, UsdPhysics

    joint = body.joint
    define = {"revolute": UsdPhysics.RevoluteJoint, "prismatic": UsdPhysics.PrismaticJoint}
    kind = UsdPhysics.FixedJoint if joint is None else define[joint.type]
    prim = kind.Define(stage, f"{object_path}/joints/{body.joint_name}")
    prim.CreateBody0Rel().SetTargets([object_path if body.parent == WORLD else f"{object_path}/{body.parent}"])
    prim.CreateBody1Rel().SetTargets([f"{object_path}/{body.name}"])
    body_from_joint = np.eye(3) if body.axis_body is None else rotation_between(_X, body.axis_body)
    prim.CreateLocalPos0Attr(Gf.Vec3f(*map(float, body.parent_from_body.translation)))
    prim.CreateLocalRot0Attr(_quatf(body.parent_from_body.rotation @ body_from_joint))
    prim.CreateLocalPos1Attr(Gf.Vec3f(0, 0, 0))
    prim.CreateLocalRot1Attr(_quatf(body_from_joint))
    if joint is None:
        return
    angular = joint.type == "revolute"
    per_unit = 180.0 / np.pi if angular else 1.0  # degrees in a radian
    prim.CreateAxisAttr("X")
    prim.CreateLowerLimitAttr(joint.lower * per_unit)
    prim.CreateUpperLimitAttr(joint.upper * per_unit)
    instance = "angular" if angular else "linear"
    drive = UsdPhysics.DriveAPI.Apply(prim.GetPrim(), instance)
    drive.CreateTypeAttr("force")
    drive.CreateTargetVelocityAttr(0.0)
    drive.CreateStiffnessAttr(0.0)
    drive.CreateDampingAttr(joint.damping / per_unit)
    drive.CreateMaxForceAttr(joint.effort)
    _say(
        prim.GetPrim(),
        f"PhysxJointAxisAPI:{instance}",
        f"physxJointAxis:{instance}",
        staticFrictionEffort=joint.friction,
        dynamicFrictionEffort=joint.friction,
        armature=ARMATURE[joint.type],
        maxJointVelocity=joint.velocity * per_unit,
    )
    # read here by NVIDIA's exporter to URDF, which else writes 0, and by Isaac Lab
    _say(prim.GetPrim(), "PhysxJointAPI", "physxJoint", maxJointVelocity=joint.velocity * per_unit)
    _say_newton(prim.GetPrim(), joint)
    # the joint state, closed and at rest; Isaac Sim reads and writes it here
    _say(prim.GetPrim(), f"PhysicsJointStateAPI:{instance}", f"state:{instance}:physics", position=0.0, velocity=0.0)


def _label(prim: Any, **tokens: Sequence[str]) -> None:
    """Write UsdSemantics labels by taxonomy, skipping empty ones."""
    from pxr import UsdSemantics

    for taxonomy, words in tokens.items():
        if words:
            UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr().Set([*words])


def _say(prim: Any, schema: str, prefix: str, **values: float) -> None:
    """Apply a schema that USD itself lacks, and write its values as plain attributes."""
    from pxr import Sdf

    prim.AddAppliedSchema(schema)
    for name, value in values.items():
        prim.CreateAttribute(f"{prefix}:{name}", Sdf.ValueTypeNames.Float, custom=False).Set(float(value))


def _say_newton(prim: Any, joint: Joint) -> None:
    """Write dry friction, armature and the stiffness of limits for Newton, the first two in its own schema and in MuJoCo's.

    Newton does not read PhysX's schema, nor its own with MuJoCo's solver. Damping is the drive's, which both read. Newton's
    default limits are soft: 30 N push a drawer 50 mm beyond its end (Newton 1.8.0).
    """
    from pxr import Sdf, Vt

    armature, kinds = ARMATURE[joint.type], Sdf.ValueTypeNames
    _say(prim, "NewtonJointAPI", "newton", friction=joint.friction, armature=armature)
    for name, kind, value in (
        ("frictionloss", kinds.Double, float(joint.friction)),
        ("armature", kinds.Double, float(armature)),
        ("solreflimit", kinds.DoubleArray, Vt.DoubleArray(_SOLREF_LIMIT)),
    ):
        prim.CreateAttribute(f"mjc:{name}", kind, custom=False, variability=Sdf.VariabilityUniform).Set(value)


def _cube(stage: Any, path: str, link_from_box: Rigid3, size_m: np.ndarray) -> Any:
    from pxr import Gf, UsdGeom

    cube = UsdGeom.Cube.Define(stage, path)
    cube.CreateSizeAttr(1.0)
    cube.CreateExtentAttr([Gf.Vec3f(-0.5, -0.5, -0.5), Gf.Vec3f(0.5, 0.5, 0.5)])
    _place(cube, link_from_box)
    cube.AddScaleOp().Set(Gf.Vec3f(*map(float, size_m)))
    return cube


def _mesh(stage: Any, path: str, vertices: np.ndarray, faces: np.ndarray) -> Any:
    from pxr import UsdGeom, Vt

    points = np.ascontiguousarray(vertices, dtype=np.float32)
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(faces), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(faces, dtype=np.int32).ravel()))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    a, b, c = (points[np.asarray(faces)[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.round(normals / np.maximum(lengths, 1e-12), 4).astype(np.float32)))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.uniform)  # flat shading keeps sharp corners
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0), points.max(axis=0)])))
    return mesh


def _bind(prim: Any, material: Any, purpose: str = "") -> None:
    from pxr import UsdShade

    api = UsdShade.MaterialBindingAPI.Apply(prim)
    api.Bind(material, UsdShade.Tokens.weakerThanDescendants, purpose or UsdShade.Tokens.allPurpose)


def _place(xform: Any, pose: Rigid3) -> None:
    from pxr import Gf, UsdGeom

    w, x, y, z = map(float, quat_wxyz_of(pose.rotation))
    xform.AddTranslateOp().Set(Gf.Vec3d(*map(float, pose.translation)))
    xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(w, x, y, z))


def _quatf(rotation: np.ndarray) -> Any:
    from pxr import Gf

    return Gf.Quatf(*map(float, quat_wxyz_of(rotation)))


def _principal(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (kg m^2) and the rotation from principal axes to the body's, right-handed."""
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    return moments, axes
