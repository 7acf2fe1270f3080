"""From clicks to an object: tries what the category suggests first, then what the scan suggests."""

from dataclasses import replace

import numpy as np

from r2c2r_core.arrays import Points, Vector3
from r2c2r_core.errors import ObjectNotSeen
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.segment.appliance_clicks import appliance_front
from r2c2r_core.segment.categories import CategoryHint
from r2c2r_core.segment.found import Found, FoundAppliance, FoundFront, FoundThing
from r2c2r_core.segment.fronts import find_front, seen_sides, wall_behind
from r2c2r_core.segment.planes import PlaneRegion, region_at
from r2c2r_core.segment.small import find_small, glimpse_small
from r2c2r_core.segment.things import ThingConfig, find_thing
from r2c2r_core.segment.workbench import Workbench

_SMALL_M = 0.25  # things below this radius are carved by silhouettes


def find_object(bench: Workbench, prompt: ObjectPrompt, hint: CategoryHint, positives: Points, negatives: Points) -> Found:
    """The object under the clicks; raises ObjectNotSeen when neither a front nor a thing is there."""
    if hint.kind == "front":
        found = _front(bench, hint, positives, negatives)
        if found is not None:
            return found
    if hint.kind == "appliance":
        appliance = _appliance(bench, prompt, hint, negatives)
        if appliance is not None:
            return appliance
    thing = _thing(bench, prompt, hint, positives, negatives) if len(positives) else None
    if thing is not None:
        warnings = (
            ()
            if hint.kind != "front"
            else (f"no flat front under the click: treated as a thing of its own ({prompt.category})",)
        )
        return replace(thing, warnings=warnings)
    raise ObjectNotSeen(
        f"{prompt.name}: no surface of its own under {len(positives)} click(s)",
        hint="click on its middle, or add a second click",
    )


def glimpse_object(
    bench: Workbench, prompt: ObjectPrompt, hint: CategoryHint, positives: Points, negatives: Points
) -> Found | None:
    """A first look at what is slow to find, from depth alone: small things, appliances. None for the rest, found at once."""
    if hint.kind == "appliance":
        return _appliance(bench, prompt, hint, negatives, glimpse=True)
    if hint.kind != "thing" or hint.thing.radius_m >= _SMALL_M or not len(positives):
        return None
    small = glimpse_small(bench.scene, positives, negatives, hint.thing, _structure_off(bench, positives[0]))
    return FoundThing(small, bench.scene, small=True, round=hint.thing.round) if small is not None else None


def _front(bench: Workbench, hint: CategoryHint, positives: Points, negatives: Points) -> FoundFront | None:
    region = region_at(bench.planes, positives[0])
    run = bench.run_of(region) if region is not None else None
    if run is None:
        return None
    front = find_front(run, positives, negatives, pair=hint.pair, size=hint.size, stacked=hint.stacked)
    if front is None:
        return None
    front = replace(front, depth_m=wall_behind(run, front.cell, bench.scene.capture.room, hint.depth_m) or hint.depth_m)
    return FoundFront(replace(front, sides=seen_sides(front, bench.scene)), bench.scene, swings=not (hint.pair or hint.stacked))


def _appliance(
    bench: Workbench, prompt: ObjectPrompt, hint: CategoryHint, negatives: Points, *, glimpse: bool = False
) -> FoundAppliance | None:
    front, seen = appliance_front(bench, prompt, hint, negatives, glimpse=glimpse) or (None, False)
    if front is None:
        return None
    assumed = f"its depth was not seen: {front.depth_m:.2f} m is assumed, as for a {prompt.category}"
    return FoundAppliance(front, bench.scene, warnings=() if seen else (assumed,))


def _thing(
    bench: Workbench, prompt: ObjectPrompt, hint: CategoryHint, positives: Points, negatives: Points
) -> FoundThing | None:
    config = hint.thing
    positives = _on_thing(bench, prompt, positives, config)
    if config.radius_m < _SMALL_M:
        small = find_small(bench.scene, positives, negatives, config, _structure_off(bench, positives[0]))
        if small is not None:
            return FoundThing(replace(small, clicks=prompt.points), bench.scene, small=True, round=config.round)
    thing = find_thing(bench.scene, positives, negatives, config)
    return FoundThing(thing, bench.scene) if thing is not None else None


def _on_thing(bench: Workbench, prompt: ObjectPrompt, positives: Points, config: ThingConfig) -> Points:
    """The clicks' points, those that fell on what is behind the thing drawn forward to it; farther ones are left out."""
    points = [positives[0]]
    across = 1.2 * config.width_m + 0.02 if config.width_m is not None else 2.2 * config.radius_m
    clicks = [click for click in prompt.points if click.label == 1]
    for click, seen in zip(clicks[1:], positives[1:], strict=False):
        point = seen
        if np.linalg.norm((point - positives[0])[:2]) > across:
            origin, ray = bench.scene.ray(click.frame, click.x, click.y)
            point = origin + ray * float((positives[0] - origin)[:2] @ ray[:2]) / max(float(ray[:2] @ ray[:2]), 1e-6)
        if np.linalg.norm((point - positives[0])[:2]) <= across:
            points.append(point)
    return np.array(points)


def _structure_off(bench: Workbench, point: Vector3) -> tuple[PlaneRegion, ...]:
    """Walls and runs that a thing may touch; not the one it is itself."""
    structure = tuple(plane for plane in bench.planes if plane.area_m2 > 0.4)
    own = region_at(structure, point, 0.02)
    return tuple(plane for plane in structure if plane is not own)
