"""Synthesis of an articulated scene of primitives from placements (paper sections 4.4-4.5)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeVar, get_args

import numpy as np

from r2c2r_core.arrays import Vector3
from r2c2r_core.errors import StageError
from r2c2r_core.failing import apart
from r2c2r_core.geometry.transforms import Rigid3
from r2c2r_core.kitchen.names import named
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import JointLimits, ObjectOverride, ObjectPrompt, Overrides
from r2c2r_core.model.materials import SLIDE_FEEL, JointFeel
from r2c2r_core.model.mesh import MeshAsset
from r2c2r_core.model.motion import JointMotion, Source
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.scene import ArticulatedScene, InsidePart, Joint, Link, SceneObject
from r2c2r_core.model.track import MaskTrack
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.schema.settings import setting, tuned_numbers
from r2c2r_core.synthesize.contents import in_drawers
from r2c2r_core.synthesize.dimensions import BoxSearch, MeasuredObject, measure_object
from r2c2r_core.synthesize.filmed import (
    as_filmed,
    drawer_below,
    filmed,
    hinge_notice,
    inside_seen,
    opened_alike,
    opened_as,
    opening,
    swinging_clear,
    widest,
)
from r2c2r_core.synthesize.fixtures.boards import Boards
from r2c2r_core.synthesize.fixtures.carcass import CARCASSES, CarcassBuilder
from r2c2r_core.synthesize.fixtures.spec import Build, Motion, Order, Part
from r2c2r_core.synthesize.fixtures.table import fixture_of
from r2c2r_core.synthesize.joints import Hinge, choose_hinges
from r2c2r_core.synthesize.laps import lapped, with_hidden_edges
from r2c2r_core.synthesize.layout import arrange, settled, with_outliers
from r2c2r_core.synthesize.marked import as_marked, part_of
from r2c2r_core.synthesize.opening import open_all
from r2c2r_core.synthesize.parting import moved_apart
from r2c2r_core.synthesize.physics import friction_shut, inertial_of_boxes, inertial_of_pieces, moved_boxes, weighing
from r2c2r_core.synthesize.slabs import Slab
from r2c2r_core.synthesize.surroundings import as_said, standing_clear, surroundings_of
from r2c2r_core.synthesize.things import convex_pieces
from r2c2r_core.tuning import Changes

Outliers = Literal["leave-out", "keep"]
_WOOD = (0.80, 0.76, 0.70)


Said = TypeVar("Said")


@dataclass(frozen=True, slots=True, kw_only=True)
class SynthesizeConfig:
    """Settings of this stage."""

    seed: int = setting(0, "random seed", ge=0, lt=2**31)
    box: BoxSearch = setting("upright", "upright, or powell (as in the paper): how a box is fitted (benchmarks/boxes.json)")
    surroundings: bool = setting(True, "whether to add worktops and plinths that are visible in the scan but not clicked")
    fixtures: str = setting(CARCASSES.default, "boards, or scene-synthesizer (an extra; as in the paper): maker of carcasses")
    outliers: Outliers = setting(
        "leave-out", "leave-out, or keep as measured: an object that overlaps others beyond measurement error"
    )
    params: Changes = tuned_numbers("synthesize")


def build_scene(
    capture: Capture,
    tracks: Sequence[MaskTrack],
    placements: Sequence[Placement],
    assets: Sequence[MeshAsset],
    overrides: Overrides,
    config: SynthesizeConfig,
    unseen: Sequence[ObjectPrompt] = (),
    *,
    progress: Progress = SILENT,
) -> ArticulatedScene:
    """Articulated scene: every object measured, arranged, and built as a fixture that opens.

    `unseen` are the prompts of worktops of which depth shows nothing: one made over a run under their clicks takes their name.
    An object that cannot be measured or built is left out, with the reason; raises StageError if none can.
    """
    carcass = CARCASSES.load(config.fixtures)
    measured: list[MeasuredObject] = []
    meshes: dict[str, tuple[Placement, MeshAsset]] = {}
    failures: dict[str, str] = {}
    for track, placement, asset in progress.part(0.0, 0.5).each(
        list(zip(tracks, placements, assets, strict=True)), "measuring"
    ):
        with apart("synthesize", track.name, failures):
            measured.append(_measured(capture, track, placement, asset, overrides.of(track.name), config))
            meshes[track.name] = placement, asset
    if not measured:
        raise StageError("no object could be measured", hint="; ".join(failures.values()))
    progress.at(0.5, "arranging")
    carriers = {track.name: carrier.motion for track in tracks if track.box is not None and (carrier := track.box.carrier)}
    contents = [item for item in measured if item.name in carriers]
    fixed = {item.name for item in contents if item.fixed_by_person}
    worktops = [item for item in measured if item.spec.name == "counter" and not item.fixed_by_person]
    measured = with_hidden_edges([item for item in measured if item.name not in carriers and item not in worktops])
    layout = arrange(measured, capture.room.manhattan_yaw_rad, floor_found=capture.room.floor_found)
    if config.outliers == "keep":
        layout = with_outliers(layout, measured)
    failures |= {name: f"synthesize: {name}: left out: {why}" for name, why in layout.outliers.items()}
    placed = lapped(layout.objects)
    said: list[str] = []
    made = surroundings_of(capture, placed, [*worktops, *unseen], said, unasked=config.surroundings)
    found, sized = as_said(made, overrides)
    below = [*placed, *(item.measured(item.slab) for item in (*found, *sized))]  # worktops are known only now
    placed = tuple(settled(item, below, floor_found=capture.room.floor_found) for item in placed)
    hinges = choose_hinges(placed, overrides)
    built: list[SceneObject] = []
    for item in progress.part(0.5, 0.9).each(placed, "building"):
        with apart("synthesize", item.name, failures):
            if item.spec.fixture is None:
                built.append(_thing(item, *meshes[item.name], config.seed))
            else:
                built.append(_fixture(item, hinges.get(item.name), overrides.of(item.name), carcass))
    if not built and not made:
        raise StageError("no object could be built", hint="; ".join(failures.values()))
    built = moved_apart(built, frozenset(item.name for item in placed if item.fixed_by_person))
    progress.at(0.9, "opening every joint")
    arranged = {item.name: item for item in placed if item.name not in failures}

    def rebuild(name: str, hinge: Hinge) -> SceneObject:
        return _fixture(arranged[name], hinge, overrides.of(name), carcass)

    kept = frozenset(name for item in built for name in _uppers_said(item, overrides.of(item.name)))
    opened = open_all(built, hinges, rebuild, capture.room.walls, kept)
    opened += standing_clear(opened, found, _painted, capture.room.walls, kept, said)
    opened += [_painted(item.measured(item.slab), item.slab) for item in sized]  # as a person specified, even where it collides
    for name in [item.name for item in worktops if all(item.name != other.name for other in opened)]:
        failures[name] = f"synthesize: {name}: left out: units, other worktops or objects take its place; click it elsewhere"
    opened += in_drawers(_built(contents, meshes, config, failures), carriers, opened, fixed, failures)
    return ArticulatedScene(
        name=capture.name,
        objects=tuple(opened),
        layout_moves_m=layout.moves_m,
        warnings=(*layout.warnings, *said),
        failures=failures,
        scale=capture.scale,
    )


def _measured(
    capture: Capture,
    track: MaskTrack,
    placement: Placement,
    asset: MeshAsset,
    override: ObjectOverride,
    config: SynthesizeConfig,
) -> MeasuredObject:
    """Size and pose of an object, with warnings so far."""
    spec, notice = named(override.built_as or track.category)
    item = measure_object(capture, track, placement, asset, spec, override, seed=config.seed, box_search=config.box)
    spec, moved = opened_as(item.spec, item.motions, item.placed_pose)
    notices = [one for one in (notice, moved) if one]
    return replace(item, spec=spec, warnings=(*notices, *asset.warnings, *item.warnings))


def _fixture(item: MeasuredObject, hinge: Hinge | None, override: ObjectOverride, carcass: CarcassBuilder) -> SceneObject:
    """A category's fixture as links and joints."""
    fixture = fixture_of(item.spec)
    assert fixture is not None  # rigid objects are built from their mesh
    order = Order(
        dimensions_m=item.dimensions_m,
        material=item.spec.material,
        hinge=hinge.side if hinge else item.spec.hinge,
        handle=item.handle,
        handles=item.handles,
        laps=item.laps,
        carcass=carcass,
        inside=inside_seen(item),
        below=drawer_below(item),
    )
    build = fixture.build(order)
    base, *movers = build.parts
    marks, unmarked = _by_part(item.name, [motion.part for motion in build.motions], override.states)
    seen = {
        motion.part: as_marked(
            filmed(item.motions, item.placed_pose, motion), marks.get(motion.part, {}), motion, item.placed_pose
        )
        for motion in build.motions
    }
    edges = {motion.part: motion.origin_object for motion in build.motions}
    leaf = {part.name: part for part in movers}
    motions = {
        motion.part: as_filmed(motion, seen[motion.part], item.placed_pose, leaf[motion.part]) for motion in build.motions
    }
    movers = [swinging_clear(part, edges[part.name], motions[part.name]) for part in movers]
    links = [_link(item.name, base, np.zeros(3))]
    links += [_link(item.name, part, _link_origin(motions[part.name])) for part in movers]
    said, unheard = _limits_said(item.name, list(motions), override)
    joints = [_joint(item, motion, fixture.feel, hinge, said.get(part), seen[part]) for part, motion in motions.items()]
    leaves = {link.name: link for link in links}
    joints = opened_alike([_kept_shut(joint, leaves[joint.child]) for joint in joints])
    hinges = [hinge_notice(motion, seen[part], item.placed_pose) for part, motion in motions.items()]
    open_ended = [_open_ended(joint) for joint in joints]
    warnings = [*item.warnings, *build.notes, *unheard, *unmarked, *(line for line in (*hinges, *open_ended) if line)]
    if hinge is not None and hinge.source == "default":
        said_of = "slides to the" if item.spec.opens == "sideways" else "hinge on the"
        warnings.append(f"{said_of} {hinge.side} by default: {hinge.reason}")
    return SceneObject(
        name=item.name,
        category=item.category,
        fixture=item.spec.name,
        dimensions_m=item.dimensions_m,
        dimension_sources=item.sources,
        world_from_object=item.world_from_object,
        links=tuple(links),
        joints=tuple(joints),
        movable=False,
        warp_residual_m=None,
        warnings=tuple(warnings),
        final_from_placed=item.world_from_object @ item.placed_pose.inverse,
        inside_sources=_inside_sources(build),
    )


