import numpy as np
import pytest

from r2c2r_core.geometry.meshes import is_watertight, volume
from r2c2r_core.geometry.raster import sample_texture
from r2c2r_core.model.inputs import Overrides
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.model.scene import SceneObject
from r2c2r_core.synthesize.stage import SynthesizeConfig, build_scene
from r2c2r_core.warp import stage
from r2c2r_core.warp.stage import WarpConfig, fit_meshes, front_corners
from tests.core.synthesize.kitchen_units import Handle, Unit, capture, placed_unit

CABINET = Unit("a", "cabinet", (0.3, 0.2, 0.5), (0.6, 0.58, 0.7), yaw=0.4, handle=Handle(0.24, 0.2))


def test_a_failed_mesh_fit_falls_back_to_the_primitive_of_that_object_only(monkeypatch: pytest.MonkeyPatch) -> None:
    face_outwards = stage.face_outwards

    def facing(vertices: np.ndarray, *further: object, **settings: object) -> object:
        if vertices[:, 0].mean() > 1.0:
            raise np.linalg.LinAlgError("SVD did not converge")
        return face_outwards(vertices, *further, **settings)  # type: ignore[arg-type]

    monkeypatch.setattr(stage, "face_outwards", facing)
    units = (CABINET, Unit("b", "cabinet", (2.3, 0.2, 0.5), (0.6, 0.58, 0.7), handle=Handle(0.24, 0.2)))
    tracks, placements, assets = zip(*[placed_unit(unit, np.random.default_rng(0)) for unit in units], strict=True)
    scene = build_scene(capture(), tracks, placements, assets, Overrides(objects={}), SynthesizeConfig())
    fitted = {item.name: item for item in fit_meshes(scene, tracks, placements, assets, WarpConfig()).objects}
    assert all(link.visual is not None for link in fitted["a"].links)
    assert all(link.visual is None for link in fitted["b"].links)
    assert any("the primitive is shown instead of the mesh: b: LinAlgError: SVD" in line for line in fitted["b"].warnings)


Stretch = tuple[float, float, float]


def dressed(unit: Unit, *, stretch: Stretch = (1, 1, 1), subdivide: int = 0, broken: bool = False) -> SceneObject:
    track, placement, asset = placed_unit(unit, np.random.default_rng(0), stretch=stretch, subdivide=subdivide)
    scene = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig())
    if broken:
        asset = without_back(asset)
    return fit_meshes(scene, [track], [placement], [asset], WarpConfig()).objects[0]


def without_back(asset):  # type: ignore[no-untyped-def]
    from dataclasses import replace

    return replace(asset, mesh=replace(asset.mesh, faces=asset.mesh.faces[:-3]))


def in_object(item: SceneObject, index: int) -> TexturedMesh:
    link = item.links[index]
    assert link.visual is not None
    visual = link.visual
    return TexturedMesh(
        vertices=link.object_from_link.apply(visual.vertices), faces=visual.faces, uv=visual.uv, texture=visual.texture
    )