def _inside_sources(build: Build) -> dict[InsidePart, Source]:
    """Sources of the interior depth and shelves of an object that opens."""
    parts: tuple[InsidePart, ...] = get_args(InsidePart) if build.motions else ()
    return {part: "measured" if part in build.as_seen else "default" for part in parts}


def _painted(item: MeasuredObject, slab: Slab) -> SceneObject:
    """A fixture of one board, in its colour in the scan, as it will get no textured mesh."""
    board = _fixture(item, None, ObjectOverride(), Boards())
    return replace(board, links=tuple(replace(link, colour=slab.colour) for link in board.links))


def _built(
    items: Sequence[MeasuredObject],
    meshes: Mapping[str, tuple[Placement, MeshAsset]],
    config: SynthesizeConfig,
    failures: dict[str, str],
) -> list[SceneObject]:
    """Free bodies, where they were measured."""
    built = []
    for item in items:
        with apart("synthesize", item.name, failures):
            built.append(_thing(item, *meshes[item.name], config.seed))
    return built


def _thing(item: MeasuredObject, placement: Placement, asset: MeshAsset, seed: int) -> SceneObject:
    """A free body with convex colliders: the placed mesh, in the frame of its measured box, at its final size."""
    vertices = item.placed_pose.inverse.apply(placement.world_from_mesh.apply(asset.mesh.vertices))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    fitted = (vertices - (low + high) / 2) * (item.dimensions_m / np.maximum(high - low, 1e-6))
    pieces = convex_pieces(fitted, asset.mesh.faces, item.dimensions_m, flat_top=item.spec.flat_top, seed=seed)
    material = item.spec.material
    link = Link(
        name=f"{item.name}_base",
        object_from_link=Rigid3(),
        boxes=(),
        pieces=pieces,
        visual=None,
        colour=_WOOD,
        inertial=weighing(inertial_of_pieces(pieces, material.density_kg_m3), material.weight_kg),
    )
    return SceneObject(
        name=item.name,
        category=item.category,
        fixture="object",
        dimensions_m=item.dimensions_m,
        dimension_sources=item.sources,
        world_from_object=item.world_from_object,
        links=(link,),
        joints=(),
        movable=True,
        warp_residual_m=None,
        warnings=item.warnings,
        final_from_placed=item.world_from_object @ item.placed_pose.inverse,
    )


def _link(object_name: str, part: Part, origin: Vector3) -> Link:
    """A link with the object's axes and its origin at `origin`."""
    object_from_link = Rigid3(np.eye(3), origin)
    boxes = moved_boxes(part.boxes, object_from_link.inverse)
    return Link(
        name=f"{object_name}_{part.name}",
        object_from_link=object_from_link,
        boxes=boxes,
        pieces=(),
        visual=None,
        colour=_WOOD,
        inertial=inertial_of_boxes(boxes, part.density_kg_m3),
    )


def _link_origin(motion: Motion) -> Vector3:
    return motion.origin_object if motion.type == "revolute" else np.zeros(3)


def _limits_said(name: str, parts: Sequence[str], override: ObjectOverride) -> tuple[dict[str, JointLimits], tuple[str, ...]]:
    """A person's limits for the joint of each part, and notices of limits that match no joint."""
    said, unheard = {}, []
    if override.joint_lower is not None or override.joint_upper is not None:
        if len(parts) == 1:
            said[parts[0]] = JointLimits(override.joint_lower, override.joint_upper)
        else:
            meant = f"under joints, name any of {', '.join(parts)}" if parts else "it has none"
            unheard.append(f"joint_limits is for an object of one joint and was not used: {meant}")
    named, unknown = _by_part(name, parts, override.joints)
    return said | named, (*unheard, *unknown)