def panel_extent(mesh: TexturedMesh, item: SceneObject) -> tuple[np.ndarray, np.ndarray]:
    """Range of the vertices on the front plane."""
    on_front = mesh.vertices[np.abs(mesh.vertices[:, 1] + item.dimensions_m[1] / 2) < 1e-3]
    return on_front.min(axis=0), on_front.max(axis=0)


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (1.08, 0.9, 0.94)])
@pytest.mark.parametrize("category", ["cabinet", "drawer", "double_door_cabinet", "wall_cabinet", "dishwasher", "refrigerator"])
def test_front_corners_of_mesh_and_primitive_agree_within_1_mm(category: str, stretch: Stretch) -> None:
    size = (0.6, 0.33, 0.7) if category == "wall_cabinet" else (0.6, 0.58, 0.7)
    handle = Handle(0, 0.31, length=0.3, vertical=False) if category == "dishwasher" else Handle(0.24, 0.2)
    item = dressed(Unit("a", category, (0.3, 0.2, 0.9), size, yaw=0.4, handle=handle), stretch=stretch)
    assert item.warp_residual_m is not None
    assert item.warp_residual_m <= 1e-3
    ranges = [panel_extent(in_object(item, i), item) for i in range(1, len(item.links))]
    low, high = np.min([r[0] for r in ranges], axis=0), np.max([r[1] for r in ranges], axis=0)
    corners = front_corners(item)
    np.testing.assert_allclose(low[[0, 2]], corners.min(axis=0)[[0, 2]], atol=1e-3)
    if category != "dishwasher":  # its control strip stays with the carcass
        np.testing.assert_allclose(high[[0, 2]], corners.max(axis=0)[[0, 2]], atol=1e-3)


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (1.08, 0.9, 0.94)])
def test_fitted_parts_are_watertight_outward_and_not_mirrored(stretch: Stretch) -> None:
    item = dressed(CABINET, stretch=stretch)
    for index in range(2):
        mesh = in_object(item, index)
        assert is_watertight(mesh.vertices, mesh.faces)
        assert volume(mesh.vertices, mesh.faces) > 0
    handle = in_object(item, 1).vertices
    tips = handle[handle[:, 1] < -item.dimensions_m[1] / 2 - 0.02]
    assert (tips[:, 0] > 0.2).all()  # still on the right


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (1.1, 0.9, 0.92)])
def test_a_handle_keeps_its_size_under_the_panel_map(stretch: Stretch) -> None:
    """The extents of the stretched handle are preserved by the map of the panel."""
    item = dressed(CABINET, stretch=stretch)
    mesh = in_object(item, 1)
    tips = mesh.vertices[mesh.vertices[:, 1] < -item.dimensions_m[1] / 2 - 0.01]
    out = -item.dimensions_m[1] / 2 - tips[:, 1].min()
    size = np.array([np.ptp(tips[:, 0]), out, np.ptp(tips[:, 2])])
    np.testing.assert_allclose(size, np.array([0.02, 0.035, 0.16]) * stretch, rtol=0.03)


def colour_at(mesh: TexturedMesh, point: np.ndarray) -> np.ndarray:
    """Texture colour where the ray from in front of the object through (x, z) meets the mesh."""
    from trimesh import Trimesh
    from trimesh.triangles import points_to_barycentric

    shape = Trimesh(mesh.vertices, mesh.faces, process=False)
    hits, _, triangles = shape.ray.intersects_location(np.array([[point[0], -2.0, point[1]]]), np.array([[0.0, 1.0, 0.0]]))
    first = int(np.argmin(hits[:, 1]))
    weights = points_to_barycentric(shape.triangles[triangles[first]][None], hits[first][None])[0]
    uv = weights @ mesh.uv[mesh.faces[triangles[first]]]
    return np.asarray(sample_texture(mesh.texture, uv[None, None].astype(np.float32))[0, 0])


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (1.08, 0.9, 0.94)])
def test_a_texture_mark_on_the_front_stays_in_place(stretch: Stretch) -> None:
    """The red mark lies in the upper left, at 1/8 of the width from the left and of the height from the top."""
    item = dressed(CABINET, stretch=stretch, subdivide=1)
    width, _, height = item.dimensions_m
    red = colour_at(in_object(item, 1), np.array([-width / 2 + width / 8, height / 2 - height / 8]))
    grey = colour_at(in_object(item, 1), np.array([width / 2 - width / 8, -height / 2 + height / 8]))
    assert red[0] > 180
    assert red[1] < 60
    np.testing.assert_allclose(grey, 150, atol=6)


def test_a_cabinet_is_hollow_behind_its_door_and_a_drawer_has_a_tray() -> None:
    carcass = in_object(dressed(CABINET), 0)
    assert volume(carcass.vertices, carcass.faces) < 0.25 * 0.6 * 0.58 * 0.7
    drawer = in_object(dressed(Unit("d", "drawer", (0, 0, 0.5), (0.6, 0.58, 0.2), handle=Handle(0, 0, vertical=False))), 1)
    assert np.ptp(drawer.vertices[:, 1]) > 0.4


def test_two_doors_are_separated_at_the_seam() -> None:
    item = dressed(Unit("p", "double_door_cabinet", (0, 0, 0.5), (0.8, 0.58, 0.7)))
    left, right = in_object(item, 1), in_object(item, 2)
    assert 0.001 < right.vertices[:, 0].min() - left.vertices[:, 0].max() < 0.005


def test_a_leaning_mesh_is_fitted_within_1_mm() -> None:
    from r2c2r_core.geometry.transforms import Similarity3, rotation_between

    track, placement, asset = placed_unit(CABINET, np.random.default_rng(0))
    scene = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig())
    lean = rotation_between(np.array([0, 0, 1.0]), np.array([0.02, 0.03, 1.0]))
    from dataclasses import replace

    leaning = replace(placement, world_from_mesh=Similarity3(1.0, lean, np.zeros(3)) @ placement.world_from_mesh)
    item = fit_meshes(scene, [track], [leaning], [asset], WarpConfig()).objects[0]
    assert item.warp_residual_m is not None
    assert item.warp_residual_m <= 1e-3