def _by_part(name: str, parts: Sequence[str], said: Mapping[str, Said]) -> tuple[dict[str, Said], tuple[str, ...]]:
    """A person's values for joints, given by joint or part name, by part; and notices of values that match no joint."""
    meant = {joint: next((part for part in parts if joint in (part, _joint_name(name, part))), None) for joint in said}
    there = ", ".join(parts) or "none"
    unheard = [
        f"corrections of a joint {joint} were not used: its joints are {there}" for joint, part in meant.items() if not part
    ]
    return {part: said[joint] for joint, part in meant.items() if part}, tuple(unheard)


def _uppers_said(item: SceneObject, override: ObjectOverride) -> set[str]:
    """Names of the object's joints whose upper limit a person gave."""
    names = {part_of(joint, item.name): joint.name for joint in item.joints}
    said, _ = _limits_said(item.name, list(names), override)
    return {names[part] for part, limits in said.items() if limits.upper is not None}


def _joint_name(object_name: str, part: str) -> str:
    return f"{object_name}_{part}_joint"


def _joint(
    item: MeasuredObject,
    motion: Motion,
    hinge_feel: JointFeel,
    hinge: Hinge | None,
    said: JointLimits | None,
    seen: JointMotion | None,
) -> Joint:
    """The joint of one moving part; a person's or observed values replace the category's. Slides all feel alike."""
    feel = hinge_feel if motion.type == "revolute" else SLIDE_FEEL
    axis: Source = hinge.source if hinge is not None else "inferred" if seen is None else seen.source
    lower, upper, limits = _limits(item, motion, said or JointLimits(None, None), seen)
    return Joint(
        name=_joint_name(item.name, motion.part),
        type=motion.type,
        parent=f"{item.name}_base",
        child=f"{item.name}_{motion.part}",
        origin_object=motion.origin_object,
        axis_object=motion.axis_object,
        lower=lower,
        upper=upper,
        effort=feel.effort,
        velocity=feel.velocity,
        damping=feel.damping,
        friction=feel.friction,
        sources={"axis": axis, "origin": "inferred" if seen is None else seen.source} | limits,
        confidence=hinge.confidence if hinge is not None else None,
        motion=seen,
    )


def _kept_shut(joint: Joint, leaf: Link) -> Joint:
    if joint.type == "prismatic":
        return joint
    return replace(joint, friction=friction_shut(joint.friction, joint.axis_object, leaf.inertial))


def _limits(
    item: MeasuredObject, motion: Motion, said: JointLimits, seen: JointMotion | None
) -> tuple[float, float, dict[str, Source]]:
    """Lower and upper limit, and the source of each ("limits" is the upper one's): a person, the scan, or the category."""
    found, source = opening(motion, seen, widest(motion.axis_object, motion.type, item.dimensions_m))
    lower = 0.0 if said.lower is None else said.lower
    upper = max(lower, found if said.upper is None else said.upper)
    of_upper: Source = source if said.upper is None and upper == found else "person"
    return lower, upper, {"limits": of_upper, **({} if said.lower is None else {"lower": "person"})}


def _open_ended(joint: Joint) -> str | None:
    """Warning that a joint was observed open beyond its category's limit, to a state that need not be its own."""
    if joint.motion is None or joint.sources["limits"] != "at_least":
        return None
    seen = joint.motion.largest
    amount = f"{seen:.2f} m" if joint.type == "prismatic" else f"{np.degrees(seen):.0f}°"
    return f"{joint.name} was seen open to {amount}, but may open further"