def test_a_mesh_with_its_handle_at_the_back_is_rotated_by_180_degrees() -> None:
    from dataclasses import replace

    from r2c2r_core.geometry.transforms import Rigid3, Similarity3, rotation_about_z

    track, placement, asset = placed_unit(CABINET, np.random.default_rng(0))
    scene = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig())
    turn = Rigid3(rotation_about_z(np.pi), np.zeros(3))
    centre = Rigid3(np.eye(3), np.array(CABINET.centre))
    moved = centre @ turn @ centre.inverse
    turned = replace(placement, world_from_mesh=Similarity3(1.0, moved.rotation, moved.translation) @ placement.world_from_mesh)
    item = fit_meshes(scene, [track], [turned], [asset], WarpConfig()).objects[0]
    assert any("turned by 180°" in w for w in item.warnings)
    mesh = in_object(item, 1)
    assert mesh.vertices[:, 1].min() < -item.dimensions_m[1] / 2 - 0.03


def test_an_open_surface_mesh_is_fitted_to_the_front() -> None:
    item = dressed(CABINET, broken=True, subdivide=1)
    assert item.links[1].visual is not None
    assert item.warp_residual_m is not None
    assert item.warp_residual_m < 2e-3


def test_a_mesh_of_another_shape_falls_back_to_the_primitive() -> None:
    item = dressed(CABINET, stretch=(1.8, 1.0, 1.0))
    assert item.links[1].visual is None
    assert item.warp_residual_m is None
    assert any("primitive is shown" in w for w in item.warnings)


def test_a_thing_gets_its_placed_mesh_as_visual() -> None:
    unit = Unit("b", "bottle", (0.3, 0.1, 0.12), (0.08, 0.1, 0.24), yaw=0.5, kind="thing")
    item = dressed(unit)
    mesh = in_object(item, 0)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), item.dimensions_m, atol=1e-6)
    hull = np.concatenate([p.vertices_link for p in item.links[0].pieces])
    np.testing.assert_allclose(np.ptp(hull, axis=0), item.dimensions_m, atol=2e-3)


def test_the_mesh_of_a_thing_follows_a_pose_set_by_a_person() -> None:
    from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
    from r2c2r_core.model.inputs import ObjectOverride

    unit = Unit("b", "carton", (0.3, 0.1, 0.12), (0.08, 0.2, 0.24), yaw=0.5, kind="thing")
    track, placement, asset = placed_unit(unit, np.random.default_rng(0))
    pose = Rigid3(rotation_about_z(1.1), np.array([1.0, 0.0, 0.12]))
    overrides = Overrides(objects={"b": ObjectOverride(pose=pose.matrix)})
    scene = build_scene(capture(), [track], [placement], [asset], overrides, SynthesizeConfig())
    item = fit_meshes(scene, [track], [placement], [asset], WarpConfig()).objects[0]
    world = item.world_from_object.apply(in_object(item, 0).vertices)
    np.testing.assert_allclose(np.ptp(pose.inverse.apply(world), axis=0), unit.size, atol=2e-3)


def test_the_paper_map_keeps_the_mesh_depth_that_the_default_map_fits() -> None:
    """Eq. 16 has w* = w: a mesh shallower than its primitive does not reach the back."""
    track, placement, asset = placed_unit(CABINET, np.random.default_rng(0), stretch=(1.0, 0.8, 1.0))
    scene = build_scene(capture(), [track], [placement], [asset], Overrides(objects={}), SynthesizeConfig())
    ours = fit_meshes(scene, [track], [placement], [asset], WarpConfig()).objects[0]
    paper = fit_meshes(scene, [track], [placement], [asset], WarpConfig(method="paper")).objects[0]
    backs = [in_object(item, 0).vertices[:, 1].max() - item.dimensions_m[1] / 2 for item in (ours, paper)]
    assert backs[0] == pytest.approx(0.0, abs=1e-6)
    assert backs[1] < -0.01
    for item in (ours, paper):  # a box's corners form a rectangle, which the affine map reproduces exactly
        assert item.warp_residual_paper_m == pytest.approx(0.0, abs=1e-9)
